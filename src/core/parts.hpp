// Loops cut into parts that several processors may share
#pragma once

#include <algorithm>
#include <cstdint>

#include "unimapper/core/executor.hpp"

namespace unimapper {

/// The elements from `first` on, those from `end` on excluded.
struct Slice {
  std::uint32_t first;
  std::uint32_t end;

  [[nodiscard]] constexpr std::uint32_t size() const noexcept { return end - first; }
};

/// Calls `work(part, worker)` once for each part below `parts`, in no order that may matter; on the
/// calling thread in their order where the executor has one worker.
template <typename Work>
void for_parts(const Executor& executor, std::uint32_t parts, const Work& work) noexcept {
  if (executor.workers == 1 || parts <= 1) {
    for (std::uint32_t part = 0; part < parts; ++part) work(part, std::uint32_t{0});
    return;
  }
  struct Task {
    const Work* work;
    static void run(void* task, std::uint32_t part, std::uint32_t worker) noexcept {
      (*static_cast<const Task*>(task)->work)(part, worker);
    }
  } task{&work};
  executor.run(executor.context, parts, Task::run, &task);
}

/// Elements cut into at most `kMost` parts of the same size, at least `least` but for the last one:
/// large enough that handing one out does not count, and enough of them that none is waited for.
/// One worker has one part.
class Cut {
 public:
  static constexpr std::uint32_t kMost = 64;

  Cut(const Executor& executor, Slice all, std::uint32_t least) noexcept
      : Cut(executor.workers > 1, all, least) {}
  Cut(bool is_shared, Slice all, std::uint32_t least) noexcept
      : all_(all),
        size_(std::max(is_shared ? (all.size() + kMost - 1) / kMost : all.size(), least)) {}

  [[nodiscard]] std::uint32_t parts() const noexcept { return (all_.size() + size_ - 1) / size_; }
  [[nodiscard]] Slice operator[](std::uint32_t part) const noexcept {
    const std::uint32_t first = all_.first + part * size_;
    return {first, first + std::min(size_, all_.end - first)};
  }

 private:
  Slice all_;
  std::uint32_t size_;
};

/// Calls `work(slice, worker)` for slices of at least `least` elements that make up all of them.
template <typename Work>
void for_slices(const Executor& executor, Slice all, std::uint32_t least,
                const Work& work) noexcept {
  const Cut cut(executor, all, least);
  for_parts(executor, cut.parts(),
            [&](std::uint32_t part, std::uint32_t worker) noexcept { work(cut[part], worker); });
}

/// Writes into `before`, by part, `first` and what `count(slice)` gives for all parts before it.
template <typename Count>
void count_before(const Executor& executor, const Cut& cut, std::uint32_t first,
                  std::uint32_t (&before)[Cut::kMost], const Count& count) noexcept {
  const std::uint32_t last = std::max(cut.parts(), 1U) - 1;
  for_parts(executor, last, [&](std::uint32_t part, std::uint32_t) noexcept {
    before[part + 1] = count(cut[part]);
  });
  before[0] = first;
  for (std::uint32_t part = 1; part <= last; ++part) before[part] += before[part - 1];
}

}  // namespace unimapper
