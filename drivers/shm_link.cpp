#include "drivers/shm_link.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>

#include "drivers/client/shm_layout.h"
#include "drivers/client/shm_sync.h"
#include "drivers/frame_packet.h"
#include "hil/space_packet.h"
#include "hil/steady_clock.h"

namespace drivers {

using engine::Done;
using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::Fault;
using engine::Status;

namespace {

constexpr Duration kLookForReader{STARLOOP_SHM_LIVENESS_MS * 1'000'000LL};
// A reader that claims a slot while we want it makes us look again; one that never stops does not.
constexpr int kMostLooks = 8;

std::size_t whole_pages(std::size_t bytes) noexcept {
  return (bytes + STARLOOP_SHM_PAGE - 1) / STARLOOP_SHM_PAGE * STARLOOP_SHM_PAGE;
}

}  // namespace

ShmLink::Places ShmLink::places(const ShmSpec& spec, int width_px, int height_px) {
  ENSURE(spec.slots >= 2 && spec.slots <= STARLOOP_SHM_MOST_SLOTS);
  ENSURE(width_px >= 1 && width_px <= kLargestSide_px);
  ENSURE(height_px >= 1 && height_px <= kLargestSide_px);
  Places places;
  places.slots_at = whole_pages(sizeof(starloop_shm));
  places.slot_bytes = whole_pages(largest_frame_bytes(width_px, height_px));
  places.total_bytes = places.slots_at + static_cast<std::size_t>(spec.slots) * places.slot_bytes;
  return places;
}

ShmLink::ShmLink(const ShmSpec& spec, int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      slots_(static_cast<std::uint32_t>(spec.slots)),
      when_full_(spec.when_full),
      places_(places(spec, width_px, height_px)),
      object_(spec.name, places_.total_bytes,
              [this](std::span<std::byte> bytes) {
                auto* header = new (bytes.data()) starloop_shm{};
                header->magic = STARLOOP_SHM_MAGIC;
                header->total_bytes = places_.total_bytes;
                header->slots_at = places_.slots_at;
                header->slot_bytes = places_.slot_bytes;
                header->slots = slots_;
                header->wait_when_full = when_full_ == WhenFull::kWait ? 1 : 0;
                header->width_px = static_cast<std::uint32_t>(width_px_);
                header->height_px = static_cast<std::uint32_t>(height_px_);
                header->camera_pid = getpid();
              }),
      shared_(std::launder(reinterpret_cast<starloop_shm*>(object_.bytes().data()))) {}

ShmLink::~ShmLink() {
  if (!object_.whole()) return;
  starloop_store32(&shared_->closed, 1);
  starloop_ring(&shared_->frame_bell);
}

std::span<std::byte> ShmLink::slot_bytes(std::uint32_t slot) const noexcept {
  return object_.bytes().subspan(places_.slots_at + slot * places_.slot_bytes, places_.slot_bytes);
}

bool ShmLink::has_reader() const noexcept {
  return object_.reader_lives() && object_.whole() && starloop_load32(&shared_->attached) != 0;
}

Status ShmLink::send(const hil::Frame& frame, Duration timeout) noexcept {
  if (frame.pixels == nullptr || frame.pixels->width() != width_px_ ||
      frame.pixels->height() != height_px_) {
    return Error{Fault::kRejected, 0, "shm: frame of another camera"};
  }
  if (!object_.whole()) return Error{Fault::kDisconnected, 0, "shm: the object was cut short"};
  const Expected<std::uint32_t> slot = take_slot(timeout);
  if (!slot.ok()) return slot.error();
  starloop_shm_slot& entry = shared_->slot[slot.value()];
  const Expected<std::size_t> used = encode_frame(frame, slot_bytes(slot.value()));
  if (!used.ok()) {
    starloop_store64(&entry.word, starloop_slot_word(ticket_, STARLOOP_SLOT_FREE));
    return used.error();
  }
  ++published_;
  starloop_store64(&shared_->published, published_);
  starloop_store64(&shared_->lost, lost_);
  starloop_store32(&shared_->closed, 0);  // whatever a reader wrote there
  starloop_store64(&entry.used, used.value());
  starloop_store64(&entry.word, starloop_slot_word(ticket_++, STARLOOP_SLOT_READY));
  starloop_ring(&shared_->frame_bell);
  return Done{};
}

Expected<std::uint32_t> ShmLink::take_slot(Duration timeout) noexcept {
  const Duration give_up = hil::SteadyClock::stopwatch() + timeout;
  for (;;) {
    const std::uint32_t seen = starloop_load32(&shared_->space_bell);
    const bool reader = has_reader();
    std::uint32_t slot = 0;
    if (reader && try_slots(slot)) return slot;
    const Duration left = give_up - hil::SteadyClock::stopwatch();
    if (left <= Duration{} || (!reader && when_full_ == WhenFull::kDropOldest)) {
      if (!reader) return Error{Fault::kDisconnected, 0, "shm: nobody reads"};
      return Error{Fault::kBusy, 0, "shm: every slot is held"};
    }
    // A crash rings no bell.
    starloop_wait(&shared_->space_bell, seen, std::min(left, kLookForReader).count());
  }
}

bool ShmLink::try_slots(std::uint32_t& slot) noexcept {
  for (int look = 0; look < kMostLooks; ++look) {
    // Free ones first, then the oldest that nobody has claimed. A slot "being written" that we do
    // not write is somebody's scribble, and free.
    std::uint64_t chosen = 0;
    std::uint64_t oldest = std::numeric_limits<std::uint64_t>::max();
    bool found = false;
    bool found_free = false;
    for (std::uint32_t i = 0; i < slots_ && !found_free; ++i) {
      const std::uint64_t word = starloop_load64(&shared_->slot[i].word);
      const unsigned state = starloop_slot_state(word);
      if (state == STARLOOP_SLOT_CLAIMED) continue;
      found_free = state != STARLOOP_SLOT_READY;
      if (!found_free && (when_full_ == WhenFull::kWait || starloop_slot_ticket(word) > oldest))
        continue;
      oldest = starloop_slot_ticket(word);
      chosen = word;
      slot = i;
      found = true;
    }
    if (!found) return false;
    if (starloop_change64(&shared_->slot[slot].word, chosen,
                          starloop_slot_word(ticket_, STARLOOP_SLOT_WRITING)) != 0) {
      if (!found_free) ++lost_;
      return true;
    }
  }
  return false;
}

Expected<hil::Command> ShmLink::receive(Duration timeout) noexcept {
  if (!object_.whole()) return Error{Fault::kDisconnected, 0, "shm: the object was cut short"};
  const Duration give_up = hil::SteadyClock::stopwatch() + timeout;
  // Whoever scribbled over our count sees it right again.
  starloop_store64(&shared_->packets_taken, packets_taken_);
  for (;;) {
    const std::uint32_t seen = starloop_load32(&shared_->packet_bell);
    Expected<hil::Command> command = Error{Fault::kTimeout, 0, "shm: receive"};
    if (take_packet(command)) return command;
    const Duration left = give_up - hil::SteadyClock::stopwatch();
    if (left <= Duration{}) return command;
    starloop_wait(&shared_->packet_bell, seen, left.count());
  }
}

bool ShmLink::take_packet(Expected<hil::Command>& command) noexcept {
  const std::uint64_t made = starloop_load64(&shared_->packets_made);
  if (made == packets_taken_) return false;
  if (made - packets_taken_ > STARLOOP_SHM_PACKETS) {
    packets_taken_ = made;
    command = Error{Fault::kRejected, 0, "shm: count of packets"};
  } else {
    // A copy first: what is checked is what is used.
    starloop_shm_packet packet;
    std::memcpy(&packet, &shared_->packet[packets_taken_ % STARLOOP_SHM_PACKETS], sizeof packet);
    ++packets_taken_;
    if (packet.used > STARLOOP_SHM_PACKET_BYTES) {
      command = Error{Fault::kRejected, 0, "shm: length of a packet"};
    } else {
      command = hil::decode_command(std::as_bytes(std::span(packet.bytes)).first(packet.used));
      if (command.ok()) {
        hil::Command from_reader = command.value();
        from_reader.sender = packet.sender;
        command = from_reader;
      }
    }
  }
  starloop_store64(&shared_->packets_taken, packets_taken_);
  return true;
}

}  // namespace drivers
