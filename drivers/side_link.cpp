#include "drivers/side_link.h"

#include <stdexcept>
#include <utility>

namespace drivers {
namespace {

// What it may take for a frame: it has a thread of its own.
constexpr engine::Duration kPatience{1'000'000'000};

}  // namespace

/// The link as a store of frames: a fault is thrown, and the writer counts it.
class SideLink::Store final : public hil::FrameStore {
 public:
  explicit Store(hil::FrameSink& link) : link_(link) {}
  void put(const hil::Frame& frame) override {
    const engine::Status sent = link_.send(frame, kPatience);
    if (!sent.ok()) throw std::runtime_error(sent.error().step);
  }

 private:
  hil::FrameSink& link_;
};

SideLink::SideLink(std::unique_ptr<hil::FrameSink> link, int width_px, int height_px,
                   hil::WhenBusy when_busy)
    : link_(std::move(link)),
      store_(std::make_unique<Store>(*link_)),
      writer_(*store_, width_px, height_px, when_busy) {}

}  // namespace drivers
