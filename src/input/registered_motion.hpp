// Choice and registration of pairs of scans that show how the sensor moved
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/agreement.hpp"
#include "src/input/motion_check.hpp"
#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Motion between two scans, as their registration found it.
struct RegisteredMotion {
  std::int64_t first_ns = 0;   ///< stamps of the scans
  std::int64_t second_ns = 0;  ///< later
  Pose T_first_second;
};

/// Motions of a first look.
struct QuickMotions {
  std::vector<RegisteredMotion> motions;
  AgreementFigures agreement;
  std::size_t pairs = 0;  ///< in which the robot moves; some may say nothing
};

/// Registers up to forty pairs of scans where the sensor moves far, turns or changes its speed, and
/// keeps what can be trusted: scans that agree well, and no tunnels. About 5 ms a pair, once.
class MotionRegistration {
 public:
  /// `track` must outlive it; `read` fills a scan.
  MotionRegistration(const Track& track, std::function<void(std::size_t, datasets::Scan&)> read)
      : track_(track), read_(std::move(read)) {}

  /// `skips(i, j)`: no pose between these is right.
  [[nodiscard]] std::vector<RegisteredMotion> all(
      const std::function<bool(std::size_t, std::size_t)>& skips);

  /// Those of every second part of the track, and how well they agree.
  [[nodiscard]] QuickMotions some();

 private:
  struct Compared {
    bool is_told = false;  ///< both scans show walls
    Pose T_first_second;
    double condition = 0.0;
    Agreements agreements;
  };

  QuickMotions register_parts(const std::function<bool(std::size_t, std::size_t)>& skips,
                              std::size_t every);
  const Compared& compared(std::size_t i, std::size_t j);
  const std::shared_ptr<const ScanShape>& shape(std::size_t i);

  const Track& track_;
  std::function<void(std::size_t, datasets::Scan&)> read_;
  datasets::Scan scan_;
  // Pairs share scans in short recordings; they are in the order of their first one.
  std::map<std::size_t, std::shared_ptr<const ScanShape>> shapes_;
  std::map<std::pair<std::size_t, std::size_t>, Compared> compared_;
};

}  // namespace unimapper::input
