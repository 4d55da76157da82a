#include "hil/command_port.h"

#include <dirent.h>

#include <csignal>
#include <fstream>
#include <iomanip>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/port_clients.h"
#include "tests/support/temp_file.h"

namespace {

using engine::Duration;
using engine::Fault;
using hil::Command;
using hil::CommandKind;
using hil::CommandPort;
using hil::CommandPortSpec;
using hil::PortCount;
using port_clients::answered;
using port_clients::Bytes;
using port_clients::encoded;
using port_clients::eventually;
using port_clients::next;
using port_clients::ping;
using port_clients::TcpClient;
using port_clients::UdpClient;

constexpr Duration kPatience = std::chrono::seconds(20);
constexpr Duration kNow{};

CommandPortSpec any_ports() {
  CommandPortSpec spec;
  spec.udp_port = 0;
  spec.tcp_port = 0;
  return spec;
}

Command trim(std::uint64_t sequence) {
  Command c;
  c.kind = CommandKind::kTrim;
  c.sequence = sequence;
  c.trim_offset_rad = {1e-6 * static_cast<double>(sequence), 0.0};
  return c;
}

hil::Frame frame(std::uint64_t sequence) {
  hil::Frame f;
  f.sequence = sequence;
  f.shutter_open = engine::SimTime(Duration(1'000'000'000 + static_cast<std::int64_t>(sequence)));
  f.exposure = Duration(4'000'000);
  f.trim_rad = {1e-4, 2e-4};
  f.measured.j2000_to_camera = {0.5, 0.5, -0.5, 0.5};
  f.counts.skipped = 3;
  f.counts.refused[hil::Refusal::kStale] = 9;
  return f;
}

/// Every packet has one end.
void expect_adds_up(const hil::PortCounts& counts) {
  std::uint64_t ends = 0;
  for (std::size_t i = 0; i < hil::kPacketEnds; ++i) ends += counts.values[i];
  EXPECT_EQ(ends, counts[PortCount::kPackets]);
}

std::size_t open_descriptors() {
  std::size_t n = 0;
  DIR* folder = ::opendir("/proc/self/fd");
  while (::readdir(folder) != nullptr) ++n;
  ::closedir(folder);
  return n;
}

std::string complaint(const CommandPortSpec& spec) {
  try {
    const CommandPort port(spec);
  } catch (const engine::ConfigError& e) {
    return e.what();
  }
  return "none";
}

// ---- commands in, telemetry out -------------------------------------------------------------

TEST(CommandPort, ACommandArrivesByBothWaysAndSaysWhoSentIt) {
  CommandPort port(any_ports());
  const UdpClient udp(port.udp_port());
  const TcpClient tcp(port.tcp_port());
  ASSERT_TRUE(udp.send(encoded(trim(41))));
  const auto first = port.receive(kPatience);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first.value().sequence, 41U);
  EXPECT_EQ(first.value().trim_offset_rad, trim(41).trim_offset_rad);
  ASSERT_TRUE(tcp.send(encoded(trim(42))));
  const auto second = port.receive(kPatience);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second.value().sequence, 42U);
  EXPECT_NE(second.value().sender, first.value().sender);
  ASSERT_TRUE(udp.send(encoded(trim(43))));
  EXPECT_EQ(port.receive(kPatience).value().sender, first.value().sender);
  EXPECT_EQ(port.counts()[PortCount::kPassedOn], 3U);
}

TEST(CommandPort, WhatDoesNotComeIsATimeout) {
  CommandPort port(any_ports());
  const auto nothing = port.receive(kNow);
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().fault, Fault::kTimeout);
}

TEST(CommandPort, APingIsAnsweredAndNotPassedOn) {
  CommandPort port(any_ports());
  EXPECT_FALSE(port.has_reader());
  const UdpClient udp(port.udp_port());
  ASSERT_TRUE(udp.send(ping(7)));
  const auto pong = next<hil::Pong>(udp);
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->sequence, 7U);
  EXPECT_EQ(pong->frame, hil::kNoFrame);
  EXPECT_TRUE(port.has_reader());
  const TcpClient tcp(port.tcp_port());
  EXPECT_TRUE(answered(tcp, 8));
  EXPECT_FALSE(port.receive(kNow).ok());
  EXPECT_EQ(port.counts()[PortCount::kPings], 2U);
  EXPECT_EQ(port.counts()[PortCount::kPassedOn], 0U);
}

