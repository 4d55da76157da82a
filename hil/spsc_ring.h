#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace hil {

/// The only way data crosses a thread: one pushes, one pops, nobody waits.
template <class T, std::size_t Capacity>
class SpscRing {
 public:
  /// Thread: the one producer. False when full; `value` is then not taken.
  [[nodiscard]] bool push(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    // Acquire: the consumer has finished reading the slot we are about to overwrite.
    if (head - tail_.load(std::memory_order_acquire) == Capacity) return false;
    slots_[head % Capacity] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Thread: the one consumer. False when empty.
  [[nodiscard]] bool pop(T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    // Acquire: the producer has finished writing the slot we are about to read.
    if (head_.load(std::memory_order_acquire) == tail) return false;
    value = slots_[tail % Capacity];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

 private:
  // A cache line each, so that the two threads do not fight over one.
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
  alignas(64) std::array<T, Capacity> slots_{};
};

}  // namespace hil
