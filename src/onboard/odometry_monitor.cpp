#include "odometry_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace unimapper::onboard {
namespace {

// Half as much again, and a twentieth of all cells more; twice that more needs no second keyframe
// (docs/design/plausibility.md#while-the-robot-drives).
constexpr std::uint32_t kMore = 50;

constexpr std::uint32_t raised_share(std::uint32_t usual) noexcept {
  return usual + usual / 2 + kMore;
}

// A lift's cabin is no larger; through a gap of its door a fiftieth of the cells may be seen.
constexpr float kCabin_m = 3.5F;
constexpr std::size_t kOneBeyondOf = 50;
// A lift takes longer for a storey, and a storey is higher: as `src/input/odometry_breaks.cpp` says
// of recordings.
constexpr std::int64_t kShutIn_ns = 3'000'000'000;
constexpr double kFelt_m = 1.0;

}  // namespace

bool is_shut_in(std::span<const FineCell> static_cells,
                std::span<const FineCell> dynamic_cells) noexcept {
  const std::size_t allowed = (static_cells.size() + dynamic_cells.size()) / kOneBeyondOf;
  std::size_t beyond = 0;
  for (const std::span<const FineCell> cells : {static_cells, dynamic_cells}) {
    for (const FineCell& cell : cells) {
      const bool is_far = cell.position.head<2>().squaredNorm() > kCabin_m * kCabin_m;
      if (is_far && ++beyond > allowed) return false;
    }
  }
  return true;
}

void OdometryMonitor::add_cabin(const KeyframeScan& scan) noexcept {
  const double height_m = scan.T_odometry_sensor.translation.z();
  const bool enters = !ride_.is_shut_in;
  const Ride ride{true, enters ? scan.stamp_ns : ride_.first_ns, scan.stamp_ns,
                  enters ? height_m : ride_.first_m, height_m};
  forget();
  ride_ = ride;
}

bool OdometryMonitor::Ride::is_unfelt() const noexcept {
  return is_shut_in && last_ns - first_ns >= kShutIn_ns && std::abs(last_m - first_m) < kFelt_m;
}

void OdometryMonitor::add(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept {
  share_ = static_cast<std::uint32_t>(std::uint64_t{1000} * dynamic_cells / std::max(cells, 1U));
  is_contradicted_ = ride_.is_unfelt();
  ride_ = {};
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
