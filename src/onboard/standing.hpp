// Stationarity of the robot, and of what it sees
#pragma once

#include <cstdint>
#include <span>

#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/removal/block_window.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {

/// Finds keyframes that repeat earlier ones: a robot that stands would fill disks, links and maps
/// with them (docs/using.md#while-the-robot-stands).
class Standing {
 public:
  /// As many keyframes as the window holds are kept of what the robot sees where it stands.
  explicit Standing(std::uint32_t window) noexcept : window_(window) {}

  /// The keyframe that closes, of these scans, one at least. O(scans).
  void close(std::span<const KeyframeScan> scans) noexcept;
  /// Whether it repeats earlier ones, by its cells, all of which are labelled, or else is kept.
  /// O(blocks x window) where the robot stands, else O(1).
  [[nodiscard]] bool repeats(const BlockWindow& window, const CellTable& cells) noexcept;
  /// False if it does not, whatever its cells are. O(1).
  [[nodiscard]] bool may_repeat() const noexcept { return kept_ >= window_; }
  /// Nothing before the next keyframe counts.
  void forget() noexcept { kept_ = 0; }

 private:
  std::uint32_t window_;
  bool stands_ = false;     ///< where it stood before
  std::uint32_t kept_ = 0;  ///< keyframes since it stands, or since what it sees changed
  Pose T_odometry_sensor_;  ///< where it came to stand
};

}  // namespace unimapper::onboard
