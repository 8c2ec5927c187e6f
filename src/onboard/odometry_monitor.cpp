#include "odometry_monitor.hpp"

#include <algorithm>
#include <numeric>

#include "src/core/cabin.hpp"

namespace unimapper::onboard {
namespace {

// Half as much again, and a twentieth of all cells more; twice that more needs no second keyframe
// (docs/design/plausibility.md#while-the-robot-drives).
constexpr std::uint32_t kMore = 50;

constexpr std::uint32_t raised_share(std::uint32_t usual) noexcept {
  return usual + usual / 2 + kMore;
}

}  // namespace

bool is_shut_in(std::span<const FineCell> static_cells,
                std::span<const FineCell> dynamic_cells) noexcept {
  CabinTest cabin(static_cells.size() + dynamic_cells.size());
  for (const std::span<const FineCell> cells : {static_cells, dynamic_cells}) {
    for (const FineCell& cell : cells) {
      if (!cabin.add(cell.position.x(), cell.position.y())) return false;
    }
  }
  return cabin.is_shut_in();
}

void OdometryMonitor::add_cabin(const KeyframeScan& scan) noexcept {
  const double height_m = scan.T_odometry_sensor.translation.z();
  Ride ride = ride_;
  if (ride.from_open && !ride.is_shut_in) {
    ride = {true, true, scan.stamp_ns, scan.stamp_ns, height_m, height_m};
  }
  ride.last_ns = scan.stamp_ns;
  ride.last_m = height_m;
  forget();
  ride_ = ride;
}

bool OdometryMonitor::Ride::is_unfelt() const noexcept {
  return is_shut_in &&
         is_unfelt_ride(static_cast<double>(last_ns - first_ns) * 1e-9, last_m - first_m);
}

void OdometryMonitor::add(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept {
  share_ = static_cast<std::uint32_t>(std::uint64_t{1000} * dynamic_cells / std::max(cells, 1U));
  is_contradicted_ = ride_.is_unfelt();
  ride_ = {.from_open = true};
  if (is_contradicted_) {
    share_ = 0;
    return;
  }
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
