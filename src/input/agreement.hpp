// Agreement of neighbouring scans under a given motion
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/merge/registration/registration.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// At most `most` points of a scan in the sensor's frame, spread over it whatever its order; those
/// nearer than a metre, on the robot itself, are left out.
[[nodiscard]] std::vector<Eigen::Vector3f> spread_points(const datasets::Scan& scan,
                                                         std::size_t most);

/// Surfaces of one scan, thinned, ready to be compared with those of another.
class ScanShape {
 public:
  static constexpr float kLeaf_m = 0.3F;  ///< where nothing is known of the density

  /// The points are in the sensor's frame, metres; up to `max_points` of them are kept. O(points);
  /// surfaces are looked for when they are asked for, about 0.5 us for each point. Points are
  /// thinned to one per voxel, from edges of `leaf_m` on. Larger ones spare time, but what is
  /// estimated from registrations scatters more.
  explicit ScanShape(const datasets::Scan& scan, std::size_t max_points = 4'000,
                     float leaf_m = kLeaf_m);

  /// Edge of the first voxels of a scan about as dense that spares most of the thinning.
  [[nodiscard]] float next_leaf_m() const;

  /// Median of the thinned points by axis, metres.
  [[nodiscard]] Eigen::Vector3d middle() const;

  /// Whether there are surfaces that face along x, or along y.
  [[nodiscard]] bool shows_walls() const;

 private:
  friend class ScanPair;
  struct SurfacePoint {
    Eigen::Vector3f position;
    std::size_t facing;  ///< the axis that its normal is nearest to
  };
  /// Points on planes.
  struct Surfaces {
    std::vector<SurfacePoint> points;   ///< a part of them
    std::array<std::size_t, 3> facing;  ///< of that part by direction
  };

  [[nodiscard]] std::optional<std::size_t> facing(std::size_t point) const;
  [[nodiscard]] const Surfaces& surfaces() const;

  // What is not asked for is not computed: by one thread at a time.
  merge::RegistrationCloud cloud_;
  mutable std::optional<Surfaces> surfaces_;
  mutable std::optional<bool> shows_walls_;
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

  /// Whether the scans agree less than that 0.4 m and 3 degrees beside the motion, on all sides:
  /// then registration ends there. Up to six agreements.
  [[nodiscard]] bool is_peak(const Pose& T_first_second, double agrees) const;

  /// G-ICP from `start`, which is finite.
  [[nodiscard]] merge::RegistrationResult registration(const Pose& start) const;

  /// Enough surfaces to tell one motion from another: walls in at least one direction.
  [[nodiscard]] bool is_informative() const;

 private:
  /// Whether a point of the second scan lies on a surface of the first.
  [[nodiscard]] bool is_on_surface(const Eigen::Vector3f& point, const Eigen::Matrix3f& rotation,
                                   const Eigen::Vector3f& translation) const;

  std::size_t i_;
  std::size_t j_;
  std::shared_ptr<const ScanShape> first_;
  std::shared_ptr<const ScanShape> second_;
};

}  // namespace unimapper::input
