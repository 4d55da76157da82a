/* Commands as CCSDS Space Packets, and the checksum that they and the frames carry. Not installed;
 * starloop_encode is declared in starloop_client.h, the layout is in hil/space_packet.h. */
#ifndef STARLOOP_CLIENT_SPACE_PACKET_H
#define STARLOOP_CLIENT_SPACE_PACKET_H

#include <stddef.h>
#include <stdint.h>

/* CRC-32C (Castagnoli), as iSCSI (RFC 3720, B.4) defines it: "123456789" gives 0xE3069283. */
#ifdef __cplusplus
extern "C"
#endif
    uint32_t
    starloop_crc32c(const void *bytes, size_t count);

#endif
