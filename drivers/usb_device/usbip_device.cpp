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
// More than any host has in flight.
constexpr std::size_t kMostWaiting = 1024;

constexpr std::uint32_t kHighSpeed = 3;
constexpr std::uint32_t kSuperSpeed = 5;

using Header = std::array<std::byte, kCommandBytes>;

template <class T>
T number(std::span<const std::byte> in, std::size_t at) noexcept {
  return hil::BigEndianReader(in, at).get<T>();
}
std::uint32_t word(std::span<const std::byte> in, std::size_t at) noexcept {
  return number<std::uint32_t>(in, at);
}

UsbSetup setup_of(std::span<const std::byte> in) noexcept {
  const auto half = [in](std::size_t i) {
    return static_cast<std::uint16_t>(std::to_integer<unsigned>(in[i]) |
                                      std::to_integer<unsigned>(in[i + 1]) << 8);
  };
  return {std::to_integer<std::uint8_t>(in[0]), std::to_integer<std::uint8_t>(in[1]), half(2),
          half(4), half(6)};
}

}  // namespace

UsbIpDevice::UsbIpDevice(UsbFunction& function)
    : function_(function),
      parts_(usb_parts(function.descriptors())),
      is_super_(!function.descriptors().capabilities.empty()) {
  function_.reset();
}

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
  std::array<std::byte, kOperationBytes + 4> header{};
  hil::BigEndianWriter out(header);
  out.put(kVersion).put(static_cast<std::uint16_t>(code & kReply)).put(known ? 0U : 1U);
  if (!imports) out.put(std::uint32_t{1});  // devices
  reply(std::span(header).first(out.used()));
  if (known) describe();
  if (!imports) {
    for (const UsbInterface& i : parts_.interfaces)
      for (const unsigned b :
           {unsigned{i.device_class}, unsigned{i.subclass}, unsigned{i.protocol}, 0U})
        replies_.push_back(static_cast<std::byte>(b));
  }
  attached_ = imports && known;
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(bytes));
  return true;
}

