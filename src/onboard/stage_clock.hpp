// Timers of processing stages and time limits
#pragma once

#include <cstdint>

#include "unimapper/onboard/statistics.hpp"

namespace unimapper::onboard {

/// Adds the time between construction and destruction to a stage.
class StageTimer {
 public:
  StageTimer(std::int64_t (*clock_ns)(), KeyframeStatistics& statistics, Stage stage) noexcept
      : clock_ns_(clock_ns),
        statistics_(statistics),
        stage_(stage),
        start_ns_(clock_ns != nullptr ? clock_ns() : 0) {}
  ~StageTimer() {
    if (clock_ns_ == nullptr) return;
    statistics_.stage_us[static_cast<std::size_t>(stage_)] +=
        static_cast<float>(clock_ns_() - start_ns_) * 1e-3F;
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  std::int64_t (*clock_ns_)();
  KeyframeStatistics& statistics_;
  Stage stage_;
  std::int64_t start_ns_;
};

/// A time from its construction on; over at once if it is 0 or there is no clock.
class TimeLimit {
 public:
  TimeLimit(std::int64_t (*clock_ns)(), std::uint32_t limit_us) noexcept
      : clock_ns_(limit_us > 0 ? clock_ns : nullptr),
        end_ns_(clock_ns_ != nullptr ? clock_ns() + std::int64_t{1000} * limit_us : 0) {}
  [[nodiscard]] bool is_over() const noexcept {
    return clock_ns_ == nullptr || clock_ns_() >= end_ns_;
  }

 private:
  std::int64_t (*clock_ns_)();
  std::int64_t end_ns_;
};

}  // namespace unimapper::onboard
