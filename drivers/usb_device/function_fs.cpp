#include "drivers/usb_device/function_fs.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <utility>

#include <linux/usb/functionfs.h>

#include "drivers/little_endian.h"
#include "hil/steady_clock.h"

namespace drivers {
namespace {

using engine::Duration;
using Result = FunctionFiles::Result;

constexpr Duration kLookAgain{100'000'000};
/// For a controller to give transfers back.
constexpr Duration kTakeBack{2'000'000'000};
/// In a round: a host that asks without end does not keep us from all else.
constexpr int kMostEvents = 32;

constexpr unsigned kAsk = USB_DIR_IN | USB_TYPE_VENDOR | USB_RECIP_INTERFACE;
constexpr unsigned kTell = USB_DIR_OUT | USB_TYPE_VENDOR | USB_RECIP_INTERFACE;
constexpr std::size_t kEventBytes = sizeof(usb_functionfs_event);
constexpr std::size_t kEventTypeAt = 8;

Duration now() noexcept { return hil::SteadyClock::stopwatch(); }

bool means_unplugged(Result r) noexcept { return r == -ESHUTDOWN || r == -ENODEV || r == -EAGAIN; }

}  // namespace

FunctionFs::FunctionFs(FunctionFiles& files, const UsbLimits& limits, TakeFrames take)
    : files_(files),
      take_(std::move(take)),
      intake_(limits),
      places_(kFunctionReads * kFunctionReadBytes) {}

void FunctionFs::run(const std::stop_token& stop) {
  const std::stop_callback wake(stop, [this] { files_.wake(); });
  while (!stop.stop_requested()) {
    files_.wait(kLookAgain);
    step();
  }
}

void FunctionFs::step() {
  take_transfers();
  take_events();
  take_commands();
  keep_reading();
  say();
}

FunctionCounts FunctionFs::counts() const noexcept {
  FunctionCounts c = counts_;
  c.commands_lost += commands_lost_;
  return c;
}

void FunctionFs::take_events() {
  std::array<std::byte, kEventBytes> event{};
  for (int i = 0; i < kMostEvents; ++i) {
    const Result n = files_.read_control(event);
    if (n == -EIDRM || n == -EINTR) continue;  // the host gave up the last request
    if (n != static_cast<Result>(event.size())) return;
    switch (std::to_integer<unsigned>(event[kEventTypeAt])) {
      case FUNCTIONFS_ENABLE:
        connect();
        break;
      case FUNCTIONFS_DISABLE:
      case FUNCTIONFS_UNBIND:
        disconnect();
        break;
      case FUNCTIONFS_SETUP:
        take_request({get<std::uint8_t>(event, 0), get<std::uint8_t>(event, 1),
                      get<std::uint16_t>(event, 2), get<std::uint16_t>(event, 4),
                      get<std::uint16_t>(event, 6)});
        break;
      default:  // bound to a controller, suspended, resumed: nothing changes for us
        break;
    }
  }
}

void FunctionFs::take_request(const Request& r) {
  std::array<std::byte, kLargestUsbMessage> message{};
  const bool ours = r.value == 0 && r.index == 0;
  if (ours && r.type == kAsk && r.number == static_cast<unsigned>(UsbRequest::kLimits)) {
    answer(r, encode_limits(intake_.limits()));
  } else if (ours && r.type == kAsk && r.number == static_cast<unsigned>(UsbRequest::kStatus)) {
    answer(r, std::span(message).first(intake_.status_message(message)));
  } else if (ours && r.type == kTell && r.number == static_cast<unsigned>(UsbRequest::kReset) &&
             r.bytes == sizeof(std::uint32_t)) {
    begin_session();
  } else {
    refuse(r);
  }
}

void FunctionFs::answer(const Request& r, std::span<const std::byte> bytes) {
  static_cast<void>(files_.write_control(bytes.first(std::min(bytes.size(), r.bytes))));
}

/// The wrong direction is how functionfs is told to stall.
void FunctionFs::refuse(const Request& r) {
  ++counts_.refused;
  std::byte nothing{};
  if ((r.type & USB_DIR_IN) != 0) {
    static_cast<void>(files_.read_control(std::span(&nothing, 1)));
  } else {
    static_cast<void>(files_.write_control({}));
  }
}

void FunctionFs::begin_session() {
  // First of all: with the answer the host begins a frame. A message on its way stays: half of one
  // would spoil the next, and the host heeds its own session's alone.
  take_back(false);
  std::array<std::byte, sizeof(std::uint32_t)> session{};
  if (files_.read_control(session) != static_cast<Result>(session.size())) {
    intake_.take({}, true);  // the host gave it up; what the reads had is lost all the same
    return;
  }
  intake_.reset(get<std::uint32_t>(session, 0));
  in_session_ = true;
  ++counts_.sessions;
}

void FunctionFs::connect() {
  disconnect();  // the kernel may leave out that it was
  connected_ = true;
  ++counts_.connections;
}

void FunctionFs::disconnect() {
  take_back(true);
  intake_.reset(0);
  connected_ = in_session_ = end_is_due_ = false;
  message_bytes_ = 0;
  try_again_ = {};
}

void FunctionFs::take_back(bool write_too) {
  take_transfers();  // whole frames among them are good
  forget_reads_ = true;
  forget_write_ = write_too;
  files_.cancel_reads();
  if (write_too) files_.cancel_write();
  const Duration deadline = now() + kTakeBack;
  const auto some = [&] { return reading_ > 0 || (write_too && writing_); };
  for (take_transfers(); some(); take_transfers()) {
    if (now() > deadline) throw std::runtime_error("functionfs: a transfer does not come back");
    files_.wait_for_transfer(kLookAgain);
  }
  forget_reads_ = forget_write_ = false;
}

void FunctionFs::take_transfers() {
  while (const auto ended = files_.next_ended()) {
    if (ended->is_read) {
      read_ended_[ended->slot] = ended->result;
    } else {
      take_write(ended->result);
    }
  }
  // The bus filled them in the order in which they were submitted, whenever we hear of it.
  while (reading_ > 0 && read_ended_[oldest_]) {
    take_read(oldest_, *std::exchange(read_ended_[oldest_], std::nullopt));
    oldest_ = (oldest_ + 1) % kFunctionReads;
    --reading_;
  }
}

void FunctionFs::take_read(std::size_t slot, Result result) {
  if (forget_reads_) return;
  if (result < 0) {
    if (!means_unplugged(result)) ++counts_.failed_reads;
    intake_.take({}, true);  // the frame in hand has a hole
    try_later();
    return;
  }
  const auto n = static_cast<std::size_t>(result);
  const auto read = std::span<const std::byte>(places_).subspan(slot * kFunctionReadBytes, n);
  intake_.take(read, n < kFunctionReadBytes);
  if (intake_.front()) take_(intake_);
}

void FunctionFs::take_write(Result result) {
  writing_ = false;
  if (forget_write_) return;
  if (result < 0) {
    if (!means_unplugged(result)) ++counts_.failed_writes;
    try_later();
    return;
  }
  const std::size_t packet = files_.in_packet_bytes();
  end_is_due_ = result > 0 && packet > 0 && static_cast<std::size_t>(result) % packet == 0;
}

void FunctionFs::command(const hil::CommandPacket& packet) noexcept {
  if (!commands_.push(packet)) ++commands_lost_;
  files_.wake();
}

void FunctionFs::take_commands() {
  hil::CommandPacket packet;
  while (commands_.pop(packet))
    if (!in_session_ || !intake_.command(packet.bytes())) ++counts_.commands_lost;
}

void FunctionFs::keep_reading() {
  if (!connected_ || !may_try()) return;
  while (reading_ < kFunctionReads) {
    const std::size_t slot = (oldest_ + reading_) % kFunctionReads;
    const auto place = std::span(places_).subspan(slot * kFunctionReadBytes, kFunctionReadBytes);
    if (!files_.read(slot, place)) {
      try_later();
      return;
    }
    ++reading_;
  }
}

void FunctionFs::say() {
  if (!connected_ || !in_session_ || writing_ || !may_try()) return;
  if (message_bytes_ == 0 && !end_is_due_) {
    message_bytes_ = intake_.next_message(message_);
    if (message_bytes_ == 0) return;
  }
  const std::size_t n = end_is_due_ ? 0 : message_bytes_;
  writing_ = files_.write(std::span(message_).first(n));
  if (!writing_) {
    try_later();
  } else if (!std::exchange(end_is_due_, false)) {
    message_bytes_ = 0;
  }
}

bool FunctionFs::may_try() const noexcept { return now() >= try_again_; }
void FunctionFs::try_later() noexcept { try_again_ = now() + kLookAgain; }

}  // namespace drivers
