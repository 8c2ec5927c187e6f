// Findings of the checks on synthetic recordings
#pragma once

#include <Eigen/Core>
#include <string>

#include "src/input/plausibility.hpp"
#include "tests/input/courtyard.hpp"

namespace unimapper::input {

/// What is not fine, as "severity check: message" lines.
inline std::string unusual(const Plausibility& found) {
  std::string text;
  for (const Finding& finding : found.findings) {
    if (finding.severity == Severity::kFine) continue;
    text += std::string(severity_name(finding.severity)) + " " + finding.check + ": " +
            finding.message + "\n";
  }
  return text;
}

inline std::string examined(const MemoryDataset& recording) {
  return unusual(examine(recording, recording.scan_count()));
}

template <typename Change>
MemoryDataset with_poses(MemoryDataset recording, const Change& change) {
  for (Pose& pose : recording.poses) pose = change(pose);
  return recording;
}

inline const MemoryDataset& drive() {
  static const MemoryDataset kDrive = courtyard_drive();
  return kDrive;
}

/// For what is not about the motion: few pairs of scans to compare.
inline const MemoryDataset& short_drive() {
  static const MemoryDataset kDrive = courtyard_drive(5);
  return kDrive;
}

/// Axes of a camera: x right, y down, z ahead.
inline const Eigen::Matrix3d kCamera =
    (Eigen::Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();

inline Pose in_axes(const Pose& pose, const Eigen::Matrix3d& axes) {
  return {Eigen::Matrix3d(axes * pose.rotation * axes.transpose()),
          Eigen::Vector3d(axes * pose.translation)};
}

}  // namespace unimapper::input
