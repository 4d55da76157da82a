#include "drivers/usb_device/usbip_device.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "hil/big_endian.h"

namespace drivers {
namespace {

// Before a device is imported: operations.
constexpr std::uint16_t kVersion = 0x0111;
constexpr std::uint16_t kListDevices = 0x8005;
constexpr std::uint16_t kImport = 0x8003;
constexpr std::uint16_t kReply = 0x7FFF;  // an answer has the question's code without the top bit
constexpr std::size_t kOperationBytes = 8;
constexpr std::size_t kBusIdBytes = 32;
constexpr std::size_t kPathBytes = 256;
constexpr char kBusId[] = "1-1";
// After it: commands, 48 bytes each, and data.
constexpr std::size_t kCommandBytes = 48;
constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitted = 3;
constexpr std::uint32_t kUnlinked = 4;
constexpr std::uint32_t kToHost = 1;
constexpr std::uint32_t kZeroPacket = 0x40;
// More than any transfer of a frame: who says more is none of ours.
constexpr std::uint32_t kLargestTransfer = 64U << 20;

constexpr std::uint8_t kOut = 1;
constexpr std::uint8_t kIn = 2;
constexpr std::size_t kPacket = 512;
constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0x0001;
constexpr std::uint32_t kHighSpeed = 3;

template <class T>
void append(std::vector<std::byte>& out, T value) {
  for (std::size_t i = sizeof value; i-- > 0;)
    out.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFF));
}

void append_text(std::vector<std::byte>& out, std::string_view text, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i)
    out.push_back(i < text.size() ? static_cast<std::byte>(text[i]) : std::byte{0});
}

template <class T>
T number(std::span<const std::byte> in, std::size_t at) noexcept {
  return hil::BigEndianReader(in, at).get<T>();
}
std::uint32_t word(std::span<const std::byte> in, std::size_t at) noexcept {
  return number<std::uint32_t>(in, at);
}

std::vector<std::byte> bytes_of(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

std::vector<std::byte> string_descriptor(std::string_view text) {
  std::vector<std::byte> out = bytes_of({static_cast<unsigned>(2 + 2 * text.size()), 3});
  for (const char c : text) {
    out.push_back(static_cast<std::byte>(c));
    out.push_back(std::byte{0});
  }
  return out;
}

}  // namespace

UsbIpDevice::UsbIpDevice(const UsbLimits& limits) : intake_(limits) {}

bool UsbIpDevice::take(std::span<const std::byte> bytes) {
  held_.insert(held_.end(), bytes.begin(), bytes.end());
  for (;;) {
    const std::size_t before = held_.size();
    if (!(attached_ ? take_command() : take_operation())) return false;
    if (held_.size() == before) return true;
    // After each: what the host sees must not depend on how its bytes came.
    serve();
  }
}

bool UsbIpDevice::take_operation() {
  if (held_.size() < kOperationBytes) return true;
  const std::span<const std::byte> in = held_;
  const auto code = number<std::uint16_t>(in, 2);
  if (number<std::uint16_t>(in, 0) != kVersion) return false;
  const bool imports = code == kImport;
  if (!imports && code != kListDevices) return false;
  const std::size_t bytes = kOperationBytes + (imports ? kBusIdBytes : 0);
  if (held_.size() < bytes) return true;
  const bool known =
      !imports || std::memcmp(held_.data() + kOperationBytes, kBusId, sizeof kBusId) == 0;
  append(replies_, kVersion);
  append(replies_, static_cast<std::uint16_t>(code & kReply));
  append(replies_, std::uint32_t{known ? 0U : 1U});
  if (!imports) append(replies_, std::uint32_t{1});  // devices
  if (known) describe(replies_);
  if (!imports) {
    for (const unsigned b :
         {unsigned{kUsbClass}, unsigned{kUsbSubclass}, unsigned{kUsbProtocol}, 0U})
      replies_.push_back(static_cast<std::byte>(b));
  }
  attached_ = imports && known;
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(bytes));
  return true;
}

void UsbIpDevice::describe(std::vector<std::byte>& out) const {
  append_text(out, "/sys/devices/starloop/usb1/1-1", kPathBytes);
  append_text(out, kBusId, kBusIdBytes);
  append(out, std::uint32_t{1});  // bus
  append(out, std::uint32_t{2});  // device
  append(out, kHighSpeed);
  append(out, kVendor);
  append(out, kProduct);
  append(out, std::uint16_t{0x0100});
  // class, subclass, protocol of the device; configuration in use, configurations, interfaces
  for (const unsigned b : {0U, 0U, 0U, 1U, 1U, 1U}) out.push_back(static_cast<std::byte>(b));
}

bool UsbIpDevice::take_command() {
  if (held_.size() < kCommandBytes) return true;
  const std::span<const std::byte> in = held_;
  const std::uint32_t command = word(in, 0);
  if (command == kUnlink) {
    unlink(word(in, 4), word(in, 20));
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(kCommandBytes));
    return true;
  }
  if (command != kSubmit) return false;
  const std::uint32_t length = word(in, 24);
  if (length > kLargestTransfer) return false;
  const std::size_t data = word(in, 12) == kToHost ? 0 : length;
  if (held_.size() < kCommandBytes + data) return true;
  submit(in.first(kCommandBytes), in.subspan(kCommandBytes, data));
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(kCommandBytes + data));
  return true;
}

