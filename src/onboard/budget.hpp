// Time budget of a keyframe
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Keeps a keyframe within `PipelineConfig::budget_us`: tracks what each part cost lately and
/// tells what still fits before the deadline. Its answers follow from the clock's readings alone.
///
/// What a part will cost is taken to be a quarter more than the most it cost lately: each keyframe
/// the maximum decays by an eighth, so that one outlier does not switch a part off for good.
/// Without a budget the clock is never read.
class Budget {
 public:
  /// The parts in the order in which they run.
  enum class Part : std::uint8_t {
    kFiltering,    ///< the evidence, per candidate cell
    kClassifying,  ///< everything between that and the finished cells
    kDescribing,   ///< keypoints and planes
    kSearching,    ///< loops
    kInserting,    ///< the place into the database
    kCounting      ///< labels for the statistics
  };
  static constexpr std::size_t kParts = 6;
  static constexpr float kFading = 7.0F / 8.0F;

  explicit Budget(const PipelineConfig& config) noexcept
      : clock_ns_(config.budget_us != 0 ? config.clock_ns : nullptr),
        budget_us_(static_cast<float>(config.budget_us)) {}

  [[nodiscard]] bool is_on() const noexcept { return clock_ns_ != nullptr; }

  /// From now on the time runs.
  void start() noexcept {
    if (!is_on()) return;
    start_ns_ = clock_ns_();
    slice_us_ *= kFading;
  }
  /// Microseconds since `start`.
  [[nodiscard]] float spent_us() const noexcept {
    return is_on() ? static_cast<float>(clock_ns_() - start_ns_) * 1e-3F : 0.0F;
  }
  /// Whether a call that took so long took too long.
  [[nodiscard]] bool is_missed_by(float call_us) const noexcept {
    return is_on() && call_us > budget_us_;
  }

  /// Whether a slice of deferred work of this cost fits. The unit is the caller's.
  [[nodiscard]] bool affords(std::uint32_t slice_cost) const noexcept;
  /// Does such a slice and notes how long it takes.
  template <typename Run>
  void measure_slice(std::uint32_t slice_cost, Run run) noexcept {
    if (!is_on()) return run();
    const std::int64_t begin_ns = clock_ns_();
    run();
    const float took_us = static_cast<float>(clock_ns_() - begin_ns) * 1e-3F;
    slice_us_ = std::max(slice_us_, took_us / static_cast<float>(std::max(slice_cost, 1U)));
  }

  /// Candidate cells that can be filtered so that the keyframe's cells are finished in time.
  [[nodiscard]] std::uint32_t affordable_cells() const noexcept;

  /// Whether describing, searching (with the inserting that follows it) or inserting fits. If not,
  /// the part's cost decays and it will be tried again.
  [[nodiscard]] bool affords(Part part) noexcept;

  /// Notes what `run` costs, spread over `units`.
  template <typename Run>
  void measure(Part part, std::uint32_t units, Run run) noexcept {
    if (!is_on()) return run();
    const std::int64_t begin_ns = clock_ns_();
    run();
    note(part, units, static_cast<float>(clock_ns_() - begin_ns) * 1e-3F);
  }

 private:
  void note(Part part, std::uint32_t units, float cost_us) noexcept;
  [[nodiscard]] float expected_us(Part part) const noexcept;
  float& lately_us(Part part) noexcept { return lately_us_[static_cast<std::size_t>(part)]; }

  std::int64_t (*clock_ns_)();
  float budget_us_;
  std::int64_t start_ns_ = 0;
  float slice_us_ = 0.0F;                  ///< the most one took lately, for its cost
  std::array<float, kParts> lately_us_{};  ///< per unit; 0 = not known yet
};

}  // namespace unimapper::onboard
