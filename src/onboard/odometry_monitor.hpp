// Change detection on the share of dynamic cells, for an odometry that breaks
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "unimapper/core/keyframe.hpp"

namespace unimapper::onboard {

/// Whether a keyframe's cells, in its frame, are those of a closed cabin (`CabinTest`), as in a
/// lift: what moves along with the robot says nothing of the odometry. O(cells).
[[nodiscard]] bool is_shut_in(std::span<const FineCell> static_cells,
                              std::span<const FineCell> dynamic_cells) noexcept;

/// Tells that scans contradict the odometry while the robot drives. Behind a step that the robot
/// did not make, what is static lies where earlier keyframes saw through, and the share of cells
/// that are labelled dynamic leaps from one keyframe to the next. A lift may have moved the robot
/// by storeys where the odometry says that it did not rise
/// (docs/design/plausibility.md#while-the-robot-drives).
class OdometryMonitor {
 public:
  /// Of the keyframe that closes; `height_m` is that of the sensor by the odometry. O(1).
  void add(std::uint32_t dynamic_cells, std::uint32_t cells, double height_m) noexcept;
  /// Of a keyframe that closes and is shut in (`is_shut_in`); `scan` is one of its scans. Until the
  /// robot has driven in there, it may be a cabin, and nothing is concluded. O(1).
  void add_shut_in(const KeyframeScan& scan, std::uint32_t dynamic_cells,
                   std::uint32_t cells) noexcept;
  /// Nothing before the next keyframe counts.
  void forget() noexcept { *this = {}; }

  /// The share of the last two keyframes is above what is usual, or that of the last one far above,
  /// or the keyframe is the first behind a ride in a cabin that did not rise (`is_unfelt_ride`).
  [[nodiscard]] bool is_contradicted() const noexcept { return is_contradicted_; }
  /// Share of the last keyframe, thousandths, and the mean of those before; 0 without any, and both
  /// behind a cabin.
  [[nodiscard]] std::uint32_t share() const noexcept { return share_; }
  [[nodiscard]] std::uint32_t usual_share() const noexcept { return usual_; }

 private:
  static constexpr std::uint32_t kKeyframes = 8;  ///< whose mean is what is usual
  static constexpr std::uint32_t kFewest = 3;     ///< fewest keyframes whose mean is what is usual
  /// After so many keyframes in a row, as the window of evidence holds, what is usual is asked
  /// anew.
  static constexpr std::uint32_t kLongest = 10;
  static constexpr std::uint32_t kFewestCells = 500;  ///< of fewer the share is chance

  /// Keyframes in a row that are shut in.
  struct Stay {
    bool from_open = false;  ///< behind one that is not
    double open_m = 0.0;     ///< height of the sensor there
    bool is_shut_in = false;
    bool is_room = false;  ///< since the robot drove there
    std::int64_t first_ns = 0;
    std::int64_t last_ns = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();  ///< position of the sensor, metres
  };

  /// The share with those before.
  void compare(std::uint32_t dynamic_cells, std::uint32_t cells) noexcept;

  std::array<std::uint32_t, kKeyframes> shares_{};  ///< ring
  std::uint32_t added_ = 0;                         ///< keyframes in it since the start
  std::uint32_t share_ = 0;
  std::uint32_t usual_ = 0;
  std::uint32_t raised_ = 0;  ///< keyframes in a row whose share is above what is usual
  bool is_contradicted_ = false;
  Stay stay_;
};

}  // namespace unimapper::onboard
