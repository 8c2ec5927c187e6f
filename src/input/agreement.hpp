// Agreement of neighbouring scans under a given motion
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/registration.hpp"

namespace unimapper::input {

/// Two scans that see the same surroundings, ready to be compared under any motion.
class ScanPair {
 public:
  /// `i` and `j` are their indices in the recording; the points are in the sensor's frame, metres.
  ScanPair(std::size_t i, const datasets::Scan& first, std::size_t j, const datasets::Scan& second);

  [[nodiscard]] std::size_t first() const { return i_; }
  [[nodiscard]] std::size_t second() const { return j_; }

  /// Share of the second scan's surface points that lie on surfaces of the first when transformed
  /// by `T_first_second`: the mean over walls facing along x, walls facing along y, and level
  /// surfaces, so that an open street does not hide a wrong motion behind its ground. 0 to 1; 0
  /// where there are too few surfaces. About 0.3 ms.
  [[nodiscard]] double agreement(const Pose& T_first_second) const;

  /// The motion that G-ICP finds from `start`.
  [[nodiscard]] Pose registered(const Pose& start) const;

  /// Enough surfaces to tell one motion from another: walls in at least one direction.
  [[nodiscard]] bool is_informative() const { return informative_; }

  /// Median of the first scan's thinned points by axis, metres.
  [[nodiscard]] const Eigen::Vector3d& middle() const { return middle_; }

  /// Level surfaces of the first scan above and below the sensor, points.
  [[nodiscard]] std::size_t level_above() const { return level_above_; }
  [[nodiscard]] std::size_t level_below() const { return level_below_; }

 private:
  struct SurfacePoint {
    Eigen::Vector3f position;
    int facing;  ///< the axis that its normal is nearest to
  };

  std::size_t i_;
  std::size_t j_;
  merge::RegistrationCloud target_;
  merge::RegistrationCloud source_;
  std::vector<Eigen::Vector3f> target_normals_;  ///< zero where there is no plane
  std::vector<SurfacePoint> surface_;            ///< of the source
  std::array<std::size_t, 3> facing_{};          ///< points of `surface_` by direction
  bool informative_ = false;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::size_t level_above_ = 0;
  std::size_t level_below_ = 0;
};

}  // namespace unimapper::input
