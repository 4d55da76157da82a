#include "tests/support/v4l2_node_model.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <umockdev.h>
#include <unistd.h>

namespace test_support {

struct V4l2NodeModel::Self {
  explicit Self(Spec s) : spec(std::move(s)) {}

  gboolean handle(UMockdevIoctlClient* client);
  gboolean handle_write(UMockdevIoctlClient* client);
  [[nodiscard]] int answer(unsigned long request, void* argument);
  [[nodiscard]] int set_format(v4l2_format& f);
  [[nodiscard]] int queue(v4l2_buffer& b);
  [[nodiscard]] int dequeue(v4l2_buffer& b);
  [[nodiscard]] int failure(const std::string& call);

  /// Buffers begin at pages.
  [[nodiscard]] std::size_t stride() const { return (size + 4095) / 4096 * 4096; }

  Spec spec;
  mutable std::mutex mutex;
  UMockdevTestbed* testbed = nullptr;
  UMockdevIoctlBase* handler = nullptr;
  bool plugged = false;
  std::vector<std::string> asked;
  std::map<std::string, int> failures;
  std::vector<std::vector<std::byte>> frames;
  std::uint32_t fourcc = 0;
  std::size_t size = 0;
  std::uint32_t interval_us = 0;
  std::size_t cut = 0;
  bool holds = false;
  std::vector<std::byte*> buffers;
  std::deque<std::uint32_t> queued;
  std::uint32_t last_queued = 0;
};

namespace {

struct Call {
  unsigned long request;
  const char* name;
  std::size_t bytes;
};
constexpr Call kCalls[] = {
    {VIDIOC_QUERYCAP, "QUERYCAP", sizeof(v4l2_capability)},
    {VIDIOC_S_FMT, "S_FMT", sizeof(v4l2_format)},
    {VIDIOC_S_PARM, "S_PARM", sizeof(v4l2_streamparm)},
    {VIDIOC_REQBUFS, "REQBUFS", sizeof(v4l2_requestbuffers)},
    {VIDIOC_QUERYBUF, "QUERYBUF", sizeof(v4l2_buffer)},
    {VIDIOC_QBUF, "QBUF", sizeof(v4l2_buffer)},
    {VIDIOC_DQBUF, "DQBUF", sizeof(v4l2_buffer)},
    {VIDIOC_STREAMON, "STREAMON", sizeof(int)},
    {VIDIOC_STREAMOFF, "STREAMOFF", sizeof(int)},
};

}  // namespace

int V4l2NodeModel::Self::failure(const std::string& call) {
  const auto it = failures.find(call);
  if (it == failures.end()) return 0;
  const int error = it->second;
  failures.erase(it);
  return error;
}

gboolean V4l2NodeModel::Self::handle(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  const gulong request = umockdev_ioctl_client_get_request(client);
  const auto* call = std::find_if(std::begin(kCalls), std::end(kCalls),
                                  [&](const Call& c) { return c.request == request; });
  int error = plugged ? ENOTTY : ENODEV;
  if (plugged && call != std::end(kCalls)) {
    asked.emplace_back(call->name);
    error = failure(call->name);
    if (error == 0) {
      UMockdevIoctlData* data = umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client),
                                                            0, call->bytes, nullptr);
      error = answer(request, data->data);
      umockdev_ioctl_data_unref(data);
    }
  }
  umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
  return TRUE;
}

int V4l2NodeModel::Self::answer(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& c = *static_cast<v4l2_capability*>(argument);
      std::memset(&c, 0, sizeof c);
      std::strcpy(reinterpret_cast<char*>(c.driver), spec.loopback ? "v4l2 loopback" : "vivid");
      std::strncpy(reinterpret_cast<char*>(c.card), spec.card.c_str(), sizeof c.card - 1);
      c.device_caps = (spec.capture_only ? V4L2_CAP_VIDEO_CAPTURE : V4L2_CAP_VIDEO_OUTPUT) |
                      V4L2_CAP_STREAMING | (spec.can_write ? V4L2_CAP_READWRITE : 0U);
      c.capabilities = c.device_caps | V4L2_CAP_DEVICE_CAPS;
      return 0;
    }
    case VIDIOC_S_FMT:
      return set_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM: {
      const v4l2_fract& t = static_cast<v4l2_streamparm*>(argument)->parm.output.timeperframe;
      interval_us = static_cast<std::uint32_t>(1'000'000ULL * t.numerator / t.denominator);
      return 0;
    }
    case VIDIOC_REQBUFS: {
      auto& r = *static_cast<v4l2_requestbuffers*>(argument);
      gchar* root = umockdev_testbed_get_root_dir(testbed);
      const std::string path = std::string(root) + "/dev/" + spec.node;
      g_free(root);
      const int file = open(path.c_str(), O_RDWR);
      if (file < 0 || ftruncate(file, static_cast<off_t>(stride() * r.count)) != 0) return EIO;
      for (std::uint32_t i = 0; i < r.count; ++i)
        buffers.push_back(
            static_cast<std::byte*>(mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file,
                                         static_cast<off_t>(stride() * i))));
      close(file);
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      b.length = static_cast<std::uint32_t>(size);
      b.m.offset = static_cast<std::uint32_t>(stride() * b.index);
      return b.index < buffers.size() ? 0 : EINVAL;
    }
    case VIDIOC_QBUF:
      return queue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return dequeue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      // A strict queue wants a buffer before it starts.
      return !spec.loopback && queued.empty() ? EINVAL : 0;
    default:
      return 0;
  }
}

