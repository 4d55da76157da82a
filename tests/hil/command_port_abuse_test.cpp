// What a command port bears: floods, garbage, half packets, too many clients, slow ones.

#include <csignal>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/command_port.h"
#include "tests/support/port_clients.h"
#include "tests/support/port_room.h"
#include "tests/support/temp_file.h"

namespace {

using namespace port_room;

// ---- abuse ----------------------------------------------------------------------------------

TEST(CommandPort, OfABurstEveryDatagramIsAccountedFor) {
  CommandPort port(any_ports());
  const UdpClient udp(port.udp_port());
  std::uint64_t sent = 0;
  for (; sent < 10'000; ++sent) ASSERT_TRUE(udp.send(encoded(trim(sent))));
  // A ping that got through was read after all of the burst, and brought the kernel's own count.
  do {
    ASSERT_TRUE(udp.send(ping(sent++)));
    ASSERT_LT(sent, 11'000U);
  } while (!udp.readable(100));
  std::uint64_t taken = 0;
  while (port.receive(kNow).ok()) ++taken;
  const hil::PortCounts counts = port.counts();
  EXPECT_EQ(counts[PortCount::kPackets] + counts[PortCount::kKernelLost], sent);
  EXPECT_EQ(counts[PortCount::kPassedOn], taken);
  EXPECT_EQ(
      counts[PortCount::kPassedOn] + counts[PortCount::kQueueFull] + counts[PortCount::kPings],
      counts[PortCount::kPackets]);
  EXPECT_GE(taken, 100U);
  EXPECT_LE(taken, 1024U);
}

TEST(CommandPort, ABurstThatIsReadAsItComesArrivesWhole) {
  CommandPort port(any_ports());
  const TcpClient tcp(port.tcp_port());
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    ASSERT_TRUE(tcp.send(encoded(trim(i))));
    // No more under way than the queue holds.
    if (i >= 500) {
      ASSERT_EQ(port.receive(kPatience).value().sequence, i - 500);
    }
  }
  for (std::uint64_t i = 9'500; i < 10'000; ++i)
    ASSERT_EQ(port.receive(kPatience).value().sequence, i);
  EXPECT_EQ(port.counts()[PortCount::kPassedOn], 10'000U);
  EXPECT_EQ(port.counts()[PortCount::kQueueFull], 0U);
}

TEST(CommandPort, AHundredThousandRandomDatagramsAreCountedOneByOne) {
  CommandPort port(any_ports());
  const UdpClient udp(port.udp_port());
  std::mt19937_64 random(5);
  const Bytes good = encoded(trim(1));
  constexpr int kRounds = 1000;
  constexpr int kPerRound = 100;  // fit into the kernel's buffer: none is lost
  for (int round = 0; round < kRounds; ++round) {
    for (int i = 0; i < kPerRound; ++i) {
      Bytes bytes(random() % 300);
      for (std::byte& b : bytes) b = static_cast<std::byte>(random());
      if (i % 4 == 0) {  // as far as the checksum
        bytes.resize(good.size());
        std::copy_n(good.begin(), 8, bytes.begin());
      }
      udp.send(bytes);
    }
    ASSERT_TRUE(answered(udp, static_cast<std::uint64_t>(round)));
  }
  EXPECT_FALSE(port.receive(kNow).ok());
  const hil::PortCounts counts = port.counts();
  EXPECT_EQ(counts[PortCount::kPackets], kRounds * (kPerRound + 1));
  EXPECT_EQ(counts[PortCount::kPings], kRounds);
  EXPECT_EQ(counts[PortCount::kChecksum], kRounds * kPerRound / 4);
  EXPECT_EQ(counts[PortCount::kMalformed], kRounds * kPerRound * 3 / 4);
  EXPECT_EQ(counts[PortCount::kKernelLost], 0U);
  EXPECT_EQ(counts[PortCount::kPassedOn], 0U);
}

TEST(CommandPort, DatagramsOfEveryLengthAreRefusedOrTaken) {
  CommandPort port(any_ports());
  const UdpClient udp(port.udp_port());
  ASSERT_TRUE(answered(udp, 0));
  std::uint64_t sent = 1;
  for (const std::size_t length : {0U, 1U, 5U, 6U, 71U, 72U, 168U, 169U, 1500U, 65'000U}) {
    Bytes bytes = encoded(trim(5));
    bytes.resize(length);
    ASSERT_TRUE(udp.send(bytes));
    ++sent;
  }
  ASSERT_TRUE(answered(udp, 1));
  EXPECT_EQ(port.counts()[PortCount::kMalformed], sent - 1);
}

TEST(CommandPort, NumbersThatAreNoneAreRefusedAndChangeNothing) {
  CommandPort port(any_ports());
  const TcpClient tcp(port.tcp_port());
  Command poison = trim(1);
  poison.trim_offset_rad[0] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(tcp.send(encoded(poison)));
  ASSERT_TRUE(tcp.send(encoded(trim(2))));  // the stream goes on
  EXPECT_EQ(port.receive(kPatience).value().sequence, 2U);
  EXPECT_EQ(port.counts()[PortCount::kBadValue], 1U);
  EXPECT_EQ(port.counts()[PortCount::kPackets], 2U);
}

// ---- streams --------------------------------------------------------------------------------

TEST(CommandPort, AStreamMayComeByteByByteOrAllAtOnce) {
  CommandPort port(any_ports());
  const TcpClient tcp(port.tcp_port());
  const int on = 1;
  ::setsockopt(tcp.fd(), IPPROTO_TCP, 1 /* TCP_NODELAY */, &on, sizeof on);
  for (std::uint64_t i = 0; i < 3; ++i)
    for (const std::byte b : encoded(trim(i))) ASSERT_TRUE(tcp.send(std::span(&b, 1)));
  Bytes together;
  for (std::uint64_t i = 3; i < 500; ++i) {
    const Bytes one = encoded(trim(i));
    together.insert(together.end(), one.begin(), one.end());
  }
  ASSERT_TRUE(tcp.send(together));
  for (std::uint64_t i = 0; i < 500; ++i) {
    const auto command = port.receive(kPatience);
    ASSERT_TRUE(command.ok()) << i;
    ASSERT_EQ(command.value().sequence, i);
  }
  EXPECT_EQ(port.counts()[PortCount::kPackets], 500U);
}

TEST(CommandPort, HalfAPacketIsNone) {
  CommandPort port(any_ports());
  const Bytes whole = encoded(trim(1));
  for (const std::size_t bytes : {1U, 6U, 60U, 111U}) {
    const TcpClient tcp(port.tcp_port());
    ASSERT_TRUE(tcp.send(std::span(whole).first(bytes)));
  }
  EXPECT_TRUE(eventually([&] { return port.counts()[PortCount::kCutShort] == 4; }));
  EXPECT_EQ(port.counts()[PortCount::kPackets], 0U);
  EXPECT_FALSE(port.receive(kNow).ok());
}

TEST(CommandPort, AStreamThatIsNotOursIsClosed) {
  CommandPort port(any_ports());
  Bytes wrong_checksum = encoded(trim(1));
  wrong_checksum[80] ^= std::byte{1};
  Bytes telemetry(100, std::byte{0});
  telemetry[0] = std::byte{0x0A};
  const std::string text = "GET / HTTP/1.1\r\n\r\n";
  Bytes http;
  for (const char c : text) http.push_back(static_cast<std::byte>(c));
  Bytes endless = encoded(trim(1));
  endless[4] = endless[5] = std::byte{0xFF};
  std::uint64_t closed = 0;
  for (const Bytes& garbage : {wrong_checksum, telemetry, http, endless}) {
    const TcpClient tcp(port.tcp_port());
    ASSERT_TRUE(answered(tcp, 1));
    ASSERT_TRUE(tcp.send(garbage));
    EXPECT_TRUE(tcp.ends());
    EXPECT_TRUE(
        eventually([&] { return port.counts()[PortCount::kConnectionsClosed] == closed + 1; }));
    ++closed;
  }
  EXPECT_EQ(port.counts()[PortCount::kMalformed], 3U);
  EXPECT_EQ(port.counts()[PortCount::kChecksum], 1U);
  EXPECT_EQ(port.counts()[PortCount::kPackets], 4U + 4U);  // each with its ping
  EXPECT_TRUE(eventually([&] { return !port.has_reader(); }));
}

TEST(CommandPort, AThousandReconnectsLeaveNothingBehind) {
  CommandPort port(any_ports());
  std::uint32_t last_sender = 0;
  const auto reconnect = [&](std::uint64_t k) {
    const TcpClient tcp(port.tcp_port());
    ASSERT_TRUE(tcp.send(encoded(trim(k))));
    const auto command = port.receive(kPatience);
    ASSERT_TRUE(command.ok());
    ASSERT_EQ(command.value().sequence, k);
    ASSERT_NE(command.value().sender, last_sender);
    last_sender = command.value().sender;
    static_cast<void>(port.send(frame(k), kNow));  // it may write to one that has just left
  };
  reconnect(0);
  ASSERT_TRUE(eventually([&] { return !port.has_reader(); }));
  const std::size_t before = open_descriptors();
  for (std::uint64_t k = 1; k <= 1000; ++k) {
    reconnect(k);
    if (HasFatalFailure()) return;
    ASSERT_TRUE(eventually([&] { return !port.has_reader(); })) << k;
  }
  EXPECT_EQ(open_descriptors(), before);
  EXPECT_EQ(port.counts()[PortCount::kConnections], 1001U);
  EXPECT_EQ(port.counts()[PortCount::kPassedOn], 1001U);
}

// ---- limits ---------------------------------------------------------------------------------

TEST(CommandPort, ANinthClientIsRefused) {
  CommandPort port(any_ports());
  std::vector<std::unique_ptr<UdpClient>> udp;
  std::vector<std::unique_ptr<TcpClient>> tcp;
  for (int i = 0; i < 8; ++i) {
    udp.push_back(std::make_unique<UdpClient>(port.udp_port()));
    tcp.push_back(std::make_unique<TcpClient>(port.tcp_port()));
    ASSERT_TRUE(answered(*udp.back(), 1));
    ASSERT_TRUE(answered(*tcp.back(), 1));
  }
  const UdpClient ninth_udp(port.udp_port());
  ASSERT_TRUE(ninth_udp.send(encoded(trim(1))));
  EXPECT_TRUE(eventually([&] { return port.counts()[PortCount::kTooManyClients] == 1; }));
  const TcpClient ninth_tcp(port.tcp_port());
  EXPECT_TRUE(ninth_tcp.ends());
  EXPECT_EQ(port.counts()[PortCount::kConnectionsRefused], 1U);
  EXPECT_FALSE(port.receive(kNow).ok());
  // The others do not notice, and a place that is free again is given away.
  ASSERT_TRUE(answered(*udp[0], 2));
  ASSERT_TRUE(answered(*tcp[0], 2));
  tcp.pop_back();
  EXPECT_TRUE(eventually([&] { return answered(TcpClient(port.tcp_port()), 1); }));
}

TEST(CommandPort, AUdpClientThatFallsSilentMakesRoom) {
  CommandPortSpec spec = any_ports();
  spec.idle_limit = Duration(100'000'000);
  CommandPort port(spec);
  const UdpClient udp(port.udp_port());
  ASSERT_TRUE(answered(udp, 1));
  EXPECT_TRUE(eventually([&] { return !port.has_reader(); }));
  ASSERT_TRUE(answered(udp, 1));  // and is welcome again
}

TEST(CommandPort, AConnectionThatNeverSaysAnythingIsClosedAndOneThatDidIsNot) {
  CommandPortSpec spec = any_ports();
  spec.idle_limit = Duration(100'000'000);
  CommandPort port(spec);
  const TcpClient client(port.tcp_port());
  ASSERT_TRUE(answered(client, 1));
  const TcpClient mute(port.tcp_port());
  EXPECT_TRUE(mute.ends());
  EXPECT_EQ(port.counts()[PortCount::kConnectionsClosed], 1U);
  EXPECT_TRUE(answered(client, 2));
}

TEST(CommandPort, ASlowReaderLosesTelemetryAndNobodyWaitsForIt) {
  CommandPort port(any_ports());
  const TcpClient slow(port.tcp_port(), 4096);
  ASSERT_TRUE(slow.send(ping(1)));  // and never reads
  const TcpClient quick(port.tcp_port());
  ASSERT_TRUE(answered(quick, 1));
  ASSERT_TRUE(eventually([&] { return port.counts()[PortCount::kPings] == 2; }));
  std::uint64_t k = 0;
  for (; port.counts()[PortCount::kTelemetryLost] < 100 && k < 100'000; ++k) {
    ASSERT_TRUE(port.send(frame(k), kNow).ok());
    const auto news = next<hil::FrameNews>(quick);  // gets each of them
    ASSERT_TRUE(news);
    ASSERT_EQ(news->frame, k);
  }
  EXPECT_GE(port.counts()[PortCount::kTelemetryLost], 100U);
  ASSERT_TRUE(answered(quick, 2));
  // What it finds when it reads at last are whole packets, older ones first, the newest among them.
  std::uint64_t last = 0;
  bool gap = false;
  while (last + 1 < k) {
    const auto news = next<hil::FrameNews>(slow);
    ASSERT_TRUE(news);
    gap = gap || news->frame > last + 1;
    ASSERT_GE(news->frame, last);
    last = news->frame;
  }
  EXPECT_TRUE(gap);
}

TEST(CommandPort, FramesThatComeFasterThanTheyGoAreCounted) {
  CommandPort port(any_ports());
  std::uint64_t busy = 0;
  for (std::uint64_t k = 0; busy < 10 && k < 10'000'000; ++k) {
    const engine::Status status = port.send(frame(k), kPatience);
    if (status.ok()) continue;
    EXPECT_EQ(status.error().fault, Fault::kBusy);
    ++busy;
  }
  EXPECT_EQ(busy, 10U);
  EXPECT_EQ(port.counts()[PortCount::kFramesLost], busy);
}

TEST(CommandPort, AClientThatLeavesKillsNobody) {
  struct sigaction before {};
  struct sigaction deadly {};
  deadly.sa_handler = SIG_DFL;
  ::sigaction(SIGPIPE, &deadly, &before);
  CommandPort port(any_ports());
  for (std::uint64_t round = 0; round < 20; ++round) {
    auto tcp = std::make_unique<TcpClient>(port.tcp_port());
    ASSERT_TRUE(answered(*tcp, 1));
    // A reset instead of an end: what is still written to it meets a broken pipe.
    const linger at_once{1, 0};
    ::setsockopt(tcp->fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    static_cast<void>(port.send(frame(3 * round), kNow));
    tcp.reset();
    static_cast<void>(port.send(frame(3 * round + 1), kNow));
    static_cast<void>(port.send(frame(3 * round + 2), kNow));
    ASSERT_TRUE(eventually([&] { return !port.has_reader(); }));
  }
  ::sigaction(SIGPIPE, &before, nullptr);
  const UdpClient udp(port.udp_port());
  EXPECT_TRUE(answered(udp, 1));
}

TEST(CommandPort, EndsWithClientsConnectedAndPacketsUnderWay) {
  for (int i = 0; i < 20; ++i) {
    auto port = std::make_unique<CommandPort>(any_ports());
    const TcpClient tcp(port->tcp_port());
    const UdpClient udp(port->udp_port());
    ASSERT_TRUE(answered(udp, 1));
    const Bytes whole = encoded(trim(1));
    ASSERT_TRUE(tcp.send(std::span(whole).first(50)));
    for (std::uint64_t k = 0; k < 10; ++k) static_cast<void>(port->send(frame(k), kNow));
    port.reset();
    EXPECT_TRUE(tcp.ends());
  }
}

}  // namespace
