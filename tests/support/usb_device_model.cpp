#include "tests/support/usb_device_model.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <stdexcept>

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

namespace test_support {
namespace {

using drivers::FrameIntake;
using drivers::UsbRequest;

constexpr const char* kNode = "/dev/bus/usb/001/002";
constexpr const char* kDescription =
    "P: /devices/usb1/1-1\n"
    "N: bus/usb/001/002\n"
    "E: SUBSYSTEM=usb\n"
    "E: DRIVER=usb\n"
    "E: BUSNUM=001\n"
    "E: DEVNUM=002\n"
    "E: DEVNAME=/dev/bus/usb/001/002\n"
    "E: DEVTYPE=usb_device\n"
    "A: bConfigurationValue=1\\n\n"
    "A: busnum=1\\n\n"
    "A: devnum=2\\n\n"
    "A: speed=480\\n\n"
    "H: descriptors="
    // USB 2.0, 1209:0001, one configuration
    "12010002000000400912010000010000"
    "0001"
    // configuration: one interface, self-powered
    "09022000010100C000"
    // interface 0: two endpoints, vendor class, 53, 01
    "0904000002FF530100"
    // 01 OUT and 82 IN, bulk, 512 bytes
    "07050102000200"
    "07058202000200\n";
constexpr std::size_t kPacket = 512;
constexpr std::uint8_t kOut = 0x01;
constexpr std::uint8_t kIn = 0x82;
constexpr std::uint8_t kToHost = 0x80;

}  // namespace

struct UsbDeviceModel::Self {
  struct Urb {
    UMockdevIoctlData* data = nullptr;
    [[nodiscard]] usbdevfs_urb& urb() const { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
    /// The client's buffer, ours to read and write.
    [[nodiscard]] UMockdevIoctlData* buffer() const {
      return umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer),
                                         static_cast<gsize>(urb().buffer_length), nullptr);
    }
  };

  explicit Self(const drivers::UsbLimits& limits) : intake(limits) {}

  gboolean handle(UMockdevIoctlClient* client);
  void submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  void reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  void discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  void control(Urb& u);
  /// Takes what the endpoint takes. False: the transfer stays under way.
  [[nodiscard]] bool out(Urb& u);
  void fill_in();
  void end(Urb u, int status) {
    u.urb().status = -status;
    ended.push_back(u);
  }

  mutable std::mutex mutex;
  FrameIntake intake;
  UMockdevTestbed* testbed = nullptr;
  UMockdevIoctlBase* handler = nullptr;
  bool plugged = false;
  std::list<Urb> under_way;
  std::deque<Urb> ended;
  std::optional<std::size_t> takes;  // bytes; nothing: all
  bool then_stalls = false;
  bool halted = false;
  std::deque<int> in_errors;
  std::deque<std::vector<std::byte>> said;
  bool loses = false;
  int lost = 0;
  int resets = 0;
};

gboolean UsbDeviceModel::Self::handle(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  const gulong request = umockdev_ioctl_client_get_request(client);
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  if (!plugged && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_REAPURB &&
      request != USBDEVFS_DISCARDURB) {
    umockdev_ioctl_client_complete(client, -1, ENODEV);
    return TRUE;
  }
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* d = umockdev_ioctl_data_resolve(argument, 0, sizeof(guint32), nullptr);
      const guint32 caps = USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_BULK_CONTINUATION |
                           USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT |
                           USBDEVFS_CAP_ZERO_PACKET;
      std::memcpy(d->data, &caps, sizeof caps);
      umockdev_ioctl_data_unref(d);
      break;
    }
    case USBDEVFS_CLEAR_HALT:
      halted = false;
      break;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_RESET:
      break;
    case USBDEVFS_SUBMITURB:
      submit(client, argument);
      return TRUE;
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      reap(client, argument);
      return TRUE;
    case USBDEVFS_DISCARDURB:
      discard(client, argument);
      return TRUE;
    default:
      umockdev_ioctl_client_complete(client, -1, ENOTTY);
      return TRUE;
  }
  umockdev_ioctl_client_complete(client, 0, 0);
  return TRUE;
}

