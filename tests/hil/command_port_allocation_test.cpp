#include <gtest/gtest.h>

#include "hil/command_port.h"
#include "tests/support/no_alloc.h"
#include "tests/support/port_clients.h"

namespace {

using engine::Duration;

// Of all threads: the port's own takes no memory for a packet either.
TEST(CommandPortAllocation, NeitherFramesNorCommandsTakeMemory) {
  if (!no_alloc::armed()) GTEST_SKIP() << "a sanitizer stands in front of malloc";
  hil::CommandPortSpec spec;
  spec.udp_port = 0;
  hil::CommandPort port(spec);
  const port_clients::UdpClient udp(port.udp_port());
  hil::Command trim;
  trim.kind = hil::CommandKind::kTrim;
  hil::Frame frame;
  std::uint64_t received = 0;
  std::uint64_t sent = 0;
  const auto allocations_for = [&](std::uint64_t rounds) {
    const std::uint64_t before = no_alloc::count();
    for (std::uint64_t k = 0; k < rounds; ++k) {
      ++trim.sequence;
      const hil::CommandPacket packet = hil::encode_command(trim);
      static_cast<void>(udp.send(packet.bytes()));
      if (port.receive(std::chrono::seconds(20)).ok()) ++received;
      if (port.send(frame, Duration{}).ok()) ++sent;
      // Whoever waits does not take any either.
      static_cast<void>(port.receive(Duration{}));
    }
    return no_alloc::count() - before;
  };
  static_cast<void>(allocations_for(100));
  EXPECT_EQ(allocations_for(10), 0U);
  EXPECT_EQ(allocations_for(1000), 0U);
  EXPECT_EQ(received, 1110U);  // nothing that moves takes no memory, too
  EXPECT_GE(sent, 100U);
}

}  // namespace
