#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace engine {

/// A fixed set of threads that share rows of work. `rows` allocates nothing and returns when all
/// rows are done. Which thread does which row is chance: rows must not depend on each other, and
/// what a row draws must depend on its own place only.
/// Thread: loop. Loop-safe: yes, but for the constructor.
class WorkerPool {
 public:
  /// `threads` counts the caller too. Pre: >= 1.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  [[nodiscard]] int threads() const noexcept { return static_cast<int>(workers_.size()) + 1; }

  /// Calls `work(row)` once for each row in [begin, end). `work` must not throw.
  template <class Work>
  void rows(int begin, int end, const Work& work) noexcept {
    run(begin, end, &work,
        [](const void* w, int row) noexcept { (*static_cast<const Work*>(w))(row); });
  }

 private:
  using Call = void (*)(const void*, int) noexcept;

  void run(int begin, int end, const void* work, Call call) noexcept;
  void take_rows() noexcept;
  void serve(const std::stop_token& stop) noexcept;
  void dismiss() noexcept;

  // Written by the caller before `round_` is raised, read by the workers after.
  const void* work_ = nullptr;
  Call call_ = nullptr;
  int end_ = 0;

  std::atomic<int> next_{0};
  std::atomic<int> busy_{0};  ///< workers that have not finished this round
  std::atomic<std::uint32_t> round_{0};
  std::vector<std::jthread> workers_;  ///< last: its threads use all of the above
};

}  // namespace engine