void UsbDeviceModel::Self::submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  Urb u{umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr)};
  u.urb().actual_length = 0;
  umockdev_ioctl_data_unref(u.buffer());  // brings the client's bytes here; the urb keeps them
  if (u.urb().type == USBDEVFS_URB_TYPE_CONTROL) {
    control(u);
  } else if (u.urb().endpoint == kIn || !out(u)) {
    under_way.push_back(u);
  }
  umockdev_ioctl_client_complete(client, 0, 0);
}

void UsbDeviceModel::Self::control(Urb& u) {
  UMockdevIoctlData* buffer = u.buffer();
  const auto* setup = reinterpret_cast<const std::uint8_t*>(buffer->data);
  std::array<std::byte, drivers::kLargestUsbMessage> answer{};
  std::size_t bytes = 0;
  int status = 0;
  if (setup[0] == (kToHost | 0x41) && setup[1] == static_cast<int>(UsbRequest::kLimits)) {
    const auto limits = drivers::encode_limits(intake.limits());
    std::copy(limits.begin(), limits.end(), answer.begin());
    bytes = limits.size();
  } else if (setup[0] == (kToHost | 0x41) && setup[1] == static_cast<int>(UsbRequest::kStatus)) {
    bytes = intake.status_message(answer);
  } else if (setup[0] == 0x41 && setup[1] == static_cast<int>(UsbRequest::kReset)) {
    std::uint32_t session = 0;
    std::memcpy(&session, setup + 8, sizeof session);
    intake.reset(session);
    ++resets;
    u.urb().actual_length = 4;
  } else {
    status = EPIPE;
  }
  if (bytes > 0) {
    umockdev_ioctl_data_update(buffer, 8, reinterpret_cast<guint8*>(answer.data()),
                               static_cast<gint>(bytes));
    u.urb().actual_length = static_cast<int>(bytes);
  }
  umockdev_ioctl_data_unref(buffer);
  end(u, status);
}

bool UsbDeviceModel::Self::out(Urb& u) {
  if (halted) {
    end(u, EPIPE);
    return true;
  }
  usbdevfs_urb& urb = u.urb();
  UMockdevIoctlData* buffer = u.buffer();
  const auto length = static_cast<std::size_t>(urb.buffer_length);
  auto done = static_cast<std::size_t>(urb.actual_length);
  const std::size_t n = takes ? std::min(*takes, length - done) : length - done;
  if (takes) *takes -= n;
  const bool whole = done + n == length;
  const bool zero_packet = (urb.flags & USBDEVFS_URB_ZERO_PACKET) != 0;
  intake.take(std::as_bytes(std::span(buffer->data + done, n)),
              whole && (length % kPacket != 0 || zero_packet || length == 0));
  umockdev_ioctl_data_unref(buffer);
  urb.actual_length = static_cast<int>(done + n);
  if (!whole && then_stalls) {
    takes.reset();
    then_stalls = false;
    halted = true;
    end(u, EPIPE);
    return true;
  }
  if (whole) end(u, 0);
  return whole;
}

void UsbDeviceModel::Self::fill_in() {
  std::array<std::byte, drivers::kLargestUsbMessage> message{};
  while (loses && intake.next_message(message) > 0) ++lost;
  for (auto it = under_way.begin(); it != under_way.end();) {
    if (it->urb().endpoint != kIn) {
      ++it;
      continue;
    }
    std::vector<std::byte> bytes;
    int status = 0;
    if (!in_errors.empty()) {
      status = in_errors.front();
      in_errors.pop_front();
    } else if (!said.empty()) {
      bytes = said.front();
      said.pop_front();
    } else if (const std::size_t n = intake.next_message(message); n > 0) {
      bytes.assign(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(n));
    } else {
      return;
    }
    Urb u = *it;
    it = under_way.erase(it);
    if (!bytes.empty()) {
      UMockdevIoctlData* buffer = u.buffer();
      umockdev_ioctl_data_update(buffer, 0, reinterpret_cast<guint8*>(bytes.data()),
                                 static_cast<gint>(bytes.size()));
      umockdev_ioctl_data_unref(buffer);
      u.urb().actual_length = static_cast<int>(bytes.size());
    }
    end(u, status);
  }
}

