#include "tests/support/function_fs_model.h"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <linux/usb/functionfs.h>

#include "drivers/little_endian.h"

void FunctionFsModel::plug(std::size_t packet_bytes) {
  plugged_ = true;
  packet_bytes_ = packet_bytes;
  put_event({FUNCTIONFS_ENABLE, {}});
}

void FunctionFsModel::unplug() {
  plugged_ = false;
  packets_.clear();
  in_hand_.clear();
  end_reads(-ESHUTDOWN);
  if (std::exchange(writing_, false)) ended_.push_back({false, 0, -ESHUTDOWN});
  put_event({FUNCTIONFS_DISABLE, {}});
}

void FunctionFsModel::put_event(const Event& event) {
  if (pending_ == Pending::kRequest) pending_ = Pending::kGivenUp;
  std::erase_if(events_, [&](const Event& e) {
    return event.type == FUNCTIONFS_SETUP ? e.type == FUNCTIONFS_SETUP
                                          : e.type != FUNCTIONFS_SUSPEND;
  });
  events_.push_back(event);
}

void FunctionFsModel::ask(const Setup& setup, const Bytes& data, const Bytes& then) {
  answered_ = stalled_ = false;
  answer_.clear();
  request_data_ = data;
  then_ = then;
  put_event({FUNCTIONFS_SETUP, setup});
}

void FunctionFsModel::begin_session(std::uint32_t number, const Bytes& then) {
  Bytes data(sizeof number);
  drivers::put(data, 0, number);
  ask({0x41, 2, 0, 0, 4}, data, then);
}

void FunctionFsModel::end_request(bool stalled) {
  pending_ = Pending::kNone;
  (stalled ? stalled_ : answered_) = true;
  if (!stalled && !then_.empty()) send(std::exchange(then_, {}), true);
}

FunctionFsModel::Result FunctionFsModel::read_control(std::span<std::byte> out) {
  if (before_event_) std::exchange(before_event_, nullptr)();
  if (pending_ == Pending::kGivenUp) {
    pending_ = Pending::kNone;
    return -EIDRM;
  }
  if (pending_ == Pending::kRequest) {
    if ((request_.type & 0x80U) != 0) {
      end_request(true);
      return -EL2HLT;
    }
    const std::size_t n =
        std::min({out.size(), request_data_.size(), std::size_t{request_.length}});
    std::copy_n(request_data_.begin(), n, out.begin());
    end_request(false);
    return static_cast<Result>(n);
  }
  if (events_.empty() && for_ever_) ask(*for_ever_);
  if (events_.empty()) return -EAGAIN;
  const Event event = events_.front();
  events_.pop_front();
  std::array<std::byte, 12> bytes{};
  if (event.type == FUNCTIONFS_SETUP) {
    request_ = event.setup;
    pending_ = std::exchange(gives_up_, false) ? Pending::kGivenUp : Pending::kRequest;
    drivers::put(bytes, 0, static_cast<std::uint8_t>(request_.type));
    drivers::put(bytes, 1, static_cast<std::uint8_t>(request_.request));
    drivers::put(bytes, 2, static_cast<std::uint16_t>(request_.value));
    drivers::put(bytes, 4, static_cast<std::uint16_t>(request_.index));
    drivers::put(bytes, 6, static_cast<std::uint16_t>(request_.length));
  }
  drivers::put(bytes, 8, static_cast<std::uint8_t>(event.type));
  std::copy(bytes.begin(), bytes.end(), out.begin());
  return static_cast<Result>(bytes.size());
}

FunctionFsModel::Result FunctionFsModel::write_control(std::span<const std::byte> in) {
  if (const Pending p = std::exchange(pending_, Pending::kNone); p != Pending::kRequest)
    return p == Pending::kGivenUp ? -EIDRM : -EINVAL;
  if ((request_.type & 0x80U) == 0) {
    end_request(true);
    return -EL2HLT;
  }
  answer_.assign(in.begin(), in.end());
  end_request(false);
  return static_cast<Result>(in.size());
}

void FunctionFsModel::send(std::span<const std::byte> bytes, bool ends) {
  while (bytes.size() >= packet_bytes_) {
    packets_.emplace_back(bytes.begin(),
                          bytes.begin() + static_cast<std::ptrdiff_t>(packet_bytes_));
    bytes = bytes.subspan(packet_bytes_);
  }
  if (ends || !bytes.empty()) packets_.emplace_back(bytes.begin(), bytes.end());
  fill_reads();
}

void FunctionFsModel::fill_reads() {
  while (!packets_.empty() && !reads_.empty()) {
    const Bytes packet = std::move(packets_.front());
    packets_.pop_front();
    Read& r = reads_.front();
    std::copy(packet.begin(), packet.end(), r.place.begin() + static_cast<std::ptrdiff_t>(r.used));
    r.used += packet.size();
    const int error = std::exchange(read_error_, 0);
    if (error == 0 && packet.size() == packet_bytes_ && r.used < r.place.size()) continue;
    ended_.push_back({true, r.slot, error != 0 ? -error : static_cast<Result>(r.used)});
    reads_.pop_front();
  }
}

void FunctionFsModel::end_reads(Result result) {
  for (const Read& r : reads_) {
    // What was there is nobody's any more.
    std::fill(r.place.begin(), r.place.end(), std::byte{0xEE});
    ended_.push_back({true, r.slot, result});
  }
  reads_.clear();
}

bool FunctionFsModel::read(std::size_t slot, std::span<std::byte> place) {
  if (refuses_reads_) return false;
  if (!plugged_) {
    ended_.push_back({true, slot, -EAGAIN});
    return true;
  }
  reads_.push_back({slot, place, 0});
  fill_reads();
  return true;
}

bool FunctionFsModel::write(std::span<const std::byte> bytes) {
  if (refuses_writes_) return false;
  if (!plugged_) {
    ended_.push_back({false, 0, -EAGAIN});
    return true;
  }
  if (!listens_) {
    writing_ = true;
    return true;
  }
  in_hand_.insert(in_hand_.end(), bytes.begin(), bytes.end());
  if (bytes.size() % packet_bytes_ != 0 || bytes.empty())
    messages_.push_back(std::exchange(in_hand_, {}));
  ended_.push_back({false, 0, static_cast<Result>(bytes.size())});
  return true;
}

void FunctionFsModel::cancel_write() noexcept {
  if (std::exchange(writing_, false)) ended_.push_back({false, 0, -ECONNRESET});
}

std::optional<drivers::FunctionFiles::Ended> FunctionFsModel::next_ended() {
  if (ended_.empty()) return std::nullopt;
  const Ended first = ended_.front();
  ended_.pop_front();
  return first;
}

void FunctionFsModel::swap_ends() {
  if (ended_.size() >= 2) std::swap(ended_[ended_.size() - 1], ended_[ended_.size() - 2]);
}

std::optional<FunctionFsModel::Bytes> FunctionFsModel::message() {
  if (messages_.empty()) return std::nullopt;
  Bytes first = std::move(messages_.front());
  messages_.pop_front();
  return first;
}
