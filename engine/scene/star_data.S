/* The star catalogue that is built in: data/stars.bin, see engine/scene/star_catalogue.h. */
  .section .rodata
  .balign 16
  .global starloop_star_data
  .global starloop_star_data_end
starloop_star_data:
  .incbin "stars.bin"
starloop_star_data_end:
  .section .note.GNU-stack, "", %progbits
