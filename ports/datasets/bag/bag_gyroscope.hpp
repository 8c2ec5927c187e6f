// Angular velocities and accelerations of a bag's IMU, by the LiDAR's axes.
#pragma once

#include <string>

#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/transform_tree.hpp"
#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets::bag {

/// Which IMU is wanted.
struct ImuWish {
  std::string topic;        ///< its name; empty: that of the LiDAR; "off": none
  std::string scan_topic;   ///< name of the scans'
  std::string lidar_frame;  ///< of the scans
};

/// Reads the IMU that is named; else the one with the frame of the LiDAR; else the only one in its
/// namespace; else the only one. The transforms must tell its axes, or it is left out with a note,
/// and refused where it is named. Messages that cannot be used are counted. Throws DatasetError
/// (without naming a file).
[[nodiscard]] RecordedGyroscope read_gyroscope(MessageSource& source,
                                               const TransformTree& transforms,
                                               const ImuWish& wish);

}  // namespace unimapper::datasets::bag
