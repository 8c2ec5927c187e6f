#include "unimapper/onboard/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unimapper {
namespace {

constexpr float kNearest_m = 0.5F;  // nearer are the robot itself and returns that are none
constexpr std::size_t kBinsPerMetre = 4;
constexpr std::size_t kBins = 512;  // the last one counts what is farther, too
constexpr std::uint32_t kFewestPoints = 1000;

/// Ranges and directions of one scan's points.
struct Histogram {
  std::array<std::uint32_t, kBins> ranges{};
  std::array<std::uint32_t, 8> directions{};
  std::uint32_t points = 0;

  void add(const Eigen::Vector3f& p) noexcept {
    const float squared = p.squaredNorm();
    // False where it is not finite.
    if (!(squared >= kNearest_m * kNearest_m && squared <= std::numeric_limits<float>::max()))
      return;
    const float bin = std::sqrt(squared) * static_cast<float>(kBinsPerMetre);
    ++ranges[static_cast<std::size_t>(std::min(bin, static_cast<float>(kBins - 1)))];
    const unsigned eighth = (p.x() > 0.0F ? 1U : 0U) | (p.y() > 0.0F ? 2U : 0U) |
                            (std::fabs(p.x()) > std::fabs(p.y()) ? 4U : 0U);
    ++directions[eighth];
    ++points;
  }

  /// The range that 99 % of the points do not exceed.
  [[nodiscard]] float extent_m() const noexcept {
    std::uint64_t within = 0;
    std::size_t bin = 0;
    while (100 * within < 99 * std::uint64_t{points}) within += ranges[bin++];
    return static_cast<float>(bin) / static_cast<float>(kBinsPerMetre);
  }

  [[nodiscard]] bool sees_all_round() const noexcept {
    return std::all_of(directions.begin(), directions.end(), [this](std::uint32_t count) {
      return 100 * std::uint64_t{count} >= points;
    });
  }
};

}  // namespace

void SurroundingsEstimator::add(const PointView& points) noexcept {
  Histogram histogram;
  for (std::size_t i = 0; i < points.count; ++i) histogram.add(points[i]);
  if (histogram.points < kFewestPoints) return;
  ++estimate_.scans;
  estimate_.extent_m = std::max(estimate_.extent_m, histogram.extent_m());
  estimate_.sees_all_round = estimate_.sees_all_round && histogram.sees_all_round();
  const bool indoors = estimate_.sees_all_round && estimate_.extent_m <= kIndoorsWithinM;
  estimate_.surroundings = indoors ? Surroundings::kIndoors : Surroundings::kOutdoors;
}

SurroundingsEstimate SurroundingsEstimator::estimate() const noexcept { return estimate_; }

}  // namespace unimapper
