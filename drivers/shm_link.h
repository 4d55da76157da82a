#pragma once

#include <cstdint>
#include <string>

#include "drivers/shm_object.h"
#include "hil/camera_link.h"

struct starloop_shm;

namespace drivers {

/// When the reader leaves every slot unread: a rig goes on with the newest frames, a rehearsal
/// waits. Claimed frames are the reader's in both.
enum class WhenFull : std::uint8_t { kDropOldest, kWait };

struct ShmSpec {
  std::string name = "starloop";  ///< of the object; a reader opens the link by it
  int slots = 4;                  ///< in [2, 16]
  WhenFull when_full = WhenFull::kDropOldest;
};

/// A cable to software in another process: a ring of frames in shared memory, as the bytes of
/// frame_packet.h, and a ring of the packets of hil/space_packet.h back. The other end is
/// client/starloop_client.h; what lies where, and who may change it, is in client/shm_layout.h.
///
/// One reader at a time. It may crash at any moment, and the next one starts with what it had
/// claimed freed; it may write anything anywhere, and loses nothing but its own frames and
/// commands. With a wait, frames of a reader that died are given to the next one; without, they are
/// stale, and it starts with the next frame.
///
/// Thread: sender for send(), receiver for receive(). Loop-safe once made.
class ShmLink final : public hil::FrameSink, public hil::CommandSource {
 public:
  /// Throws std::runtime_error: the name is taken by a living camera, or there is no memory.
  ShmLink(const ShmSpec& spec, int width_px, int height_px);
  ~ShmLink() override;
  ShmLink(const ShmLink&) = delete;
  ShmLink& operator=(const ShmLink&) = delete;

  /// kDisconnected: nobody is there (at once when dropping, after the timeout when waiting).
  /// kBusy: the reader has claimed every slot, or, waiting, not yet taken the oldest.
  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  /// Command::sender is the number of the attachment: a new reader counts from 0 again.
  engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept override;
  [[nodiscard]] bool has_reader() const noexcept override;

  /// Frames made ready. Thread: sender.
  [[nodiscard]] std::uint64_t published() const noexcept { return published_; }
  /// Of those, overwritten before anybody claimed them; the reader sees it, too. Thread: sender.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  struct Places {
    std::size_t slots_at = 0;
    std::size_t slot_bytes = 0;
    std::size_t total_bytes = 0;
  };
  [[nodiscard]] static Places places(const ShmSpec& spec, int width_px, int height_px);
  /// A slot in state writing, or none.
  [[nodiscard]] engine::Expected<std::uint32_t> take_slot(engine::Duration timeout) noexcept;
  [[nodiscard]] bool try_slots(std::uint32_t& slot) noexcept;
  [[nodiscard]] bool take_packet(engine::Expected<hil::Command>& command) noexcept;
  [[nodiscard]] std::span<std::byte> slot_bytes(std::uint32_t slot) const noexcept;

  int width_px_;
  int height_px_;
  std::uint32_t slots_;
  WhenFull when_full_;
  Places places_;
  ShmObject object_;
  starloop_shm* shared_;
  // The sender's own.
  std::uint64_t ticket_ = 1;
  std::uint64_t published_ = 0;
  std::uint64_t lost_ = 0;
  // The receiver's own.
  std::uint64_t packets_taken_ = 0;
};

}  // namespace drivers
