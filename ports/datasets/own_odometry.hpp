// Datasets whose poses are those of our own LiDAR odometry.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// How scans get the poses of the own odometry.
struct OwnOdometryOptions {
  /// Where the LiDAR is on the robot: poses are T_odometry_sensor with the robot at the first scan
  /// as odometry frame, but level where an accelerometer tells up. Of a LiDAR that is level at the
  /// start, the identity.
  Pose T_base_lidar{};
  std::size_t most_scans = 0;  ///< the first so many; 0: all
  std::size_t first_scan = 0;  ///< those before it are not read, and have no pose
  /// Whether the times of points are used. Automatic: unless without them scans are sharper.
  Deskew deskew = Deskew::kAuto;
  /// Told after each scan how many are done, and how many there are. May be empty.
  std::function<void(std::size_t done, std::size_t all)> progress{};
};

/// The first scans of the dataset with poses of `LidarOdometry`, which takes the place of its own.
/// A gyroscope of the dataset helps; a note says so, and where it contradicts the scans. So does an
/// accelerometer: all poses are levelled by what it says of the whole drive, `up_sigma_deg` how
/// well. Reads all of them once: about as long as mapping takes; again where points have times and
/// turn out to be compensated already, which a note says. True poses stay. A note says where scans
/// did not determine the motion. Throws DatasetError where the odometry lost most scans.
[[nodiscard]] std::unique_ptr<Dataset> with_own_odometry(std::unique_ptr<Dataset> dataset,
                                                         const OwnOdometryOptions& options);

}  // namespace unimapper::datasets
