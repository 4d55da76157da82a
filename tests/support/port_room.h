#pragma once

#include <dirent.h>

#include <string>

#include <gtest/gtest.h>

#include "hil/command_port.h"
#include "tests/support/port_clients.h"

/// Command ports of this test's own, and what goes in and out of them.
namespace port_room {

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

inline constexpr Duration kPatience = std::chrono::seconds(20);
inline constexpr Duration kNow{};

inline CommandPortSpec any_ports() {
  CommandPortSpec spec;
  spec.udp_port = 0;
  spec.tcp_port = 0;
  return spec;
}

inline Command trim(std::uint64_t sequence) {
  Command c;
  c.kind = CommandKind::kTrim;
  c.sequence = sequence;
  c.trim_offset_rad = {1e-6 * static_cast<double>(sequence), 0.0};
  return c;
}

inline hil::Frame frame(std::uint64_t sequence) {
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

inline std::size_t open_descriptors() {
  std::size_t n = 0;
  DIR* folder = ::opendir("/proc/self/fd");
  while (::readdir(folder) != nullptr) ++n;
  ::closedir(folder);
  return n;
}

inline std::string complaint(const CommandPortSpec& spec) {
  try {
    const CommandPort port(spec);
  } catch (const engine::ConfigError& e) {
    return e.what();
  }
  return "none";
}

}  // namespace port_room