TEST(CommandPort, EveryClientIsToldOfEveryFrame) {
  CommandPort port(any_ports());
  const UdpClient udp(port.udp_port());
  const TcpClient tcp(port.tcp_port());
  ASSERT_TRUE(answered(udp, 1));
  ASSERT_TRUE(answered(tcp, 1));
  const auto listen = [&port](const auto& client, std::uint64_t k) {
    const auto news = next<hil::FrameNews>(client);
    ASSERT_TRUE(news);
    EXPECT_EQ(news->frame, k);
    EXPECT_EQ(news->shutter_open, frame(k).shutter_open);
    EXPECT_EQ(news->exposure, frame(k).exposure);
    EXPECT_EQ(news->counts.skipped, 3U);
    const auto attitude = next<hil::AttitudeNews>(client);
    ASSERT_TRUE(attitude);
    EXPECT_EQ(attitude->frame, k);
    EXPECT_EQ(attitude->mid_exposure, frame(k).shutter_open + frame(k).exposure / 2);
    EXPECT_EQ(attitude->measured.j2000_to_camera, frame(k).measured.j2000_to_camera);
    EXPECT_EQ(attitude->trim_rad, frame(k).trim_rad);
    if (k % 10 != 0) return;
    const auto time = next<hil::TimeNews>(client);
    ASSERT_TRUE(time);
    EXPECT_GT(time->monotonic, Duration{});
    const auto housekeeping = next<hil::Housekeeping>(client);
    ASSERT_TRUE(housekeeping);
    EXPECT_EQ(housekeeping->counts.refused[hil::Refusal::kStale], 9U);
    EXPECT_EQ(housekeeping->port[PortCount::kPings], 2U);
    EXPECT_LE(housekeeping->port[PortCount::kTelemetrySent],
              port.counts()[PortCount::kTelemetrySent]);
  };
  for (std::uint64_t k = 0; k < 21; ++k) {
    ASSERT_TRUE(port.send(frame(k), kNow).ok());
    listen(udp, k);
    listen(tcp, k);
  }
  ASSERT_TRUE(udp.send(ping(9)));
  EXPECT_EQ(next<hil::Pong>(udp)->frame, 20U);
}

TEST(CommandPort, WhoHasSaidNothingIsToldNothing) {
  CommandPort port(any_ports());
  const TcpClient mute(port.tcp_port());
  const TcpClient tcp(port.tcp_port());
  ASSERT_TRUE(answered(tcp, 1));
  ASSERT_TRUE(port.send(frame(0), kNow).ok());
  ASSERT_TRUE(next<hil::Housekeeping>(tcp));
  EXPECT_FALSE(mute.readable(0));
  EXPECT_EQ(port.counts()[PortCount::kConnections], 2U);
}

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
  expect_adds_up(counts);
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
  expect_adds_up(port.counts());
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
  EXPECT_TRUE(eventually([&] { return !port.has_reader(); }));
  expect_adds_up(port.counts());
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
  expect_adds_up(port.counts());
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

// ---- who may ---------------------------------------------------------------------------------

/// The addresses, as the kernel prints them, on which a port of ours is open.
std::vector<std::string> listening_at(const std::string& table, std::uint16_t port) {
  std::ostringstream hex;
  hex << ':' << std::uppercase << std::hex << std::setw(4) << std::setfill('0') << port;
  std::ifstream file(table);
  std::vector<std::string> found;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string number;
    std::string local;
    std::string remote;
    words >> number >> local >> remote;
    if (local.ends_with(hex.str()) && remote.ends_with(":0000")) found.push_back(local);
  }
  return found;
}

