#pragma once

#include <cstdint>

/// Counts what a program takes from the heap, on all of its threads and in all of its libraries.
/// Linking no_alloc.cpp into an executable puts a counter in front of malloc and its kin, of which
/// operator new is one.
namespace no_alloc {

/// False where a sanitizer has put itself in front of malloc already: then nothing is counted.
[[nodiscard]] bool armed() noexcept;
/// Allocations since the program started.
[[nodiscard]] std::uint64_t count() noexcept;

}  // namespace no_alloc
