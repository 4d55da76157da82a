#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace test_support {

/// A V4L2 output node of umockdev's: the link is the real one, the driver is this. Only in a
/// program that runs under umockdev-wrapper. Thread: any.
class V4l2NodeModel {
 public:
  struct Spec {
    std::string node = "video0";
    std::string card = "starloop";
    bool loopback = true;  ///< with v4l2loopback's ways; else strict
    bool can_write = true;
    bool capture_only = false;       ///< what exclusive capabilities say to a second opener
    std::uint32_t wrong_fourcc = 0;  ///< what S_FMT gives instead; 0: what was asked
  };
  explicit V4l2NodeModel(const Spec& spec);
  ~V4l2NodeModel();
  V4l2NodeModel(const V4l2NodeModel&) = delete;
  V4l2NodeModel& operator=(const V4l2NodeModel&) = delete;

  void plug();
  void unplug();

  /// All frames so far, as bytes.
  [[nodiscard]] std::vector<std::vector<std::byte>> frames() const;
  /// What it was asked for: "S_FMT", "STREAMON", "WRITE", ... in order.
  [[nodiscard]] std::vector<std::string> asked() const;
  [[nodiscard]] std::uint32_t fourcc() const;
  /// Frame interval in microseconds.
  [[nodiscard]] std::uint32_t interval_us() const;

  void fail_next(const std::string& call, int error);
  /// The next write() takes so many bytes.
  void cut_next_write(std::size_t bytes);
  /// Strict: no buffer comes back until let_go().
  void hold_buffers(bool hold);

 private:
  struct Self;
  std::unique_ptr<Self> self_;
};

}  // namespace test_support
