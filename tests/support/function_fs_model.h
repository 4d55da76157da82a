#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/usb_device/function_files.h"

/// The kernel's side of a functionfs, and a host behind it: as Linux' f_fs.c answers, with packets.
/// A read ends when it is full or a packet was short; packets wait when there is no read. Cancelled
/// and unplugged reads lose what they had. An event makes older ones of its kind unseen.
class FunctionFsModel final : public drivers::FunctionFiles {
 public:
  using Bytes = std::vector<std::byte>;

  // The cable.
  void plug(std::size_t packet_bytes = 512);
  void unplug();
  /// Unplugged and plugged in before anybody looks.
  void replug() { unplug(), plug(packet_bytes_); }

  // The host.
  struct Setup {
    unsigned type = 0;
    unsigned request = 0;
    unsigned value = 0;
    unsigned index = 0;
    unsigned length = 0;
  };
  /// A request; `then` goes out on bulk OUT in the moment it is answered.
  void ask(const Setup& setup, const Bytes& data = {}, const Bytes& then = {});
  void begin_session(std::uint32_t number, const Bytes& then = {});
  /// Again and again, whenever it was answered.
  void ask_for_ever(const Setup& setup) { for_ever_ = setup; }
  /// The host loses patience with its last request when the program has just seen it.
  void give_up_request_once_read() { gives_up_ = true; }
  [[nodiscard]] bool answered() const { return answered_; }
  [[nodiscard]] bool stalled() const { return stalled_; }
  [[nodiscard]] const Bytes& answer() const { return answer_; }
  /// Whole packets, the last one as long as it is, and one of length zero if `ends` and it was
  /// full.
  void send(std::span<const std::byte> bytes, bool ends);
  /// The next read that gets bytes fails.
  void fail_a_read(int error) { read_error_ = error; }
  /// What one transfer of 1024 bytes on bulk IN would have got; each once.
  [[nodiscard]] std::optional<Bytes> message();
  void stop_listening() { listens_ = false; }

  // The kernel.
  void refuse_reads(bool refuse) { refuses_reads_ = refuse; }
  void refuse_writes(bool refuse) { refuses_writes_ = refuse; }
  /// Happens when the program next looks for events, before it sees one.
  void before_next_event(std::function<void()> what) { before_event_ = std::move(what); }
  /// The last two ends of transfers are told the other way round.
  void swap_ends();
  [[nodiscard]] std::size_t reads_in_flight() const { return reads_.size(); }
  [[nodiscard]] std::size_t packets_waiting() const { return packets_.size(); }
  [[nodiscard]] int wakes() const { return wakes_; }

  void wait(engine::Duration /*timeout*/) override {}
  void wait_for_transfer(engine::Duration /*timeout*/) override {}
  void wake() noexcept override { ++wakes_; }
  Result read_control(std::span<std::byte> out) override;
  Result write_control(std::span<const std::byte> in) override;
  [[nodiscard]] bool read(std::size_t slot, std::span<std::byte> place) override;
  [[nodiscard]] bool write(std::span<const std::byte> bytes) override;
  [[nodiscard]] std::optional<Ended> next_ended() override;
  void cancel_reads() noexcept override { end_reads(-ECONNRESET); }
  void cancel_write() noexcept override;
  [[nodiscard]] std::size_t in_packet_bytes() override { return plugged_ ? packet_bytes_ : 0; }

 private:
  struct Read {
    std::size_t slot = 0;
    std::span<std::byte> place;
    std::size_t used = 0;
  };
  struct Event {
    unsigned type = 0;
    Setup setup;
  };
  enum class Pending { kNone, kRequest, kGivenUp };
  void put_event(const Event& event);
  void end_request(bool stalled);
  void fill_reads();
  void end_reads(Result result);

  bool plugged_ = false;
  std::size_t packet_bytes_ = 512;
  std::deque<Event> events_;
  Pending pending_ = Pending::kNone;
  Setup request_;
  std::optional<Setup> for_ever_;
  Bytes request_data_;
  Bytes then_;
  bool gives_up_ = false;
  bool answered_ = false;
  bool stalled_ = false;
  Bytes answer_;
  std::deque<Bytes> packets_;
  std::deque<Read> reads_;
  int read_error_ = 0;
  std::deque<Ended> ended_;
  bool listens_ = true;
  bool writing_ = false;
  Bytes in_hand_;  // of a message
  std::deque<Bytes> messages_;
  bool refuses_reads_ = false;
  bool refuses_writes_ = false;
  std::function<void()> before_event_;
  std::atomic<int> wakes_{0};
};
