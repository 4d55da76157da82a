#pragma once

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace engine {

/// The user's configuration is wrong. The text reads "file:line: table.key what was expected, got
/// what was found", so that an editor can jump to it.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& text) : std::runtime_error(text) {}
};

[[noreturn]] inline void contract_broken(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: our own mistake: ENSURE(%s) does not hold\n", file, line, condition);
  std::abort();
}

}  // namespace engine

/// Our own code promised `condition`. Armed in every build; the condition has no side effect.
#define ENSURE(condition) \
  ((condition) ? static_cast<void>(0) : ::engine::contract_broken(#condition, __FILE__, __LINE__))
