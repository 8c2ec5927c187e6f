// Keyframe from its first scan on, with everything that its view points to
#pragma once

#include <cstddef>
#include <cstdint>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/pipeline.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::onboard {

/// Where a scan was taken, and which one it is.
struct ScanOrigin {
  std::uint32_t index;  ///< running number
  std::int64_t stamp_ns;
  Pose T_odometry_sensor;
  SlipCovariance slip = SlipCovariance::Zero();  ///< since the scan before
};

/// What is known of a keyframe. Cells and pixels lie elsewhere.
struct Keyframe {
  KeyframeScan scans[KeyframeConfig::kMaxScans];
  FreeSpaceImage images[FreeSpaceConfig::kMaxImages];
  KeyframeStatistics statistics;
  KeyframeView view;              ///< written when the keyframe closes, its place when it is known
  bool sampling_changed = false;  ///< what is known of the sensor has; to be reported
  float spent_us = 0.0F;          ///< by the call that closed it, if there is a budget

  [[nodiscard]] std::uint64_t& dropped(DropCause cause) noexcept {
    return statistics.dropped[static_cast<std::size_t>(cause)];
  }
  void use(Capacity which, std::uint64_t used, std::uint64_t capacity) noexcept {
    statistics.capacity[static_cast<std::size_t>(which)] = {used, capacity};
  }
};

}  // namespace unimapper::onboard
