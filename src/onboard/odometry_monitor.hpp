// Change detection on the share of dynamic cells, for an odometry that breaks
#pragma once

#include <array>
#include <cstdint>

namespace unimapper::onboard {

/// Tells that scans contradict the odometry while the robot drives. Behind a step that the robot
/// did not make, what is static lies where earlier keyframes saw through, and the share of cells
/// that are labelled dynamic leaps from one keyframe to the next
/// (docs/design/plausibility.md#while-the-robot-drives).
class OdometryMonitor {
 public:
  /// Of the keyframe that closes. O(1).
  void add(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept;
  /// Nothing before the next keyframe counts.
  void forget() noexcept { *this = {}; }

  /// The share of the last two keyframes is above what is usual, or that of the last one far above.
  [[nodiscard]] bool is_contradicted() const noexcept { return is_contradicted_; }
  /// Share of the last keyframe, thousandths, and the mean of those before; 0 without any.
  [[nodiscard]] std::uint32_t share() const noexcept { return share_; }
  [[nodiscard]] std::uint32_t usual_share() const noexcept { return usual_; }

 private:
  static constexpr std::uint32_t kKeyframes = 8;  ///< whose mean is what is usual
  static constexpr std::uint32_t kFewest = 3;     ///< fewest keyframes whose mean is what is usual
  /// After so many keyframes in a row, as the window of evidence holds, what is usual is asked
  /// anew.
  static constexpr std::uint32_t kLongest = 10;
  static constexpr std::uint32_t kFewestCells = 500;  ///< of fewer the share is chance

  std::array<std::uint32_t, kKeyframes> shares_{};  ///< ring
  std::uint32_t added_ = 0;                         ///< keyframes in it since the start
  std::uint32_t share_ = 0;
  std::uint32_t usual_ = 0;
  std::uint32_t raised_ = 0;  ///< keyframes in a row whose share is above what is usual
  bool is_contradicted_ = false;
};

}  // namespace unimapper::onboard
