#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace engine {

/// Since which of the last 64 frames a direction has turned by more than is allowed.
/// Thread: note() and forget() the loop's, since() any. Loop-safe.
class RecentTurns {
 public:
  static constexpr std::uint32_t kFrames = 64;

  explicit RecentTurns(float most_rad) noexcept : most2_(most_rad * most_rad) { forget(); }

  /// Another direction, from which all before it are far.
  void forget() noexcept { toward_.fill(Eigen::Vector3f::Zero()); }
  /// Frames are counted up by one; `toward` is a unit vector.
  void note(std::uint32_t frame, const Eigen::Vector3f& toward) noexcept {
    now_ = frame;
    toward_[frame % kFrames] = toward;
    // A direction that is no number has turned.
    for (std::size_t f = 0; f < kFrames; ++f)
      turned_[f] = !((toward_[f] - toward).squaredNorm() < most2_);
  }
  /// Of a frame longer ago nothing is known: it has.
  [[nodiscard]] bool since(std::uint32_t frame) const noexcept {
    return now_ - frame >= kFrames || turned_[frame % kFrames];
  }
  [[nodiscard]] const Eigen::Vector3f& now() const noexcept { return toward_[now_ % kFrames]; }

 private:
  float most2_;
  std::uint32_t now_ = 0;
  std::array<Eigen::Vector3f, kFrames> toward_;
  std::array<bool, kFrames> turned_{};
};

}  // namespace engine