void UsbIpDevice::submit(std::span<const std::byte> header, std::span<const std::byte> data) {
  const std::uint32_t id = word(header, 4);
  const bool to_host = word(header, 12) == kToHost;
  const std::uint32_t endpoint = word(header, 16);
  const std::uint32_t length = word(header, 24);
  if (endpoint == 0) {
    control(id, header.subspan(40, 8), data);
  } else if (endpoint == kOut && !to_host) {
    const bool ends =
        data.size() % kPacket != 0 || data.empty() || (word(header, 20) & kZeroPacket) != 0;
    intake_.take(data, ends);
    end(id, 0, data.size(), {});
  } else if (endpoint == kIn && to_host) {
    waiting_.push_back({id, length});
  } else {
    end(id, -EPIPE, 0, {});
  }
}

void UsbIpDevice::serve() {
  std::array<std::byte, kLargestUsbMessage> message{};
  while (!waiting_.empty()) {
    const std::size_t n = intake_.next_message(message);
    if (n == 0) return;
    const Request request = waiting_.front();
    waiting_.pop_front();
    if (n > request.bytes) {
      end(request.id, -EOVERFLOW, 0, {});
    } else {
      end(request.id, 0, n, std::span(message).first(n));
    }
  }
}

void UsbIpDevice::unlink(std::uint32_t id, std::uint32_t which) {
  const auto it = std::find_if(waiting_.begin(), waiting_.end(),
                               [which](const Request& r) { return r.id == which; });
  // Of what has ended already the answer is on its way, and zero says so.
  const int status = it != waiting_.end() ? -ECONNRESET : 0;
  if (it != waiting_.end()) waiting_.erase(it);
  append(replies_, kUnlinked);
  append(replies_, id);
  for (int i = 0; i < 3; ++i) append(replies_, std::uint32_t{0});
  append(replies_, static_cast<std::uint32_t>(status));
  replies_.resize(replies_.size() + kCommandBytes - 24);
}

void UsbIpDevice::end(std::uint32_t id, int status, std::size_t bytes,
                      std::span<const std::byte> data) {
  append(replies_, kSubmitted);
  append(replies_, id);
  for (int i = 0; i < 3; ++i) append(replies_, std::uint32_t{0});
  append(replies_, static_cast<std::uint32_t>(status));
  append(replies_, static_cast<std::uint32_t>(bytes));
  replies_.resize(replies_.size() + kCommandBytes - 28);
  replies_.insert(replies_.end(), data.begin(), data.end());
}

std::vector<std::byte> UsbIpDevice::replies() { return std::exchange(replies_, {}); }

/// Empty: there is no such descriptor.
std::vector<std::byte> UsbIpDevice::descriptor(unsigned type, unsigned index) const {
  constexpr unsigned kDevice = 1;
  constexpr unsigned kConfiguration = 2;
  constexpr unsigned kString = 3;
  if (type == kDevice)
    return bytes_of({18, 1, 0x00, 0x02, 0, 0, 0, 64, kVendor & 0xFF, kVendor >> 8, kProduct & 0xFF,
                     kProduct >> 8, 0x00, 0x01, 1, 2, 3, 1});
  if (type == kConfiguration)
    return bytes_of({9,
                     2,
                     32,
                     0,
                     1,
                     1,
                     0,
                     0xC0,
                     0,  //
                     9,
                     4,
                     0,
                     0,
                     2,
                     kUsbClass,
                     kUsbSubclass,
                     kUsbProtocol,
                     0,  //
                     7,
                     5,
                     kOut,
                     2,
                     kPacket & 0xFF,
                     kPacket >> 8,
                     0,  //
                     7,
                     5,
                     0x80U | kIn,
                     2,
                     kPacket & 0xFF,
                     kPacket >> 8,
                     0});
  if (type != kString) return {};
  switch (index) {
    case 0:
      return bytes_of({4, 3, 0x09, 0x04});  // English
    case 1:
      return string_descriptor("Starloop");
    case 2:
      return string_descriptor("Frame injection device");
    case 3:
      return string_descriptor("1");
    default:
      return {};
  }
}

void UsbIpDevice::control(std::uint32_t id, std::span<const std::byte> setup,
                          std::span<const std::byte> data) {
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(setup[i]); };
  const unsigned type = at(0);
  const unsigned request = at(1);
  const std::size_t length = at(6) | at(7) << 8;
  std::array<std::byte, kLargestUsbMessage> message{};
  std::vector<std::byte> answer;
  bool known = true;
  switch (type << 8 | request) {
    case 0x8006:  // get descriptor
      answer = descriptor(at(3), at(2));
      known = !answer.empty();
      break;
    case 0x8008:  // get configuration
      answer = bytes_of({1});
      break;
    case 0x810A:  // get interface
      answer = bytes_of({0});
      break;
    case 0x8000:  // get status: self-powered
      answer = bytes_of({1, 0});
      break;
    case 0x8100:
    case 0x8200:
      answer = bytes_of({0, 0});
      break;
    case 0x0009:  // set configuration
    case 0x010B:  // set interface
    case 0x0201:  // clear a halt
      break;
    case 0xC100U | static_cast<unsigned>(UsbRequest::kLimits): {
      const auto limits = encode_limits(intake_.limits());
      answer.assign(limits.begin(), limits.end());
      break;
    }
    case 0xC100U | static_cast<unsigned>(UsbRequest::kStatus): {
      const std::size_t n = intake_.status_message(message);
      answer.assign(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(n));
      break;
    }
    case 0x4100U | static_cast<unsigned>(UsbRequest::kReset): {
      std::uint32_t session = 0;
      known = data.size() == sizeof session;
      if (known) {
        std::memcpy(&session, data.data(), sizeof session);
        intake_.reset(session);
      }
      break;
    }
    default:
      known = false;
  }
  if (!known) {
    end(id, -EPIPE, 0, {});
    return;
  }
  if (answer.size() > length) answer.resize(length);
  const bool to_host = (type & 0x80U) != 0;
  end(id, 0, to_host ? answer.size() : data.size(), answer);
}

}  // namespace drivers
