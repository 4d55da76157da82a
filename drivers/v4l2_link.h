#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hil/camera_link.h"

namespace drivers {

/// What a pixel becomes.
enum class V4l2Format : std::uint8_t {
  kY16,   ///< 16 bits, little-endian, the value in the low ones
  kGrey,  ///< 8 bits: the highest ones of the value
};
/// How frames go into the node.
enum class V4l2Method : std::uint8_t {
  kAuto,   ///< write() into v4l2loopback, else mapped where the driver has that
  kWrite,  ///< one write() a frame
  kMapped  ///< into mapped buffers
};

struct V4l2Spec {
  std::string device = "starloop";  ///< a node ("/dev/video2"), or the card's label
  V4l2Format format = V4l2Format::kY16;
  bool to_top = false;  ///< Y16: the value in the high bits instead
  V4l2Method method = V4l2Method::kAuto;
  engine::Duration period{100'000'000};  ///< told to the node as its frame interval
};

/// A virtual camera: frames into a V4L2 output node, which is v4l2loopback's as a rule; whatever
/// captures from the node sees a camera. Nothing comes back: commands need another way.
///
/// The driver's answer to the format is held against what was asked: it says yes to much that it
/// does not do. For v4l2loopback the stream is on before the first write(), without buffers of its
/// own: capabilities and sequence numbers are right then. With mapped buffers the link takes them
/// in turn and does not heed the index that the driver gives back, which is the wrong one. The
/// driver has no owners of buffers: a reader that keeps one for longer than the ring lasts can see
/// it change, and knows by the checksum of the telemetry row; one that gives it back in time
/// cannot. A telemetry row goes out value for value, whatever becomes of the pixels; its checksum
/// of the image is that of the bytes that go out.
///
/// A node that goes away is looked for at each frame. Thread: sender. Loop-safe once made.
class V4l2Link final : public hil::FrameSink {
 public:
  /// For frames of this size; `rows` with a telemetry row. Throws std::runtime_error: no such node,
  /// and the command that makes one; or a node that cannot do this, and what it said.
  V4l2Link(const V4l2Spec& spec, int width_px, int rows, int bits);
  ~V4l2Link() override;
  V4l2Link(const V4l2Link&) = delete;
  V4l2Link& operator=(const V4l2Link&) = delete;

  /// kDisconnected: the node is gone. kBusy: no buffer came back in time. kRejected: the node took
  /// less than the frame.
  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  /// The node in use.
  [[nodiscard]] const std::string& node() const noexcept { return node_; }

 private:
  struct Buffer {
    void* start = nullptr;
    std::size_t bytes = 0;
  };

  void open_node();
  void close_node() noexcept;
  void negotiate();
  void map_buffers();
  [[nodiscard]] bool stream_on() noexcept;
  [[nodiscard]] bool reopen() noexcept;
  void convert(const hil::Frame& frame, std::byte* out) noexcept;
  [[nodiscard]] std::span<const std::uint16_t> own_row(std::span<const std::uint16_t> row,
                                                       std::span<const std::byte> image) noexcept;
  [[nodiscard]] engine::Status write_frame() noexcept;
  [[nodiscard]] engine::Status queue_frame(const hil::Frame& frame,
                                           engine::Duration timeout) noexcept;
  [[nodiscard]] engine::Error lost(const char* step) noexcept;

  V4l2Spec spec_;
  int width_px_;
  int rows_;
  int bits_;
  std::size_t frame_bytes_;
  std::string node_;
  int file_ = -1;
  bool is_loopback_ = false;
  bool mapped_ = false;
  bool streams_ = false;
  std::vector<std::byte> frame_;  // for write()
  std::vector<std::uint16_t> row_;
  std::vector<Buffer> buffers_;
  std::size_t next_buffer_ = 0;
  std::size_t given_ = 0;  // buffers that the driver has
};

/// A video node of this machine.
struct V4l2Node {
  std::string path;
  std::string card;  ///< its label
  std::string driver;
  bool output = false;    ///< takes frames, by its own words
  bool loopback = false;  ///< v4l2loopback's: takes frames whatever it says
  std::string problem;    ///< why it cannot be opened; empty: it can
};
/// All of /dev, video2 before video10.
[[nodiscard]] std::vector<V4l2Node> list_v4l2_nodes();

/// The node that a name means: itself, or the one whose card has it as its label. Empty: none.
[[nodiscard]] std::string find_v4l2_node(const std::string& name);

}  // namespace drivers
