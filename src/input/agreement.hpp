// Agreement of neighbouring scans under a given motion
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/merge/registration/registration.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Surfaces of one scan, thinned, ready to be compared with those of another.
class ScanShape {
 public:
  /// The points are in the sensor's frame, metres; up to `max_points` of them are kept. O(points),
  /// and about 0.9 us for each that is kept.
  explicit ScanShape(const datasets::Scan& scan, std::size_t max_points = 4'000);

  /// Median of the thinned points by axis, metres.
  [[nodiscard]] Eigen::Vector3d middle() const;

 private:
  friend class ScanPair;
  struct SurfacePoint {
    Eigen::Vector3f position;
    int facing;  ///< the axis that its normal is nearest to
  };

  merge::RegistrationCloud cloud_;
  std::vector<Eigen::Vector3f> normals_;  ///< zero where there is no plane
  std::vector<SurfacePoint> surface_;     ///< a part of the points on planes
  std::array<std::size_t, 3> facing_{};   ///< points of `surface_` by direction
};

/// Two scans that see the same surroundings, ready to be compared under any motion.
class ScanPair {
 public:
  /// `i` and `j` are their indices in the recording.
  ScanPair(std::size_t i, std::shared_ptr<const ScanShape> first, std::size_t j,
           std::shared_ptr<const ScanShape> second);
  ScanPair(std::size_t i, const datasets::Scan& first, std::size_t j, const datasets::Scan& second)
      : ScanPair(i, std::make_shared<ScanShape>(first), j, std::make_shared<ScanShape>(second)) {}

  [[nodiscard]] std::size_t first() const { return i_; }
  [[nodiscard]] std::size_t second() const { return j_; }
  [[nodiscard]] const ScanShape& first_shape() const { return *first_; }

  /// Share of the second scan's surface points that lie on surfaces of the first when transformed
  /// by `T_first_second`: the mean over walls facing along x, walls facing along y, and level
  /// surfaces, so that an open street does not hide a wrong motion behind its ground. 0 to 1; 0
  /// where there are too few surfaces. About 0.1 ms.
  [[nodiscard]] double agreement(const Pose& T_first_second) const;

  /// G-ICP from `start`, which is finite.
  [[nodiscard]] merge::RegistrationResult registration(const Pose& start) const;
  /// The motion that G-ICP finds from `start`; none where that is not finite.
  [[nodiscard]] Pose registered(const Pose& start) const;

  /// Enough surfaces to tell one motion from another: walls in at least one direction.
  [[nodiscard]] bool is_informative() const;

 private:
  std::size_t i_;
  std::size_t j_;
  std::shared_ptr<const ScanShape> first_;
  std::shared_ptr<const ScanShape> second_;
};

}  // namespace unimapper::input