TEST(CommandPort, ListensOnLoopbackAlone) {
  const CommandPort port(any_ports());
  const std::vector<std::pair<std::string, std::uint16_t>> ports = {{"udp", port.udp_port()},
                                                                    {"tcp", port.tcp_port()}};
  for (const auto& [protocol, number] : ports) {
    const auto where = listening_at("/proc/net/" + protocol, number);
    ASSERT_EQ(where.size(), 1U) << protocol;
    EXPECT_TRUE(where[0].starts_with("0100007F:")) << where[0];  // 127.0.0.1, least byte first
    EXPECT_TRUE(listening_at("/proc/net/" + protocol + "6", number).empty());
  }
}

TEST(CommandPort, OnlyTheSocketsThatAreAskedForAreOpen) {
  CommandPortSpec spec;
  spec.udp_port = 0;
  const CommandPort udp_only(spec);
  EXPECT_NE(udp_only.udp_port(), 0U);
  EXPECT_EQ(udp_only.tcp_port(), 0U);
  spec = {};
  spec.tcp_port = 0;
  const CommandPort tcp_only(spec);
  EXPECT_EQ(tcp_only.udp_port(), 0U);
  EXPECT_NE(tcp_only.tcp_port(), 0U);
}

TEST(CommandPort, WithoutAKeyOnlyLoopbackIsAllowed) {
  CommandPortSpec spec = any_ports();
  for (const char* open : {"0.0.0.0", "192.0.2.1", "::", "2001:db8::1", "::ffff:192.0.2.1"}) {
    spec.address = open;
    EXPECT_EQ(complaint(spec),
              "command_port.address must be a loopback address unless key_file is given, got " +
                  spec.address);
  }
  for (const char* nonsense : {"localhost", "", "127.0.0", "127.0.0.1:80"}) {
    spec.address = nonsense;
    EXPECT_EQ(complaint(spec),
              "command_port.address must be an IP address, got \"" + std::string(nonsense) + "\"");
  }
  spec.address = "127.0.0.1";
  EXPECT_EQ(complaint(spec), "none");
  const test_support::TempFile key("port_key", "00112233445566778899aabbccddeeff");
  spec.address = "0.0.0.0";
  spec.key_file = key.path();
  EXPECT_EQ(complaint(spec), "none");
  spec.key_file += ".missing";
  EXPECT_EQ(complaint(spec), "command_port.key_file cannot read the key file " + spec.key_file);
}

TEST(CommandPort, APortThatIsTakenIsComplainedOf) {
  const CommandPort first(any_ports());
  CommandPortSpec spec;
  spec.udp_port = first.udp_port();
  EXPECT_EQ(complaint(spec),
            "command_port.udp_port cannot be had on 127.0.0.1: Address already in use");
  spec = {};
  spec.tcp_port = first.tcp_port();
  EXPECT_EQ(complaint(spec),
            "command_port.tcp_port cannot be had on 127.0.0.1: Address already in use");
}

TEST(CommandPort, WithAKeyOnlyFreshSignedPacketsCount) {
  const test_support::TempFile file("port_key", "00112233445566778899aabbccddeeff");
  const hil::PacketKey key = hil::PacketKey::from_file(file.path(), "test");
  const hil::PacketKey other(Bytes(16, std::byte{1}));
  CommandPortSpec spec = any_ports();
  spec.key_file = file.path();
  CommandPort port(spec);
  const UdpClient udp(port.udp_port());
  ASSERT_TRUE(udp.send(encoded(trim(100))));          // unsigned
  ASSERT_TRUE(udp.send(encoded(trim(101), &other)));  // another's key
  Bytes forged = encoded(trim(102), &key);
  const Bytes donor = encoded(trim(103), &other);
  std::copy(donor.end() - 36, donor.end() - 4, forged.end() - 36);
  ASSERT_TRUE(udp.send(forged));  // the checksum does not hold either
  EXPECT_TRUE(eventually([&] { return port.counts()[PortCount::kPackets] == 3; }));
  EXPECT_EQ(port.counts()[PortCount::kUnsigned], 1U);
  EXPECT_EQ(port.counts()[PortCount::kBadSignature], 1U);
  EXPECT_EQ(port.counts()[PortCount::kChecksum], 1U);
  EXPECT_FALSE(port.has_reader());  // nobody has become a client by that

  std::vector<Bytes> captured;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    captured.push_back(encoded(trim(i), &key));
    ASSERT_TRUE(udp.send(captured.back()));
    const auto command = port.receive(kPatience);
    ASSERT_TRUE(command.ok());
    EXPECT_EQ(command.value().sequence, i);
  }
  // Every one of them again: from the same endpoint, from another, and over TCP.
  const UdpClient thief(port.udp_port());
  const TcpClient tcp(port.tcp_port());
  for (const Bytes& packet : captured) {
    ASSERT_TRUE(udp.send(packet));
    ASSERT_TRUE(thief.send(packet));
    ASSERT_TRUE(tcp.send(packet));
  }
  EXPECT_TRUE(eventually([&] { return port.counts()[PortCount::kReplayed] == 150; }));
  EXPECT_FALSE(port.receive(kNow).ok());
  // The honest sender goes on, over either.
  ASSERT_TRUE(tcp.send(encoded(trim(51), &key)));
  EXPECT_EQ(port.receive(kPatience).value().sequence, 51U);
  EXPECT_TRUE(answered(udp, 52, &key));
  EXPECT_EQ(port.counts()[PortCount::kPassedOn], 51U);
  expect_adds_up(port.counts());
}

