// Executor that runs parts in random order
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "unimapper/core/executor.hpp"

namespace unimapper::test {

/// Runs parts on the calling thread, in random order and as random workers: what depends on either
/// is found without threads, every time.
class Shuffled {
 public:
  Shuffled(std::uint32_t workers, std::uint32_t seed) : workers_(workers), state_(seed) {}

  [[nodiscard]] Executor executor() { return {run, this, workers_}; }
  [[nodiscard]] std::uint32_t most_parts() const { return most_parts_; }

 private:
  static void run(void* context, std::uint32_t parts, Executor::Part part, void* task) {
    auto& self = *static_cast<Shuffled*>(context);
    self.most_parts_ = std::max(self.most_parts_, parts);
    std::vector<std::uint32_t> order(parts);
    std::iota(order.begin(), order.end(), 0U);
    for (std::uint32_t left = parts; left > 1; --left) {
      std::swap(order[left - 1], order[self.next(left)]);
    }
    for (const std::uint32_t i : order) part(task, i, self.next(self.workers_));
  }

  std::uint32_t next(std::uint32_t below) {
    state_ = state_ * 1664525U + 1013904223U;
    return (state_ >> 16U) % below;
  }

  std::uint32_t workers_;
  std::uint32_t state_;
  std::uint32_t most_parts_ = 0;
};

}  // namespace unimapper::test
