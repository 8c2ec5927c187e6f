#include "standing.hpp"

#include <algorithm>

#include "src/core/popcount.hpp"

namespace unimapper::onboard {
namespace {

// Half a cell, and what moves a point by that 6 m away.
constexpr double kMovedM = 0.1;
constexpr double kCosineTurned = 0.99985;  // of a degree
// Blocks of 0.8 m whose obstacles are new for the most part, and their new cells at least: noise of
// the range adds single cells to surfaces that are known (docs/using.md#while-the-robot-stands).
constexpr std::uint32_t kFewestBlocks = 3;
constexpr std::uint32_t kFewestNew = 5;

bool is_near(const Pose& a, const Pose& b) noexcept {
  // The trace of a rotation by an angle is 1 + 2 cos(angle).
  const double trace = (a.rotation.transpose() * b.rotation).trace();
  return (a.translation - b.translation).squaredNorm() <= kMovedM * kMovedM &&
         trace >= 1.0 + 2.0 * kCosineTurned;
}

/// Whether static obstacles stand where no keyframe of the window had any.
bool shows_new(const BlockWindow& window, const CellTable& cells) noexcept {
  std::uint32_t changed = 0;
  for (std::uint32_t b = 0; b < cells.blocks().size(); ++b) {
    const CellMarks& marks = cells.marks(b);
    const std::uint64_t obstacles = cells.blocks()[b].occupied & ~marks.ground & ~marks.dynamic;
    if (popcount(obstacles) < kFewestNew) continue;
    std::uint64_t before = 0;
    for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
      before |= window.occupied(b, age);
    }
    const std::uint32_t added = popcount(obstacles & ~before);
    changed += added >= kFewestNew && 2 * added > popcount(obstacles) ? 1 : 0;
  }
  return changed >= kFewestBlocks;
}

}  // namespace

void Standing::close(std::span<const KeyframeScan> scans) noexcept {
  stands_ = kept_ > 0 && std::all_of(scans.begin(), scans.end(), [&](const KeyframeScan& scan) {
              return is_near(T_odometry_sensor_, scan.T_odometry_sensor);
            });
  if (stands_) return;
  kept_ = 0;
  T_odometry_sensor_ = scans.back().T_odometry_sensor;
}

bool Standing::repeats(const BlockWindow& window, const CellTable& cells) noexcept {
  // Half a window of evidence outweighs what stood there before.
  if (stands_ && shows_new(window, cells)) kept_ = std::min(kept_, window_ / 2);
  if (kept_ >= window_) return true;
  ++kept_;
  return false;
}

}  // namespace unimapper::onboard
