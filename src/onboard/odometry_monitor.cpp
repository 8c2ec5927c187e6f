#include "odometry_monitor.hpp"

#include <algorithm>
#include <numeric>

namespace unimapper::onboard {
namespace {

// Half as much again, and a twentieth of all cells more; twice that more needs no second keyframe
// (docs/design/plausibility.md#while-the-robot-drives).
constexpr std::uint32_t kMore = 50;

constexpr std::uint32_t raised_share(std::uint32_t usual) noexcept {
  return usual + usual / 2 + kMore;
}

}  // namespace

void OdometryMonitor::add(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept {
  share_ = static_cast<std::uint32_t>(std::uint64_t{1000} * dynamic_cells / std::max(cells, 1U));
  is_contradicted_ = false;
  // Of so few cells the share is chance.
  if (cells < kFewestCells) {
    raised_ = 0;
    return;
  }
  const std::uint32_t known = std::min(added_, kKeyframes);
  usual_ = std::accumulate(shares_.begin(), shares_.begin() + known, 0U) / std::max(known, 1U);
  if (known >= kFewest && share_ > raised_share(usual_)) {
    ++raised_;
    is_contradicted_ = raised_ > 1 || share_ > raised_share(usual_) + kMore;
    if (raised_ < kLongest) return;
    added_ = 0;
    is_contradicted_ = false;
  }
  raised_ = 0;
  shares_[added_ % kKeyframes] = share_;
  ++added_;
}

}  // namespace unimapper::onboard
