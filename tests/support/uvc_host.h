#pragma once

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <linux/usb/video.h>

#include "drivers/usb_device/usbip_device.h"
#include "hil/big_endian.h"
#include "tests/support/usbip_host.h"

/// A host that does with a camera what Linux' uvcvideo does, as bytes of USB/IP: negotiates with 34
/// bytes, keeps five bulk transfers of up to 32 packets in flight, puts payloads together, and
/// clears the endpoint's halt when it stops.
namespace uvc_host {

using usbip_host::Bytes;

/// A buffer as a V4L2 client would get it; those with an error it does not get as a rule.
struct Frame {
  std::uint32_t sequence = 0;
  bool error = false;
  std::uint32_t time = 0;
  Bytes bytes;
};

class Host {
 public:
  explicit Host(drivers::UsbIpDevice& device, bool attach = true) : device_(device) {
    if (!attach) return;
    EXPECT_TRUE(device_.take(usbip_host::import_request("1-1")));
    static_cast<void>(device_.replies());
  }

  // ---- Control transfers -----------------------------------------------------------------------

  /// Nothing: stalled.
  std::optional<Bytes> ask(unsigned type, unsigned request, unsigned value, unsigned index,
                           unsigned length) {
    return transfer(usbip_host::kIn, {type, request, value, index}, length, {});
  }
  bool tell(unsigned type, unsigned request, unsigned value, unsigned index, const Bytes& data) {
    return transfer(usbip_host::kOut, {type, request, value, index},
                    static_cast<unsigned>(data.size()), data)
        .has_value();
  }
  /// A control of a unit of the control interface (0), or of the stream's (1).
  std::optional<Bytes> get(unsigned request, unsigned unit, unsigned selector, unsigned length,
                           unsigned interface = 0) {
    return ask(0xA1, request, selector << 8, unit << 8 | interface, length);
  }
  bool set(unsigned unit, unsigned selector, const Bytes& data, unsigned interface = 0) {
    return tell(0x21, UVC_SET_CUR, selector << 8, unit << 8 | interface, data);
  }
  /// Why the last one was stalled.
  unsigned error_code() {
    const auto answer = get(UVC_GET_CUR, 0, UVC_VC_REQUEST_ERROR_CODE_CONTROL, 1);
    return answer && answer->size() == 1 ? std::to_integer<unsigned>(answer->front()) : 0xFF;
  }

  // ---- The stream ------------------------------------------------------------------------------

  /// S_FMT: what the device makes of this format's number.
  std::optional<uvc_streaming_control> probe(unsigned format) {
    uvc_streaming_control wish{};
    wish.bmHint = 1;
    wish.bFormatIndex = static_cast<std::uint8_t>(format);
    wish.bFrameIndex = 1;
    if (!set(0, UVC_VS_PROBE_CONTROL, bytes_of(wish), 1)) return std::nullopt;
    for (const int request : {UVC_GET_MIN, UVC_GET_MAX})
      if (!get(static_cast<unsigned>(request), 0, UVC_VS_PROBE_CONTROL, sizeof wish, 1))
        return std::nullopt;
    if (!set(0, UVC_VS_PROBE_CONTROL, bytes_of(wish), 1)) return std::nullopt;
    const auto answer = get(UVC_GET_CUR, 0, UVC_VS_PROBE_CONTROL, sizeof wish, 1);
    if (!answer || answer->size() != sizeof wish) return std::nullopt;
    std::memcpy(&wish, answer->data(), sizeof wish);
    return wish;
  }
  /// STREAMON. `packets`: most of one transfer.
  bool start(unsigned format, std::size_t packets = 32, std::size_t packet_bytes = 1024) {
    const auto offer = probe(format);
    if (!offer || !set(0, UVC_VS_COMMIT_CONTROL, bytes_of(*offer), 1)) return false;
    frame_bytes_ = offer->dwMaxVideoFrameSize;
    most_payload_ = offer->dwMaxPayloadTransferSize;
    transfer_bytes_ =
        packet_bytes *
        std::min<std::size_t>(packets, (most_payload_ + packet_bytes - 1) / packet_bytes);
    sequence_ = 0xFFFFFFFF;
    last_id_ = -1;
    in_payload_ = skipping_ = false;
    payload_ = 0;
    frame_.reset();
    for (int i = 0; i < 5; ++i) submit_bulk();
    hear();
    return true;
  }
  /// STREAMOFF.
  bool stop() {
    const std::set<std::uint32_t> waiting = bulk_;
    for (const std::uint32_t number : waiting)
      EXPECT_TRUE(device_.take(usbip_host::unlink(next_++, number)));
    bulk_.clear();
    resubmit_ = false;
    hear();
    resubmit_ = true;
    return tell(0x02, 1, 0, 0x81, {});
  }
  /// Takes what the device has said by itself; `most`: transfers, then it is slow.
  void hear(std::size_t most = static_cast<std::size_t>(-1)) {
    for (;;) {
      device_.serve();
      const Bytes more = device_.replies();
      heard_.insert(heard_.end(), more.begin(), more.end());
      if (most == 0 || !take_reply()) return;
      --most;
    }
  }
  /// Frames that are whole by now, oldest first.
  std::vector<Frame> frames() { return std::exchange(frames_, {}); }
  [[nodiscard]] std::size_t transfers() const { return transfers_; }
  [[nodiscard]] std::size_t transfer_bytes() const { return transfer_bytes_; }

