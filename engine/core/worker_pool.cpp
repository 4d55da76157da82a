#include "engine/core/worker_pool.h"

#include "engine/core/contract.h"

namespace engine {

WorkerPool::WorkerPool(int threads) {
  ENSURE(threads >= 1);
  workers_.reserve(static_cast<std::size_t>(threads - 1));
  try {
    for (int i = 1; i < threads; ++i)
      workers_.emplace_back([this](const std::stop_token& stop) { serve(stop); });
  } catch (...) {  // no thread left in the system: those that there are must not wait for work
    dismiss();
    throw;
  }
}

WorkerPool::~WorkerPool() { dismiss(); }

void WorkerPool::dismiss() noexcept {
  for (auto& worker : workers_) worker.request_stop();
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
}

void WorkerPool::run(int begin, int end, const void* work, Call call) noexcept {
  if (end <= begin) return;
  work_ = work;
  call_ = call;
  end_ = end;
  next_.store(begin, std::memory_order_relaxed);
  busy_.store(static_cast<int>(workers_.size()), std::memory_order_relaxed);
  // Release: the workers see the four lines above once they see the new round.
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  take_rows();
  for (int busy = busy_.load(std::memory_order_acquire); busy != 0;
       busy = busy_.load(std::memory_order_acquire)) {
    busy_.wait(busy, std::memory_order_acquire);
  }
}

void WorkerPool::take_rows() noexcept {
  for (int row = next_.fetch_add(1, std::memory_order_relaxed); row < end_;
       row = next_.fetch_add(1, std::memory_order_relaxed)) {
    call_(work_, row);
  }
}

void WorkerPool::serve(const std::stop_token& stop) noexcept {
  std::uint32_t seen = 0;
  for (;;) {
    round_.wait(seen, std::memory_order_acquire);
    seen = round_.load(std::memory_order_acquire);
    if (stop.stop_requested()) return;
    take_rows();
    // Release: the caller sees this worker's rows once it sees the count fall.
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
  }
}

}  // namespace engine