void UsbDeviceModel::Self::reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  if (plugged) {
    fill_in();
  } else {
    while (!under_way.empty()) {
      end(under_way.front(), ESHUTDOWN);
      under_way.pop_front();
    }
  }
  if (ended.empty()) {
    umockdev_ioctl_client_complete(client, -1, plugged ? EAGAIN : ENODEV);
    return;
  }
  Urb u = ended.front();
  ended.pop_front();
  UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(gpointer), nullptr);
  umockdev_ioctl_data_set_ptr(pointer, 0, u.data);
  umockdev_ioctl_data_unref(pointer);
  umockdev_ioctl_data_unref(u.data);
  umockdev_ioctl_client_complete(client, 0, 0);
}

void UsbDeviceModel::Self::discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof address);
  for (auto it = under_way.begin(); it != under_way.end(); ++it) {
    if (it->data->client_addr != address) continue;
    end(*it, ENOENT);
    under_way.erase(it);
    umockdev_ioctl_client_complete(client, 0, 0);
    return;
  }
  umockdev_ioctl_client_complete(client, -1, EINVAL);
}

UsbDeviceModel::UsbDeviceModel(const drivers::UsbLimits& limits)
    : self_(std::make_unique<Self>(limits)) {
  self_->testbed = umockdev_testbed_new();
  self_->handler = umockdev_ioctl_base_new();
  const auto handle = +[](UMockdevIoctlBase*, UMockdevIoctlClient* client, Self* self) -> gboolean {
    return self->handle(client);
  };
  g_signal_connect(self_->handler, "handle-ioctl", G_CALLBACK(handle), self_.get());
}

UsbDeviceModel::~UsbDeviceModel() {
  if (self_->plugged) unplug();
  g_object_unref(self_->handler);
  g_object_unref(self_->testbed);
  for (const Self::Urb& u : self_->under_way) umockdev_ioctl_data_unref(u.data);
  for (const Self::Urb& u : self_->ended) umockdev_ioctl_data_unref(u.data);
}

void UsbDeviceModel::plug() {
  {
    const std::lock_guard lock(self_->mutex);
    self_->plugged = true;
    self_->halted = false;
    self_->intake.reset(0);
  }
  if (!umockdev_testbed_attach_ioctl(self_->testbed, kNode, self_->handler, nullptr) ||
      !umockdev_testbed_add_from_string(self_->testbed, kDescription, nullptr))
    throw std::runtime_error("umockdev: the device was not added");
}

void UsbDeviceModel::unplug() {
  {
    const std::lock_guard lock(self_->mutex);
    self_->plugged = false;
  }
  umockdev_testbed_uevent(self_->testbed, "/sys/devices/usb1/1-1", "remove");
  umockdev_testbed_remove_device(self_->testbed, "/sys/devices/usb1/1-1");
  umockdev_testbed_detach_ioctl(self_->testbed, kNode, nullptr);
}

void UsbDeviceModel::with(const std::function<void(FrameIntake&)>& use) {
  const std::lock_guard lock(self_->mutex);
  use(self_->intake);
}

void UsbDeviceModel::stop_after(std::size_t bytes) {
  const std::lock_guard lock(self_->mutex);
  self_->takes = bytes;
  self_->then_stalls = false;
}

void UsbDeviceModel::go_on() {
  const std::lock_guard lock(self_->mutex);
  self_->takes.reset();
  self_->then_stalls = false;
  for (auto it = self_->under_way.begin(); it != self_->under_way.end();) {
    Self::Urb u = *it;
    it = u.urb().endpoint == kOut && self_->out(u) ? self_->under_way.erase(it) : std::next(it);
  }
}

void UsbDeviceModel::stall_after(std::size_t bytes) {
  const std::lock_guard lock(self_->mutex);
  self_->takes = bytes;
  self_->then_stalls = true;
}

void UsbDeviceModel::fail_next_in(int error) {
  const std::lock_guard lock(self_->mutex);
  self_->in_errors.push_back(error);
}

void UsbDeviceModel::say(std::vector<std::byte> bytes) {
  const std::lock_guard lock(self_->mutex);
  self_->said.push_back(std::move(bytes));
}

void UsbDeviceModel::lose_messages(bool lose) {
  const std::lock_guard lock(self_->mutex);
  self_->loses = lose;
}

int UsbDeviceModel::messages_lost() const {
  const std::lock_guard lock(self_->mutex);
  return self_->lost;
}

int UsbDeviceModel::resets() const {
  const std::lock_guard lock(self_->mutex);
  return self_->resets;
}

}  // namespace test_support