  template <class T>
  static Bytes bytes_of(const T& value) {
    Bytes out(sizeof value);
    std::memcpy(out.data(), &value, sizeof value);
    return out;
  }

 private:
  std::optional<Bytes> transfer(std::uint32_t direction, std::array<unsigned, 4> s, unsigned length,
                                const Bytes& data) {
    const std::uint32_t number = next_++;
    EXPECT_TRUE(device_.take(usbip_host::submit(
        number, direction, 0, 0, length,
        {s[0], s[1], s[2] & 0xFF, s[2] >> 8, s[3] & 0xFF, s[3] >> 8, length & 0xFF, length >> 8},
        data)));
    controls_.insert_or_assign(number, direction == usbip_host::kIn);
    hear();
    auto answer = answers_.extract(number);
    if (answer.empty()) return std::nullopt;
    return std::move(answer.mapped());
  }

  void submit_bulk() {
    bulk_.insert(next_);
    EXPECT_TRUE(device_.take(usbip_host::submit(next_++, usbip_host::kIn, 1, 0,
                                                static_cast<std::uint32_t>(transfer_bytes_))));
  }

  /// One whole reply; false: there is none.
  bool take_reply() {
    if (heard_.size() < 48) return false;
    const auto word = [this](std::size_t at) {
      return hil::BigEndianReader(heard_, at).get<std::uint32_t>();
    };
    const std::uint32_t number = word(4);
    const int status = static_cast<int>(word(20));
    const bool is_bulk = bulk_.count(number) != 0;
    const auto control = controls_.find(number);
    const bool has_data = word(0) == 3 && status == 0 &&
                          (control != controls_.end() ? control->second : word(24) > 0);
    const std::size_t bytes = has_data ? word(24) : 0;
    EXPECT_GE(heard_.size(), 48 + bytes);
    const Bytes data(heard_.begin() + 48, heard_.begin() + 48 + static_cast<std::ptrdiff_t>(bytes));
    heard_.erase(heard_.begin(), heard_.begin() + 48 + static_cast<std::ptrdiff_t>(bytes));
    if (control != controls_.end()) {
      if (status == 0) answers_[number] = data;
      controls_.erase(control);
    } else if (is_bulk) {
      bulk_.erase(number);
      EXPECT_EQ(status, 0);
      ++transfers_;
      decode(data);
      if (resubmit_) submit_bulk();
    }
    return true;
  }

  /// A bulk transfer that has come back.
  void decode(const Bytes& data) {
    if (data.empty() && !in_payload_ && !skipping_) return;
    payload_ += data.size();
    std::size_t at = 0;
    if (!in_payload_ && !skipping_) {
      at = begin_payload(data);
      skipping_ = at == 0;
      in_payload_ = at != 0;
    }
    if (in_payload_) {
      const std::size_t room = frame_bytes_ - frame_->bytes.size();
      frame_->bytes.insert(
          frame_->bytes.end(), data.begin() + static_cast<std::ptrdiff_t>(at),
          data.begin() + static_cast<std::ptrdiff_t>(at + std::min(room, data.size() - at)));
      if (data.size() - at > room) frame_->error = true;
    }
    if (data.size() == transfer_bytes_ && payload_ < most_payload_) return;
    // The payload is over.
    if (in_payload_ && ends_frame_ && !frame_->bytes.empty()) end_frame();
    in_payload_ = skipping_ = false;
    payload_ = 0;
  }
  /// Bytes of the header; 0: it is none.
  std::size_t begin_payload(const Bytes& data) {
    if (data.size() < 2) return 0;
    const auto length = std::to_integer<std::size_t>(data[0]);
    const auto flags = std::to_integer<unsigned>(data[1]);
    if (length < 2 || length > data.size()) return 0;
    const int id = static_cast<int>(flags & UVC_STREAM_FID);
    if (id != last_id_) {
      ++sequence_;
      if (frame_ && !frame_->bytes.empty()) end_frame();
    } else if (!frame_) {
      return 0;  // out of step
    }
    last_id_ = id;
    if (!frame_) frame_.emplace().sequence = sequence_;
    if ((flags & UVC_STREAM_ERR) != 0) frame_->error = true;
    if ((flags & UVC_STREAM_PTS) != 0 && length >= 6)
      std::memcpy(&frame_->time, data.data() + 2, 4);
    ends_frame_ = (flags & UVC_STREAM_EOF) != 0;
    return length;
  }
  void end_frame() {
    if (frame_->bytes.size() != frame_bytes_) frame_->error = true;
    frames_.push_back(std::move(*frame_));
    frame_.reset();
  }

  drivers::UsbIpDevice& device_;
  std::uint32_t next_ = 1;
  Bytes heard_;
  std::map<std::uint32_t, bool> controls_;  // with data in
  std::map<std::uint32_t, Bytes> answers_;
  std::set<std::uint32_t> bulk_;
  bool resubmit_ = true;
  std::size_t transfers_ = 0;

  std::size_t frame_bytes_ = 0;
  std::uint32_t most_payload_ = 0;
  std::size_t transfer_bytes_ = 0;
  std::uint32_t sequence_ = 0;
  int last_id_ = -1;
  bool in_payload_ = false;
  bool skipping_ = false;
  bool ends_frame_ = false;
  std::size_t payload_ = 0;
  std::optional<Frame> frame_;
  std::vector<Frame> frames_;
};

}  // namespace uvc_host
