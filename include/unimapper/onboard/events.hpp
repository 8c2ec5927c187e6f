// Events that a pipeline writes into its ring (`PipelineConfig::events`)
#pragma once

#include <cstdint>

namespace unimapper {

/// Ids never change their meaning; new ones are added at the end, 5 stays free. Values are in the
/// order given.
enum class EventId : std::uint32_t {
  kKeyframeClosed = 1,  ///< sequence, scans, static cells, dynamic cells
  kScanRefused = 2,     ///< `ErrorCode`, scan index
  kPoseJump = 3,        ///< scan index
  kDropped = 4,         ///< `DropCause`, count, sequence of the keyframe
  kDeadlineMissed = 6,  ///< microseconds taken, budget, sequence of the keyframe
  /// The scene contradicts the odometry's promise (`odometry.up_sigma_deg`), reported when that
  /// begins: tilt of the odometry's z axis and the promised sigma in 1/1000 degree, sequence.
  kUpContradicted = 7,
  /// The sensor is not sampled as configured, or has changed its mode: thousandths of a degree
  /// between rays of a ring and from ring to ring, measured; the same as configured.
  kSamplingDiffers = 8,
  /// The rays leave the configured field of view: elevations of the range images now, thousandths
  /// of a degree, lowest and highest; the same as configured.
  kElevationsDiffer = 9,
  kAttitudeNoise = 10,  ///< thousandths of a degree, scans aligned, sequence of the keyframe
  /// Scans tilt with the sensor's rotation, reported when that begins: by how many thousandths of a
  /// degree, scans aligned, sequence of the keyframe.
  kSweepsUncompensated = 11,
  /// The scans contradict the odometry, reported when that begins: thousandths of the keyframe's
  /// cells that are dynamic, the same as usual, sequence of the keyframe. Both are 0 where the
  /// robot was shut in, as in a lift, and the odometry did not rise.
  kOdometryContradicted = 12,
  /// The scans move as if the LiDAR were mounted otherwise than the poses say, reported when that
  /// begins: which of roll, pitch, yaw, x, y, z (0 to 5), by how much, standard deviation (both
  /// thousandths of a degree or millimetres), sequence of the keyframe.
  kMountContradicted = 13,
  /// The poses are late (positive) or early against the scans, reported when that begins: by how
  /// many milliseconds, standard deviation, sequence of the keyframe.
  kClockContradicted = 14,
  /// The given motions are shorter (positive) or longer than the scans show, reported when that
  /// begins: by how many thousandths, standard deviation, sequence of the keyframe.
  kScaleContradicted = 15,
  /// The scans move otherwise than the poses say, and neither mount nor delay explains it, reported
  /// when that begins: the mistake that does (docs/design/plausibility.md#while-the-robot-drives;
  /// 0: none), length of the given motions in thousandths of what the scans show, sequence of the
  /// keyframe.
  kMotionContradicted = 16,
};

}  // namespace unimapper
