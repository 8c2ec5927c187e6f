// Ranges of scans that are sessions of their own, where the odometry breaks.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "src/input/odometry_breaks.hpp"

namespace unimapper::apps {

/// Scans of a recording that one odometry places.
struct SessionRange {
  std::size_t first = 0;
  std::size_t end = 0;  ///< one past the last

  friend bool operator==(const SessionRange&, const SessionRange&) = default;
};

/// The first `scans` scans, cut where the odometry breaks. Pieces of fewer than `fewest` scans are
/// left out, unless nothing would be left.
[[nodiscard]] std::vector<SessionRange> session_ranges(
    const std::vector<input::OdometryBreak>& breaks, std::size_t scans, std::size_t fewest);

/// Name of the session of range number `index`: the run's, then NAME.2, NAME.3, ...
[[nodiscard]] std::string range_name(const std::string& run, std::size_t index);

}  // namespace unimapper::apps
