#include "tools/starloop/provenance.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <thread>

namespace starloop {
namespace {

/// The first line of what a command says; empty when it fails.
std::string first_line_of(const std::string& command) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::array<char, 128> line{};
  if (pipe == nullptr || std::fgets(line.data(), line.size(), pipe.get()) == nullptr) return {};
  std::string text = line.data();
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(':');
    if (line.starts_with("model name") && colon + 2 < line.size()) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

Provenance provenance() {
  std::string commit = first_line_of("git -C '" STARLOOP_SOURCE_DIR
                                     "' describe --always --dirty --exclude='*' 2>/dev/null");
  if (commit.empty()) commit = "unknown";
  return {STARLOOP_VERSION, commit, processor_name(),
          static_cast<int>(std::thread::hardware_concurrency())};
}

}  // namespace starloop
