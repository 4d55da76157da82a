#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/expected.h"
#include "engine/core/time.h"

namespace hil {

/// An append-only file of checked records. Each is, little-endian,
///    0  4  "SLR1"                  12  4  bytes of payload, n
///    4  4  type                    16  n  payload
///    8  4  its number, from 0    16+n  4  CRC-32C of all before
/// and goes out in one write to a file opened for appending: whenever the program dies, at most the
/// last record is torn, and its checksum says so. When the machine dies, what was written after the
/// last sync may be gone: `sync_every` of it, or all that the kernel held back (some 30 s) when
/// that is zero.
inline constexpr std::size_t kRecordHeaderBytes = 16;
inline constexpr std::size_t kRecordChecksumBytes = 4;

/// Writes one. Thread: one, and not the loop's.
class RawLog {
 public:
  /// Replaces what stands there. Throws std::runtime_error.
  RawLog(const std::string& path, engine::Duration sync_every);
  ~RawLog();
  RawLog(const RawLog&) = delete;
  RawLog& operator=(const RawLog&) = delete;

  /// The payload is `head` and then `tail`. After the first failure nothing is written any more:
  /// what follows a gap could not be trusted.
  engine::Status append(std::uint32_t type, std::span<const std::byte> head,
                        std::span<const std::byte> tail = {}) noexcept;
  /// Syncs when the time has come: for when there is nothing to append.
  void sync_if_due() noexcept;
  [[nodiscard]] std::uint64_t written() const noexcept { return written_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// The first failure. Pre: lost() > 0.
  [[nodiscard]] const engine::Error& fault() const noexcept { return fault_; }

 private:
  engine::Status lose(int code, const char* step) noexcept;

  int file_;
  engine::Duration sync_every_;
  engine::Duration synced_at_;
  bool unsynced_ = false;
  std::uint64_t bytes_ = 0;
  std::uint64_t written_ = 0;
  std::uint64_t lost_ = 0;
  engine::Error fault_;
};

struct RawRecord {
  std::uint32_t type = 0;
  std::span<const std::byte> payload;  ///< valid until the next call
};

/// Reads what a RawLog wrote up to the first record that is not whole; never past it. Takes no more
/// memory than the file is long.
class RawLogReader {
 public:
  /// A file that cannot be read has no records and a fault.
  explicit RawLogReader(const std::string& path);
  ~RawLogReader();
  RawLogReader(const RawLogReader&) = delete;
  RawLogReader& operator=(const RawLogReader&) = delete;

  /// False at the end, and at the first record that is not whole.
  [[nodiscard]] bool next(RawRecord& record);
  /// Bytes that hold whole records: where the next one would start.
  [[nodiscard]] std::uint64_t offset() const noexcept { return offset_; }
  [[nodiscard]] std::uint64_t records() const noexcept { return records_; }
  /// What is wrong with the bytes at offset(); null when the file just ends there.
  [[nodiscard]] const char* fault() const noexcept { return fault_; }

 private:
  [[nodiscard]] bool stop(const char* fault) noexcept;
  [[nodiscard]] bool read(std::uint64_t at, std::span<std::byte> out) const noexcept;

  int file_;
  std::uint64_t bytes_ = 0;
  std::uint64_t offset_ = 0;
  std::uint64_t records_ = 0;
  const char* fault_ = nullptr;
  bool stopped_ = false;
  std::vector<std::byte> buffer_;
};

}  // namespace hil
