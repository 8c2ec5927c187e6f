// Time budget of a call
#pragma once

#include <algorithm>
#include <cstdint>

#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Tells which slices of deferred work still fit into a call (`PipelineConfig::budget_us`). Its
/// answers follow from the clock's readings alone.
///
/// A slice is taken to cost a quarter more than the most that one took lately, for its cost: with
/// each call the maximum decays by an eighth. Without a budget the clock is never read.
class Budget {
 public:
  explicit Budget(const PipelineConfig& config) noexcept
      : clock_ns_(config.budget_us != 0 ? config.clock_ns : nullptr),
        budget_us_(static_cast<float>(config.budget_us)) {}

  /// From now on the time runs.
  void start() noexcept {
    constexpr float kFading = 7.0F / 8.0F;
    if (clock_ns_ == nullptr) return;
    start_ns_ = clock_ns_();
    slice_us_ *= kFading;
  }
  /// Microseconds since `start`; 0 without a budget.
  [[nodiscard]] float spent_us() const noexcept {
    return clock_ns_ != nullptr ? static_cast<float>(clock_ns_() - start_ns_) * 1e-3F : 0.0F;
  }
  /// Whether a call that took so long took too long.
  [[nodiscard]] bool is_missed_by(float call_us) const noexcept {
    return clock_ns_ != nullptr && call_us > budget_us_;
  }

  /// Whether a slice of this cost fits. The unit is the caller's.
  [[nodiscard]] bool affords(std::uint32_t slice_cost) const noexcept {
    constexpr float kReserve = 1.25F;
    return clock_ns_ == nullptr ||
           spent_us() + kReserve * slice_us_ * static_cast<float>(slice_cost) <= budget_us_;
  }
  /// Does such a slice and notes how long it takes.
  template <typename Run>
  void measure_slice(std::uint32_t slice_cost, Run run) noexcept {
    if (clock_ns_ == nullptr) return run();
    const std::int64_t begin_ns = clock_ns_();
    run();
    const float took_us = static_cast<float>(clock_ns_() - begin_ns) * 1e-3F;
    slice_us_ = std::max(slice_us_, took_us / static_cast<float>(std::max(slice_cost, 1U)));
  }

 private:
  std::int64_t (*clock_ns_)();
  float budget_us_;
  std::int64_t start_ns_ = 0;
  float slice_us_ = 0.0F;  ///< the most one took lately, for its cost
};

}  // namespace unimapper::onboard
