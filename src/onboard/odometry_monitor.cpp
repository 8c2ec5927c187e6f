#include "odometry_monitor.hpp"

#include <algorithm>
#include <numeric>

namespace unimapper::onboard {
namespace {

// Half as much again, and a twentieth of all cells more
// (docs/design/plausibility.md#while-the-robot-drives).
constexpr std::uint32_t contradicting_share(std::uint32_t usual) noexcept {
  return usual + usual / 2 + 50;
}

}  // namespace

void OdometryMonitor::add(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept {
  share_ = static_cast<std::uint32_t>(std::uint64_t{1000} * dynamic_cells / std::max(cells, 1U));
  // Of so few cells the share is chance.
  if (cells < kFewestCells) {
    contradicted_ = 0;
    return;
  }
  const std::uint32_t known = std::min(added_, kKeyframes);
  usual_ = std::accumulate(shares_.begin(), shares_.begin() + known, 0U) / std::max(known, 1U);
  if (known >= kFewest && share_ > contradicting_share(usual_)) {
    ++contradicted_;
    if (contradicted_ < kLongest) return;
    added_ = 0;
  }
  contradicted_ = 0;
  shares_[added_ % kKeyframes] = share_;
  ++added_;
}

}  // namespace unimapper::onboard
