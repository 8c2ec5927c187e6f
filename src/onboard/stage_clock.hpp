// Timer of processing stages
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

}  // namespace unimapper::onboard
