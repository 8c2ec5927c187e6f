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

void OdometryMonitor::add_shut_in(const KeyframeScan& scan, std::uint32_t dynamic_cells,
                                  std::uint32_t cells) noexcept {
  const Eigen::Vector3d& position = scan.T_odometry_sensor.translation;
  if (!stay_.is_shut_in) {
    stay_.is_shut_in = true;
    stay_.first_ns = scan.stamp_ns;
    stay_.first = position;
  }
  stay_.last_ns = scan.stamp_ns;
  stay_.is_room = stay_.is_room || is_in_room((position - stay_.first).head<2>().norm());
  if (stay_.is_room) {
    compare(dynamic_cells, cells);
    return;
  }
  is_contradicted_ = false;
  raised_ = 0;
  share_ = 0;
  usual_ = 0;
}

void OdometryMonitor::add(std::uint32_t dynamic_cells, std::uint32_t cells,
                          double height_m) noexcept {
  const Stay stay = stay_;
  const double lasts_s = static_cast<double>(stay.last_ns - stay.first_ns) * 1e-9;
  if (stay.is_shut_in && !stay.is_room && is_ride(lasts_s)) forget();
  stay_ = {.from_open = true, .open_m = height_m};
  const double rise_m = height_m - stay.open_m;
  if (stay.from_open && stay.is_shut_in && !stay.is_room && is_unfelt_ride(lasts_s, rise_m)) {
    is_contradicted_ = true;
    return;
  }
  compare(dynamic_cells, cells);
}

void OdometryMonitor::compare(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept {
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
