#include "hil/raw_log.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include "engine/core/crc32c.h"
#include "hil/steady_clock.h"

namespace hil {
namespace {

constexpr std::uint32_t kMagic = 0x31524C53;  // "SLR1"

struct Header {
  std::uint32_t magic = kMagic;
  std::uint32_t type = 0;
  std::uint32_t number = 0;
  std::uint32_t payload_bytes = 0;
};
static_assert(sizeof(Header) == kRecordHeaderBytes);

/// writev takes pointers to non-const and does not write through them.
iovec piece(std::span<const std::byte> bytes) noexcept {
  return {const_cast<std::byte*>(bytes.data()), bytes.size()};
}

}  // namespace

RawLog::RawLog(const std::string& path, engine::Duration sync_every)
    : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644)),
      sync_every_(sync_every),
      synced_at_(SteadyClock::stopwatch()) {
  if (file_ < 0) throw std::runtime_error(path + ": " + std::strerror(errno));
}

RawLog::~RawLog() {
  if (unsynced_ && sync_every_ > engine::Duration{}) static_cast<void>(::fdatasync(file_));
  ::close(file_);
}

engine::Status RawLog::append(std::uint32_t type, std::span<const std::byte> head,
                              std::span<const std::byte> tail) noexcept {
  if (lost_ > 0) return lose(fault_.code, fault_.step);
  const std::size_t payload = head.size() + tail.size();
  if (payload > std::numeric_limits<std::int32_t>::max()) return lose(EFBIG, "length of a record");
  const Header header{kMagic, type, static_cast<std::uint32_t>(written_),
                      static_cast<std::uint32_t>(payload)};
  const auto header_bytes = std::as_bytes(std::span(&header, 1));
  const std::uint32_t crc =
      engine::crc32c(tail, engine::crc32c(head, engine::crc32c(header_bytes)));
  const std::array<iovec, 4> pieces{piece(header_bytes), piece(head), piece(tail),
                                    piece(std::as_bytes(std::span(&crc, 1)))};
  const std::size_t whole = kRecordHeaderBytes + payload + kRecordChecksumBytes;
  ssize_t done = 0;
  do {
    done = ::writev(file_, pieces.data(), static_cast<int>(pieces.size()));
  } while (done < 0 && errno == EINTR);
  if (done < 0) return lose(errno, "write of a record");
  if (static_cast<std::size_t>(done) != whole) {
    // Better no record than half of one; the reader would see through it in any case.
    static_cast<void>(::ftruncate(file_, static_cast<off_t>(bytes_)));
    return lose(ENOSPC, "write of a record");
  }
  bytes_ += whole;
  ++written_;
  unsynced_ = true;
  sync_if_due();
  return engine::Done{};
}

void RawLog::sync_if_due() noexcept {
  if (!unsynced_ || sync_every_ <= engine::Duration{}) return;
  const engine::Duration now = SteadyClock::stopwatch();
  if (now - synced_at_ < sync_every_) return;
  synced_at_ = now;
  unsynced_ = ::fdatasync(file_) != 0;
}

engine::Status RawLog::lose(int code, const char* step) noexcept {
  fault_ = {engine::Fault::kSystem, code, step};
  ++lost_;
  return fault_;
}

RawLogReader::RawLogReader(const std::string& path)
    // Without a wait: a pipe of that name is refused below.
    : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
  struct stat status {};
  if (file_ < 0 || ::fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    static_cast<void>(stop("no file that can be read"));
    return;
  }
  bytes_ = static_cast<std::uint64_t>(status.st_size);
}

RawLogReader::~RawLogReader() {
  if (file_ >= 0) ::close(file_);
}

bool RawLogReader::next(RawRecord& record) {
  if (stopped_) return false;
  const std::uint64_t left = bytes_ - offset_;
  if (left == 0) return stop(nullptr);
  if (left < kRecordHeaderBytes + kRecordChecksumBytes) return stop("a torn record");
  Header header;
  if (!read(offset_, std::as_writable_bytes(std::span(&header, 1))))
    return stop("unreadable bytes");
  if (header.magic != kMagic) return stop("not the start of a record");
  if (header.number != static_cast<std::uint32_t>(records_)) return stop("a record is missing");
  const std::uint64_t whole =
      kRecordHeaderBytes + std::uint64_t{header.payload_bytes} + kRecordChecksumBytes;
  if (whole > left) return stop("a torn record");
  buffer_.resize(whole);
  if (!read(offset_, buffer_)) return stop("unreadable bytes");
  const auto checked = std::span<const std::byte>(buffer_).first(whole - kRecordChecksumBytes);
  std::uint32_t crc = 0;
  std::memcpy(&crc, buffer_.data() + checked.size(), sizeof crc);
  if (crc != engine::crc32c(checked)) return stop("a wrong checksum");
  // The header once more, from the bytes that were checked.
  std::memcpy(&header, buffer_.data(), sizeof header);
  record = {header.type, checked.subspan(kRecordHeaderBytes)};
  offset_ += whole;
  ++records_;
  return true;
}

bool RawLogReader::stop(const char* fault) noexcept {
  stopped_ = true;
  fault_ = fault;
  return false;
}

bool RawLogReader::read(std::uint64_t at, std::span<std::byte> out) const noexcept {
  while (!out.empty()) {
    const ssize_t got = ::pread(file_, out.data(), out.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += static_cast<std::uint64_t>(got);
    out = out.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

}  // namespace hil
