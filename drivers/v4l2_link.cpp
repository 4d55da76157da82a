#include "drivers/v4l2_link.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "engine/core/crc32c.h"
#include "hil/telemetry_row.h"

namespace drivers {
namespace {

using engine::Done;
using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::Status;

constexpr unsigned kBuffers = 4;
constexpr char kLoopbackDriver[] = "v4l2 loopback";

/// ioctl() that a signal does not end.
template <class T>
int ask(int file, unsigned long request, T* argument) noexcept {
  int result = 0;
  do {
    result = ioctl(file, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

template <class T>
T zeroed() noexcept {
  T t;
  std::memset(&t, 0, sizeof t);
  return t;
}

std::string text_of(const __u8* text, std::size_t most) {
  const char* begin = reinterpret_cast<const char*>(text);
  return {begin, strnlen(begin, most)};
}

std::string fourcc(std::uint32_t code) {
  std::string text;
  for (int i = 0; i < 4; ++i) text += static_cast<char>(code >> (8 * i) & 0x7F);
  return text;
}

bool capability(int file, v4l2_capability& c) noexcept {
  c = zeroed<v4l2_capability>();
  return ask(file, VIDIOC_QUERYCAP, &c) == 0;
}

std::uint32_t capabilities_of(const v4l2_capability& c) noexcept {
  return (c.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? c.device_caps : c.capabilities;
}

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error("v4l2: " + what); }

std::string because() { return std::string(": ") + std::strerror(errno); }

}  // namespace

std::vector<V4l2Node> list_v4l2_nodes() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    const std::string file = entry.path().filename();
    if (file.starts_with("video") && file.size() > 5) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  std::vector<V4l2Node> nodes;
  for (const std::string& path : paths) {
    V4l2Node node;
    node.path = path;
    const int file = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) node.problem = std::strerror(errno);
    v4l2_capability c;
    if (file >= 0 && capability(file, c)) {
      node.card = text_of(c.card, sizeof c.card);
      node.driver = text_of(c.driver, sizeof c.driver);
      node.output = (capabilities_of(c) & V4L2_CAP_VIDEO_OUTPUT) != 0;
      node.loopback = node.driver == kLoopbackDriver;
    } else if (file >= 0) {
      node.problem = "no video device";
    }
    if (file >= 0) close(file);
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::string find_v4l2_node(const std::string& name) {
  if (name.starts_with("/")) return access(name.c_str(), F_OK) == 0 ? name : std::string();
  for (const V4l2Node& node : list_v4l2_nodes())
    if (node.problem.empty() && node.card == name) return node.path;
  return {};
}

V4l2Link::V4l2Link(const V4l2Spec& spec, int width_px, int rows, int bits)
    : spec_(spec),
      width_px_(width_px),
      rows_(rows),
      bits_(bits),
      frame_bytes_(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(rows) *
                   (spec.format == V4l2Format::kY16 ? 2U : 1U)),
      frame_(frame_bytes_),
      row_(static_cast<std::size_t>(width_px)) {
  if (find_v4l2_node(spec.device).empty()) {
    const std::string label = spec.device.starts_with("/") ? "starloop" : spec.device;
    fail("there is no " + spec.device +
         "; this makes one: sudo modprobe v4l2loopback card_label=" + label + " exclusive_caps=1");
  }
  try {
    open_node();
  } catch (...) {
    close_node();
    throw;
  }
}

V4l2Link::~V4l2Link() { close_node(); }

void V4l2Link::open_node() {
  node_ = find_v4l2_node(spec_.device);
  if (node_.empty()) fail("there is no " + spec_.device);
  file_ = open(node_.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (file_ < 0) fail(node_ + because());
  v4l2_capability c;
  if (!capability(file_, c)) fail(node_ + " is no video device");
  is_loopback_ = text_of(c.driver, sizeof c.driver) == kLoopbackDriver;
  const std::uint32_t can = capabilities_of(c);
  // With exclusive capabilities a loopback that somebody has opened before says "capture" alone.
  if ((can & V4L2_CAP_VIDEO_OUTPUT) == 0 && !is_loopback_)
    fail(node_ + " (" + text_of(c.card, sizeof c.card) + ") takes no frames: it is no output");
  const bool can_write = (can & V4L2_CAP_READWRITE) != 0;
  const bool can_map = (can & V4L2_CAP_STREAMING) != 0;
  // Others say that they take write() and do not, or have nothing to lose by their own buffers.
  const bool writes = can_write && (is_loopback_ || !can_map);
  mapped_ = spec_.method == V4l2Method::kMapped || (spec_.method == V4l2Method::kAuto && !writes);
  if (mapped_ ? !can_map : !can_write)
    fail(node_ + (mapped_ ? " has no buffers to map" : " takes no write()"));
  negotiate();
  if (mapped_) map_buffers();
  // Other drivers want a buffer first, and nothing at all for write().
  if (is_loopback_ && !stream_on()) fail(node_ + " does not start" + because());
}

void V4l2Link::negotiate() {
  const std::uint32_t wanted =
      spec_.format == V4l2Format::kY16 ? V4L2_PIX_FMT_Y16 : V4L2_PIX_FMT_GREY;
  auto format = zeroed<v4l2_format>();
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  v4l2_pix_format& p = format.fmt.pix;
  p.width = static_cast<std::uint32_t>(width_px_);
  p.height = static_cast<std::uint32_t>(rows_);
  p.pixelformat = wanted;
  p.field = V4L2_FIELD_NONE;
  p.colorspace = V4L2_COLORSPACE_RAW;
  const auto bytes_per_row =
      static_cast<std::uint32_t>(frame_bytes_ / static_cast<std::size_t>(rows_));
  p.bytesperline = bytes_per_row;
  p.sizeimage = static_cast<std::uint32_t>(frame_bytes_);
  const std::string asked = fourcc(wanted) + " " + std::to_string(width_px_) + " x " +
                            std::to_string(rows_) + ", " + std::to_string(frame_bytes_) + " bytes";
  if (ask(file_, VIDIOC_S_FMT, &format) != 0)
    fail(node_ + " refuses " + asked + because() +
         (errno == EBUSY ? "; a reader holds another format: close it first" : ""));
  // A driver may want more room than a frame takes (v4l2loopback: whole pages), but rows as they
  // are.
  if (p.pixelformat != wanted || p.width != static_cast<std::uint32_t>(width_px_) ||
      p.height != static_cast<std::uint32_t>(rows_) || p.bytesperline != bytes_per_row ||
      p.sizeimage < frame_bytes_) {
    fail(node_ + ": asked for " + asked + ", got " + fourcc(p.pixelformat) + " " +
         std::to_string(p.width) + " x " + std::to_string(p.height) + ", " +
         std::to_string(p.sizeimage) + " bytes in rows of " + std::to_string(p.bytesperline) +
         "; a reader holds that format (close it first), or the node cannot do this one");
  }
  auto interval = zeroed<v4l2_streamparm>();
  interval.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  interval.parm.output.timeperframe.numerator =
      static_cast<std::uint32_t>(spec_.period / std::chrono::microseconds(1));
  interval.parm.output.timeperframe.denominator = 1'000'000;
  // A node without an interval of its own is none the worse for it.
  static_cast<void>(ask(file_, VIDIOC_S_PARM, &interval));
}

void V4l2Link::map_buffers() {
  auto request = zeroed<v4l2_requestbuffers>();
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  request.memory = V4L2_MEMORY_MMAP;
  if (ask(file_, VIDIOC_REQBUFS, &request) != 0 || request.count < 2)
    fail(node_ + " gives no buffers" + because());
  for (std::uint32_t i = 0; i < request.count; ++i) {
    auto buffer = zeroed<v4l2_buffer>();
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (ask(file_, VIDIOC_QUERYBUF, &buffer) != 0) fail(node_ + ": a buffer" + because());
    if (buffer.length < frame_bytes_) fail(node_ + ": a buffer is smaller than a frame");
    void* start = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, file_,
                       static_cast<off_t>(buffer.m.offset));
    if (start == MAP_FAILED) fail(node_ + ": a buffer cannot be mapped" + because());
    buffers_.push_back({start, buffer.length});
  }
}

bool V4l2Link::stream_on() noexcept {
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  streams_ = ask(file_, VIDIOC_STREAMON, &type) == 0;
  return streams_;
}

void V4l2Link::close_node() noexcept {
  if (file_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  static_cast<void>(ask(file_, VIDIOC_STREAMOFF, &type));
  for (const Buffer& b : buffers_) munmap(b.start, b.bytes);
  buffers_.clear();
  next_buffer_ = given_ = 0;
  streams_ = false;
  close(file_);
  file_ = -1;
}

bool V4l2Link::reopen() noexcept {
  try {
    open_node();
  } catch (const std::exception&) {
    close_node();
  }
  return file_ >= 0;
}

void V4l2Link::convert(const hil::Frame& frame, std::byte* out) noexcept {
  const std::span<const std::uint16_t> image = frame.pixels->pixels();
  std::span<const std::uint16_t> row = frame.telemetry_row;
  if (spec_.format == V4l2Format::kGrey) {
    const int down = std::max(0, bits_ - 8);
    const auto to_byte = [](int shift) {
      return [shift](std::uint16_t dn) { return static_cast<std::byte>(dn >> shift); };
    };
    std::byte* below = std::transform(image.begin(), image.end(), out, to_byte(down));
    row = own_row(row, {out, below});
    std::transform(row.begin(), row.end(), below, to_byte(0));
    return;
  }
  auto* words = reinterpret_cast<std::uint16_t*>(out);
  const int up = spec_.to_top ? 16 - bits_ : 0;
  auto* below = std::transform(image.begin(), image.end(), words, [up](std::uint16_t dn) {
    return static_cast<std::uint16_t>(dn << up);
  });
  if (up > 0) row = own_row(row, std::as_bytes(std::span(words, below)));
  std::copy(row.begin(), row.end(), below);
}

/// The frame's own row, with the checksum of what became of the image; one that is no telemetry
/// stays as it is.
std::span<const std::uint16_t> V4l2Link::own_row(std::span<const std::uint16_t> row,
                                                 std::span<const std::byte> image) noexcept {
  const auto decoded = hil::decode_telemetry_row(row);
  if (!decoded.ok() || row.size() != row_.size()) return row;
  hil::TelemetryRow telemetry = decoded.value();
  telemetry.image_crc32c = engine::crc32c(image);
  static_cast<void>(hil::encode_telemetry_row(telemetry, row_));
  return row_;
}

Status V4l2Link::send(const hil::Frame& frame, Duration timeout) noexcept {
  if (file_ < 0 && !reopen()) return Error{Fault::kDisconnected, ENODEV, "v4l2: no device"};
  const std::size_t pixels = frame.pixels->pixels().size() + frame.telemetry_row.size();
  if (pixels != static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(rows_))
    return Error{Fault::kRejected, 0, "v4l2: a frame of another size"};
  if (mapped_) return queue_frame(frame, timeout);
  convert(frame, frame_.data());
  return write_frame();
}

Error V4l2Link::lost(const char* step) noexcept {
  const int code = errno;
  const bool gone = code == ENODEV || code == ENXIO || code == EBADF;
  if (gone) close_node();
  return {gone ? Fault::kDisconnected : Fault::kSystem, code, step};
}

Status V4l2Link::write_frame() noexcept {
  ssize_t n = 0;
  do {
    n = write(file_, frame_.data(), frame_.size());
  } while (n < 0 && errno == EINTR);
  if (n < 0 && errno == EAGAIN) return Error{Fault::kBusy, EAGAIN, "v4l2: write"};
  if (n < 0) return lost("v4l2: write");
  if (static_cast<std::size_t>(n) != frame_.size())
    return Error{Fault::kRejected, 0, "v4l2: the node took less than the frame"};
  return Done{};
}

Status V4l2Link::queue_frame(const hil::Frame& frame, Duration timeout) noexcept {
  auto buffer = zeroed<v4l2_buffer>();
  buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  buffer.memory = V4L2_MEMORY_MMAP;
  std::size_t index = next_buffer_;
  if (given_ == buffers_.size()) {
    pollfd ready{file_, POLLOUT, 0};
    const int events = poll(&ready, 1, static_cast<int>(timeout / std::chrono::milliseconds(1)));
    if (events == 0) return Error{Fault::kBusy, 0, "v4l2: the node has every buffer"};
    if (ask(file_, VIDIOC_DQBUF, &buffer) != 0) {
      if (errno == EAGAIN) return Error{Fault::kBusy, EAGAIN, "v4l2: the node has every buffer"};
      return lost("v4l2: take a buffer");
    }
    --given_;
    // The loopback answers with the one that was queued last: its ring goes round all the same.
    if (!is_loopback_) index = buffer.index;
  }
  if (index >= buffers_.size()) return Error{Fault::kRejected, 0, "v4l2: a buffer that is none"};
  convert(frame, static_cast<std::byte*>(buffers_[index].start));
  buffer = zeroed<v4l2_buffer>();
  buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = static_cast<std::uint32_t>(index);
  buffer.bytesused = static_cast<std::uint32_t>(frame_bytes_);
  buffer.field = V4L2_FIELD_NONE;
  if (ask(file_, VIDIOC_QBUF, &buffer) != 0) return lost("v4l2: give a buffer");
  ++given_;
  next_buffer_ = (index + 1) % buffers_.size();
  if (!streams_ && !stream_on()) return lost("v4l2: start the stream");
  return Done{};
}

}  // namespace drivers
