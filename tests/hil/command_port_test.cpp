#include "hil/command_port.h"

#include <fstream>
#include <iomanip>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/command_port.h"
#include "tests/support/port_clients.h"
#include "tests/support/port_room.h"
#include "tests/support/temp_file.h"

namespace {

using namespace port_room;

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

TEST(CommandPort, AnyLookAtTheCountsHasAsManyPacketsAsEnds) {
  hil::PortCounters counters;
  std::uint64_t ends = 0;
  for (std::size_t end = 0; end < hil::kPacketEnds; ++end) {
    counters.add(static_cast<PortCount>(end), end + 1);
    ends += end + 1;
    EXPECT_EQ(counters.now()[PortCount::kPackets], ends);
  }
  counters.add(PortCount::kConnections);  // is no packet
  EXPECT_EQ(counters.now()[PortCount::kPackets], ends);
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
  EXPECT_EQ(port.counts()[PortCount::kPackets], 3U + 50U + 150U + 1U + 1U);
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