int V4l2NodeModel::Self::set_format(v4l2_format& f) {
  v4l2_pix_format& p = f.fmt.pix;
  if (spec.wrong_fourcc != 0) p.pixelformat = spec.wrong_fourcc;
  fourcc = p.pixelformat;
  const std::uint32_t bytes = fourcc == V4L2_PIX_FMT_GREY ? 1 : fourcc == V4L2_PIX_FMT_Y16 ? 2 : 4;
  p.bytesperline = bytes * p.width;
  p.sizeimage = p.bytesperline * p.height;
  // The loopback's buffers are whole pages, and it says so.
  if (spec.loopback) p.sizeimage = (p.sizeimage + 4095) / 4096 * 4096;
  size = p.sizeimage;
  return 0;
}

int V4l2NodeModel::Self::queue(v4l2_buffer& b) {
  if (b.index >= buffers.size()) return EINVAL;
  const bool has_it = std::find(queued.begin(), queued.end(), b.index) != queued.end();
  if (!spec.loopback && has_it) return EINVAL;
  const std::byte* start = buffers[b.index];
  frames.emplace_back(start, start + b.bytesused);
  queued.push_back(b.index);
  last_queued = b.index;
  return 0;
}

int V4l2NodeModel::Self::dequeue(v4l2_buffer& b) {
  if (holds || queued.empty()) return EAGAIN;
  // The loopback's mistake: the one that was queued last.
  b.index = spec.loopback ? last_queued : queued.front();
  queued.pop_front();
  return 0;
}

gboolean V4l2NodeModel::Self::handle_write(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  asked.emplace_back("WRITE");
  int error = plugged ? failure("WRITE") : ENODEV;
  if (!spec.loopback && error == 0) error = EINVAL;  // as vivid does, which says it can
  const auto given = static_cast<std::size_t>(argument->data_len);
  const std::size_t n = cut > 0 ? std::min(std::exchange(cut, std::size_t{0}), given) : given;
  if (error == 0) {
    const auto* bytes = reinterpret_cast<const std::byte*>(argument->data);
    frames.emplace_back(bytes, bytes + n);
  }
  umockdev_ioctl_client_complete(client, error == 0 ? static_cast<glong>(n) : -1, error);
  return TRUE;
}

V4l2NodeModel::V4l2NodeModel(const Spec& spec) : self_(std::make_unique<Self>(spec)) {
  self_->testbed = umockdev_testbed_new();
  self_->handler = umockdev_ioctl_base_new();
  const auto ioctl_handler = +[](UMockdevIoctlBase*, UMockdevIoctlClient* client,
                                 Self* self) -> gboolean { return self->handle(client); };
  const auto write_handler = +[](UMockdevIoctlBase*, UMockdevIoctlClient* client,
                                 Self* self) -> gboolean { return self->handle_write(client); };
  g_signal_connect(self_->handler, "handle-ioctl", G_CALLBACK(ioctl_handler), self_.get());
  g_signal_connect(self_->handler, "handle-write", G_CALLBACK(write_handler), self_.get());
}

V4l2NodeModel::~V4l2NodeModel() {
  if (self_->plugged) unplug();
  for (std::byte* b : self_->buffers) munmap(b, self_->size);
  g_object_unref(self_->handler);
  g_object_unref(self_->testbed);
}

void V4l2NodeModel::plug() {
  const std::string node = self_->spec.node;
  {
    const std::lock_guard lock(self_->mutex);
    self_->plugged = true;
  }
  const std::string text = "P: /devices/virtual/video4linux/" + node + "\nN: " + node +
                           "=00\nE: DEVNAME=/dev/" + node +
                           "\nE: SUBSYSTEM=video4linux\nA: name=" + self_->spec.card + "\n";
  if (!umockdev_testbed_attach_ioctl(self_->testbed, ("/dev/" + node).c_str(), self_->handler,
                                     nullptr) ||
      !umockdev_testbed_add_from_string(self_->testbed, text.c_str(), nullptr))
    throw std::runtime_error("umockdev: the node was not added");
}

void V4l2NodeModel::unplug() {
  const std::string node = self_->spec.node;
  {
    const std::lock_guard lock(self_->mutex);
    self_->plugged = false;
  }
  umockdev_testbed_remove_device(self_->testbed,
                                 ("/sys/devices/virtual/video4linux/" + node).c_str());
  umockdev_testbed_detach_ioctl(self_->testbed, ("/dev/" + node).c_str(), nullptr);
}

std::vector<std::vector<std::byte>> V4l2NodeModel::frames() const {
  const std::lock_guard lock(self_->mutex);
  return self_->frames;
}
std::vector<std::string> V4l2NodeModel::asked() const {
  const std::lock_guard lock(self_->mutex);
  return self_->asked;
}
std::uint32_t V4l2NodeModel::fourcc() const {
  const std::lock_guard lock(self_->mutex);
  return self_->fourcc;
}
std::uint32_t V4l2NodeModel::interval_us() const {
  const std::lock_guard lock(self_->mutex);
  return self_->interval_us;
}
void V4l2NodeModel::fail_next(const std::string& call, int error) {
  const std::lock_guard lock(self_->mutex);
  self_->failures[call] = error;
}
void V4l2NodeModel::cut_next_write(std::size_t bytes) {
  const std::lock_guard lock(self_->mutex);
  self_->cut = bytes;
}
void V4l2NodeModel::hold_buffers(bool hold) {
  const std::lock_guard lock(self_->mutex);
  self_->holds = hold;
}

}  // namespace test_support
