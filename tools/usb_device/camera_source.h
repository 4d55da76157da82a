#pragma once

#include <functional>
#include <mutex>
#include <semaphore>
#include <stop_token>
#include <string>
#include <thread>

#include "drivers/client/starloop_client.h"
#include "drivers/usb_device/uvc_camera.h"

namespace usb_device {

/// The frames of `starloop run --set link.to=shm:NAME`, newest first, and the way back of commands:
/// a reader of that link like any other. A run that ends and another one with frames of the same
/// size are one camera.
/// Thread: that of the camera, which send() is called from, and one of its own.
class CameraSource {
 public:
  /// Runs work on the camera's thread.
  using Post = std::function<void(std::function<void()>)>;

  explicit CameraSource(std::string name) : name_(std::move(name)) {}
  ~CameraSource() { close(); }
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;

  /// Waits for frames, as long as it takes, and says what camera it is: its size from the first,
  /// its period from two.
  [[nodiscard]] drivers::UvcSpec wait_for_camera();
  /// A thread that offers every frame to `camera`, until it is asked to stop, or calls `changed`
  /// and ends: one is of another size.
  [[nodiscard]] std::jthread follow(drivers::UvcCamera& camera, Post post,
                                    std::function<void()> changed);
  /// False: the camera is gone, or has not taken the last ones.
  [[nodiscard]] bool send(const hil::Command& command);

 private:
  [[nodiscard]] starloop_status next_frame(starloop_frame& frame);
  void close();
  void read_frames(const std::stop_token& stop, drivers::UvcCamera& camera, const Post& post,
                   const std::function<void()>& changed);

  std::string name_;
  std::mutex mutex_;  // the client is not closed while something is sent
  starloop_client* client_ = nullptr;
  std::binary_semaphore offered_{0};
};

}  // namespace usb_device
