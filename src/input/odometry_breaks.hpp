// Steps of an odometry that the scans contradict
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/finding.hpp"
#include "src/input/stamps.hpp"

namespace unimapper::input {

/// A step of the odometry that the robot did not make: it was started anew, it jumped, or it stood
/// still while the robot was moved, or may have been, as in a lift.
struct OdometryBreak {
  std::size_t last = 0;  ///< scan up to which poses and scans agree
  std::size_t next = 0;  ///< scan from which on they agree again; between the two no pose is right
  /// How far the given motion is from the one that the scans show.
  double off_m = 0.0;
  double off_deg = 0.0;
  bool is_elsewhere = false;  ///< no motion makes the scans agree: they show another place
  bool is_shut_in = false;    ///< between the two nothing but a closed cabin was seen
  bool is_slip = false;       ///< at no scan alone, but over several: it slipped or drifted
  bool is_frozen = false;     ///< one pose again and again while the scans move
};

/// What the scans say of all steps.
struct OdometryBreaks {
  std::vector<OdometryBreak> breaks;  ///< in order
  std::size_t compared = 0;           ///< pairs of scans, which cover every step
  std::size_t contradicted = 0;       ///< pairs of scans that contradict the odometry
  std::size_t steps_told = 0;         ///< steps between neighbours within pairs that show walls
};

/// Compares scans half a second, three metres or eight degrees apart, at most five, one after the
/// other, and both sides of every step that differs from those beside it. A step is contradicted if
/// another motion, 0.3 m or 3 degrees and five times the noise of roll and pitch away, makes the
/// scans agree better, or none does. So are two pairs in a row that agree a little better with one,
/// as behind wheels that slip. Scans from within a closed cabin say nothing of the odometry: a lift
/// moves along with the robot. Three seconds in one are a break, unless the odometry rose or sank
/// by two metres. The search ends where more than half of ten steps and more are contradicted.
/// `read` fills a scan; every fifth or so is read. About 0.4 ms for each.
[[nodiscard]] OdometryBreaks find_odometry_breaks(
    const Track& track, const std::function<void(std::size_t, datasets::Scan&)>& read);

/// Wrong where a quarter of the steps is contradicted, suspicious where any is.
[[nodiscard]] Finding check_odometry_breaks(const OdometryBreaks& found);

/// "between scan 44 and 45 (counted from 0) poses and scans differ by 2.00 m and 4.0 degrees".
[[nodiscard]] std::string describe(const OdometryBreak& odometry_break);

}  // namespace unimapper::input