void UsbIpDevice::describe() {
  constexpr std::string_view kPath = "/sys/devices/starloop/usb1/1-1";
  const std::vector<std::byte>& device = function_.descriptors().device;
  std::array<std::byte, kPathBytes + kBusIdBytes + 24> out{};
  std::memcpy(out.data(), kPath.data(), kPath.size());
  std::memcpy(out.data() + kPathBytes, kBusId, sizeof kBusId);
  hil::BigEndianWriter numbers(out, kPathBytes + kBusIdBytes);
  // Bus, device, speed.
  numbers.put(std::uint32_t{1}).put(std::uint32_t{2}).put(is_super_ ? kSuperSpeed : kHighSpeed);
  for (const std::size_t at : {8U, 10U, 12U})  // vendor, product, release: little-endian there
    numbers.put(device[at + 1]).put(device[at]);
  for (const std::size_t at : {4U, 5U, 6U}) numbers.put(device[at]);  // class and so on
  // Configuration in use, configurations, interfaces.
  numbers.put(std::uint8_t{1}).put(std::uint8_t{1});
  numbers.put(static_cast<std::uint8_t>(parts_.interfaces.size()));
  reply(out);
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

bool UsbIpDevice::has_endpoint(unsigned address) const noexcept {
  return std::find(parts_.endpoints.begin(), parts_.endpoints.end(), address) !=
         parts_.endpoints.end();
}

void UsbIpDevice::submit(std::span<const std::byte> header, std::span<const std::byte> data) {
  const std::uint32_t id = word(header, 4);
  const bool to_host = word(header, 12) == kToHost;
  const std::uint32_t endpoint = word(header, 16);
  if (endpoint == 0) {
    control(id, setup_of(header.subspan(40, 8)), data);
  } else if (endpoint > 15 || !has_endpoint(endpoint | (to_host ? kUsbToHost : 0))) {
    end(id, -EPIPE, 0);
  } else if (!to_host) {
    const std::size_t packet = is_super_ ? kUsbSuperPacketBytes : kUsbPacketBytes;
    const bool ends =
        data.size() % packet != 0 || data.empty() || (word(header, 20) & kZeroPacket) != 0;
    function_.take(endpoint, data, ends);
    end(id, 0, data.size());
  } else if (waiting_.size() == kMostWaiting) {
    end(id, -ENOMEM, 0);
  } else {
    waiting_.push_back({id, endpoint, word(header, 24)});
  }
}

void UsbIpDevice::serve() {
  std::uint32_t silent = 0;  // endpoints with nothing to say, a bit each
  for (auto request = waiting_.begin(); request != waiting_.end();) {
    const std::uint32_t bit = 1U << request->endpoint;
    std::optional<UsbAnswer> answer;
    if ((silent & bit) == 0) answer = function_.give(request->endpoint, request->bytes);
    if (!answer) {
      silent |= bit;
      ++request;
      continue;
    }
    const std::uint32_t id = request->id;
    request = waiting_.erase(request);
    if (answer->overflow) {
      end(id, -EOVERFLOW, 0);
    } else {
      end(id, 0, answer->head.size() + answer->data.size(), *answer);
    }
  }
}

void UsbIpDevice::unlink(std::uint32_t id, std::uint32_t which) {
  const auto it = std::find_if(waiting_.begin(), waiting_.end(),
                               [which](const Request& r) { return r.id == which; });
  // Of what has ended already the answer is on its way, and zero says so.
  const int status = it != waiting_.end() ? -ECONNRESET : 0;
  if (it != waiting_.end()) waiting_.erase(it);
  Header header{};
  hil::BigEndianWriter(header).put(kUnlinked).put(id);
  hil::BigEndianWriter(header, 20).put(status);
  reply(header);
}

void UsbIpDevice::end(std::uint32_t id, int status, std::size_t bytes, const UsbAnswer& answer) {
  Header header{};
  hil::BigEndianWriter(header).put(kSubmitted).put(id);
  hil::BigEndianWriter(header, 20).put(status).put(static_cast<std::uint32_t>(bytes));
  reply(header);
  reply(answer.head);
  reply(answer.data);
}

void UsbIpDevice::reply(std::span<const std::byte> bytes) {
  replies_.insert(replies_.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> UsbIpDevice::replies() { return std::exchange(replies_, {}); }

bool UsbIpDevice::standard(const UsbSetup& setup, std::vector<std::byte>& answer) {
  const auto bytes = [&answer](std::initializer_list<unsigned> values) {
    for (const unsigned v : values) answer.push_back(static_cast<std::byte>(v));
    return true;
  };
  const bool of_interface = setup.index < parts_.interfaces.size();
  switch (unsigned{setup.type} << 8 | setup.request) {
    case 0x8006:  // get descriptor
      answer = usb_descriptor(function_.descriptors(), setup.value >> 8, setup.value & 0xFF);
      return !answer.empty();
    case 0x8008:  // get configuration
      return bytes({1});
    case 0x810A:  // get interface
      return of_interface && bytes({0});
    case 0x8000:  // get status: self-powered
      return bytes({1, 0});
    case 0x8100:
    case 0x8200:
      return bytes({0, 0});
    case 0x0009:  // set configuration
      return setup.value <= 1;
    case 0x010B:  // set interface
      return of_interface && setup.value == 0;
    case 0x0201:  // clear a halt
      if (setup.value != 0 || !has_endpoint(setup.index)) return false;
      function_.clear_halt(setup.index);
      return true;
    default:
      return false;
  }
}

void UsbIpDevice::control(std::uint32_t id, const UsbSetup& setup,
                          std::span<const std::byte> data) {
  constexpr unsigned kKind = 0x60;  // bits of a request's type: zero is standard
  std::optional<std::vector<std::byte>> answer;
  if ((setup.type & kKind) != 0) {
    answer = function_.control(setup, data);
  } else if (std::vector<std::byte> some; standard(setup, some)) {
    answer = std::move(some);
  }
  if (!answer) {
    end(id, -EPIPE, 0);
    return;
  }
  const bool to_host = (setup.type & kUsbToHost) != 0;
  if (!to_host) answer->clear();
  if (answer->size() > setup.length) answer->resize(setup.length);
  end(id, 0, to_host ? answer->size() : data.size(), {.data = *answer});
}

}  // namespace drivers
