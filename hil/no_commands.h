#pragma once

#include <semaphore>

#include "hil/camera_link.h"

namespace hil {

/// Nobody commands: a link without a way back, or a replay. Thread: receiver.
class NoCommands final : public CommandSource {
 public:
  engine::Expected<Command> receive(engine::Duration timeout) noexcept override {
    static_cast<void>(never_.try_acquire_for(timeout));
    return engine::Error{engine::Fault::kTimeout, 0, "nobody commands"};
  }

 private:
  std::counting_semaphore<> never_{0};
};

}  // namespace hil
