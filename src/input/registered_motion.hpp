// Choice and registration of pairs of scans that show how the sensor moved
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "ports/datasets/dataset.hpp"
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

/// Registers up to forty pairs of scans where the sensor moves far, turns or changes its speed, and
/// keeps what can be trusted: scans that agree well, and no tunnels. `skips(i, j)`: no pose between
/// these is right. `read` fills a scan. About 5 ms a pair.
[[nodiscard]] std::vector<RegisteredMotion> register_motions(
    const Track& track, const std::function<bool(std::size_t, std::size_t)>& skips,
    const std::function<void(std::size_t, datasets::Scan&)>& read);

/// Motions of a first look.
struct QuickMotions {
  std::vector<RegisteredMotion> motions;
  AgreementFigures agreement;
  std::size_t pairs = 0;  ///< in which the robot moves; some may say nothing
};

/// Registers the pairs of every second part of the track, and says how well they agree.
[[nodiscard]] QuickMotions register_some_motions(
    const Track& track, const std::function<void(std::size_t, datasets::Scan&)>& read);

}  // namespace unimapper::input
