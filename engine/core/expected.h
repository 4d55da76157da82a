#pragma once

#include <cstdint>
#include <utility>
#include <variant>

#include "engine/core/contract.h"

namespace engine {

/// What the world (cable, kernel, time) did to us.
enum class Fault : std::uint8_t {
  kTimeout,       ///< nothing happened within the time allowed
  kBusy,          ///< the other side still holds every slot
  kDisconnected,  ///< the other side is gone
  kRejected,      ///< the other side, or a check of ours, refused the data
  kSystem,        ///< the operating system said no
};

/// Which step failed, why, and with what `errno` (0 where there is none).
struct Error {
  Fault fault = Fault::kSystem;
  int code = 0;
  const char* step = "";  ///< a string literal
};

/// A value, or the fault that kept it from being. Never throws, never allocates by itself.
template <class T>
class Expected {
 public:
  Expected(T value) : state_(std::move(value)) {}
  Expected(Error error) : state_(error) {}

  [[nodiscard]] bool ok() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return ok(); }
  /// Pre: ok().
  [[nodiscard]] const T& value() const noexcept {
    ENSURE(ok());
    return *std::get_if<0>(&state_);
  }
  /// Pre: !ok().
  [[nodiscard]] const Error& error() const noexcept {
    ENSURE(!ok());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

struct Done {};
using Status = Expected<Done>;

}  // namespace engine