TEST(CommandPort, WithAKeyAStreamThatIsUnsignedOrForgedIsClosed) {
  const test_support::TempFile file("port_key", "00112233445566778899aabbccddeeff");
  const hil::PacketKey other(Bytes(16, std::byte{1}));
  CommandPortSpec spec = any_ports();
  spec.key_file = file.path();
  CommandPort port(spec);
  for (const Bytes& packet : {encoded(trim(1)), encoded(trim(1), &other)}) {
    const TcpClient tcp(port.tcp_port());
    ASSERT_TRUE(tcp.send(packet));
    EXPECT_TRUE(tcp.ends());
  }
  EXPECT_FALSE(port.has_reader());
  EXPECT_EQ(port.counts()[PortCount::kUnsigned], 1U);
  EXPECT_EQ(port.counts()[PortCount::kBadSignature], 1U);
}

// ---- the scenario ----------------------------------------------------------------------------

std::optional<CommandPortSpec> read(const std::string& text) {
  const auto reader = engine::ConfigReader::from_text(text, "a.toml");
  auto spec = hil::read_command_port(reader.table("command_port"));
  reader.reject_unknown_keys();
  return spec;
}

TEST(CommandPort, IsReadFromItsTable) {
  EXPECT_FALSE(read("").has_value());
  EXPECT_FALSE(read("[command_port]\n").has_value());
  const auto spec =
      read("[command_port]\naddress = \"::1\"\nudp_port = 0\ntcp_port = 65535\nkey_file = \"k\"\n");
  ASSERT_TRUE(spec);
  EXPECT_EQ(spec->address, "::1");
  EXPECT_EQ(spec->udp_port, 0);
  EXPECT_EQ(spec->tcp_port, 65535);
  EXPECT_EQ(spec->key_file, "k");
  const auto udp = read("[command_port]\nudp_port = 4000\n");
  ASSERT_TRUE(udp);
  EXPECT_EQ(udp->address, "127.0.0.1");
  EXPECT_FALSE(udp->tcp_port.has_value());
}

TEST(CommandPort, ComplainsOfTheLineThatIsWrong) {
  EXPECT_THROW(static_cast<void>(read("[command_port]\nudp_port = 65536\n")), engine::ConfigError);
  EXPECT_THROW(static_cast<void>(read("[command_port]\nudp_port = -1\n")), engine::ConfigError);
  EXPECT_THROW(static_cast<void>(read("[command_port]\naddress = \"::1\"\n")), engine::ConfigError);
  EXPECT_THROW(static_cast<void>(read("[command_port]\nport = 1\nudp_port = 1\n")),
               engine::ConfigError);
  const auto spec = read("[command_port]\nudp_port = 0\n\naddress = \"0.0.0.0\"\n");
  EXPECT_EQ(complaint(*spec),
            "a.toml:4: command_port.address must be a loopback address unless key_file is given, "
            "got 0.0.0.0");
}

}  // namespace
