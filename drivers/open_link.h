#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "drivers/mock_link.h"
#include "drivers/shm_link.h"
#include "engine/core/config_reader.h"
#include "hil/camera_link.h"

namespace drivers {

enum class LinkKind : std::uint8_t {
  kMock,  ///< inside this process, for the built-in tracker
  kShm,   ///< shared memory, for software in a process of its own
};

/// The table `link` of a scenario.
struct LinkSpec {
  LinkKind kind = LinkKind::kMock;
  std::string name = "starloop";  ///< kShm: of the shared memory object
  int slots = 4;                  ///< kShm: frames in the ring, in [2, 16]
  bool telemetry_row = false;     ///< one row more, below the image (hil/telemetry_row.h)
};

/// Throws engine::ConfigError.
[[nodiscard]] LinkSpec read_link(const engine::ConfigTable& table);

/// An open link: where frames go and where commands come from.
class OpenLink {
 public:
  explicit OpenLink(std::unique_ptr<MockLink> link) noexcept
      : mock_(std::move(link)), sink_(mock_.get()), source_(mock_.get()) {}
  explicit OpenLink(std::unique_ptr<ShmLink> link) noexcept
      : shm_(std::move(link)), sink_(shm_.get()), source_(shm_.get()) {}

  [[nodiscard]] hil::FrameSink& frames() const noexcept { return *sink_; }
  [[nodiscard]] hil::CommandSource& commands() const noexcept { return *source_; }
  /// The device's side of a mock; null for every other kind.
  [[nodiscard]] MockLink* mock() const noexcept { return mock_.get(); }

 private:
  std::unique_ptr<MockLink> mock_;
  std::unique_ptr<ShmLink> shm_;
  hil::FrameSink* sink_;
  hil::CommandSource* source_;
};

/// Throws std::runtime_error when the world does not let it.
[[nodiscard]] OpenLink open_link(const LinkSpec& spec, int width_px, int height_px,
                                 WhenFull when_full);

}  // namespace drivers
