// Points with the wrong label, where a map has them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "src/apps/view/point_octree.hpp"
#include "src/evaluate/dynamic.hpp"
#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::apps {

/// Points of a map with the wrong label, map frame.
struct WrongPoints {
  ViewPoints false_static;   ///< dynamic by the truth, labelled static
  ViewPoints false_dynamic;  ///< static by the truth, labelled dynamic
};

/// Where a session's scans are in a map.
struct ScanPoses {
  std::span<const evaluate::StampedPose> truth;     ///< of every scan; the stamps count
  std::span<const evaluate::StampedPose> estimate;  ///< T_map_sensor; scans without have no place
  std::uint8_t session = 0;                         ///< `session_byte`
};

/// Labels of a session against the truth.
struct LabelErrors {
  evaluate::DynamicScore score;     ///< of all scans
  std::size_t scans = 0;            ///< of the recording
  std::size_t scans_placeless = 0;  ///< their wrong points are counted and not shown
};

/// Compares the labels of all scans, and adds one point of each voxel in which there are wrong
/// ones, apart by kind. Every scan is read once.
[[nodiscard]] LabelErrors collect_wrong_points(evaluate::ScanSource& source, const ScanPoses& poses,
                                               float voxel_m, WrongPoints& points);

}  // namespace unimapper::apps
