#include "bench/places/std_keypoints.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bench/places/point_tree.hpp"

namespace unimapper::bench {
namespace {

/// A direction within the plane. STD's choice is along (1, 1, -(nx + ny) / nz), which this is
/// without the division.
Eigen::Vector3d image_axis(const Eigen::Vector3d& normal) {
  const double sign = normal.z() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d axis =
      sign * Eigen::Vector3d(normal.z(), normal.z(), -(normal.x() + normal.y()));
  const double length = axis.norm();
  return length > 0.0 ? Eigen::Vector3d(axis / length) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

/// Points on a plane, counted in pixels. Its corner is the least of all coordinates.
class BoundaryImage {
 public:
  BoundaryImage(const StdPlane& plane, const StdConfig& config) : plane_(plane), config_(config) {
    axes_.row(0) = image_axis(plane.normal).transpose();
    axes_.row(1) = plane.normal.cross(Eigen::Vector3d(axes_.row(0))).transpose();
  }

  void project(const Eigen::Vector3d& point) {
    const double distance_m = plane_.normal.dot(point - plane_.center);
    if (std::abs(distance_m) < config_.projection_min_m) return;
    if (std::abs(distance_m) > config_.projection_max_m) return;
    projected_.emplace_back(point - distance_m * plane_.normal);
  }

  /// One keypoint at most per segment.
  void append_corners(std::vector<StdKeypoint>& corners) {
    if (projected_.empty()) return;
    fill_pixels();
    const Eigen::Index side = config_.segment_pixels;
    for (Eigen::Index x = 0; x < size_.x(); x += side) {
      for (Eigen::Index y = 0; y < size_.y(); y += side) append_densest({x, y}, corners);
    }
  }

 private:
  using PixelIndex = Eigen::Matrix<Eigen::Index, 2, 1>;
  struct Pixel {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
  };

  [[nodiscard]] Eigen::Vector2d coordinates(const Eigen::Vector3d& projected) const {
    return axes_ * (projected - plane_.center);
  }
  Pixel& pixel(const PixelIndex& index) {
    return pixels_[static_cast<std::size_t>(index.x() * size_.y() + index.y())];
  }

  void fill_pixels() {
    Eigen::Vector2d low = coordinates(projected_.front());
    Eigen::Vector2d high = low;
    for (const Eigen::Vector3d& point : projected_) {
      low = low.cwiseMin(coordinates(point));
      high = high.cwiseMax(coordinates(point));
    }
    const Eigen::Index side = config_.segment_pixels;
    const double segment_m = static_cast<double>(side) * config_.pixel_m;
    const Eigen::Vector2d extent = (high - low) / segment_m;
    size_ = (extent.cast<Eigen::Index>() + PixelIndex::Ones()) * side;
    pixels_.assign(static_cast<std::size_t>(size_.prod()), {});
    for (const Eigen::Vector3d& point : projected_) {
      const Eigen::Vector2d at = (coordinates(point) - low) / config_.pixel_m;
      // Rounding may differ between the quotients of pixels and of segments.
      Pixel& hit = pixel(at.cast<Eigen::Index>().cwiseMin(size_ - PixelIndex::Ones()));
      hit.sum += point;
      ++hit.count;
    }
  }

  void append_densest(const PixelIndex& corner, std::vector<StdKeypoint>& corners) {
    const Pixel* densest = &pixel(corner);
    for (Eigen::Index dx = 0; dx < config_.segment_pixels; ++dx) {
      for (Eigen::Index dy = 0; dy < config_.segment_pixels; ++dy) {
        const Pixel& other = pixel(corner + PixelIndex(dx, dy));
        if (other.count > densest->count) densest = &other;
      }
    }
    if (densest->count == 0 || densest->count < config_.corner_min_points) return;
    const double count = densest->count;
    corners.push_back({densest->sum / count, plane_.normal, count});
  }

  const StdPlane& plane_;
  const StdConfig& config_;
  Eigen::Matrix<double, 2, 3> axes_;
  std::vector<Eigen::Vector3d> projected_;
  std::vector<Pixel> pixels_;
  PixelIndex size_ = PixelIndex::Zero();
};

/// Visits the boundary voxels in order; each point is projected by the first voxel that reaches it.
class CornerFinder {
 public:
  CornerFinder(const StdVoxels& voxels, const StdConfig& config)
      : voxels_(voxels), config_(config), projected_onto_(voxels.all().size()) {}

  std::vector<StdKeypoint> find() {
    for (const StdVoxel& voxel : voxels_.all()) {
      if (voxel.plane || voxel.points.size() <= config_.voxel_min_points) continue;
      for (const Eigen::Vector3i& face : std_faces()) {
        const auto beside = voxels_.find(neighbour_cell(voxel.cell, face));
        if (!beside || !voxels_.all()[*beside].is_continued) continue;
        project_surroundings(voxel.cell, *voxels_.all()[*beside].plane);
      }
    }
    return std::move(corners_);
  }

 private:
  void project_surroundings(StdCell cell, const StdPlane& plane) {
    BoundaryImage image(plane, config_);
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          const auto number = voxels_.find(neighbour_cell(cell, {x, y, z}));
          if (number) project(*number, plane.normal, image);
        }
      }
    }
    image.append_corners(corners_);
  }

  void project(std::uint32_t number, const Eigen::Vector3d& normal, BoundaryImage& image) {
    const StdVoxel& voxel = voxels_.all()[number];
    std::vector<Eigen::Vector3d>& done = projected_onto_[number];
    const bool is_done = std::any_of(done.begin(), done.end(), [&](const Eigen::Vector3d& other) {
      return are_parallel(normal, other, config_.projected_normals);
    });
    if (voxel.plane || is_done) return;
    done.push_back(normal);
    for (const Eigen::Vector3d& point : voxel.points) image.project(point);
  }

  const StdVoxels& voxels_;
  const StdConfig& config_;
  std::vector<std::vector<Eigen::Vector3d>> projected_onto_;  ///< normals, of every voxel
  std::vector<StdKeypoint> corners_;
};

}  // namespace

std::vector<StdKeypoint> find_corners(const StdVoxels& voxels, const StdConfig& config) {
  return CornerFinder(voxels, config).find();
}

std::vector<StdKeypoint> select_keypoints(const std::vector<StdKeypoint>& corners,
                                          const StdConfig& config) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(corners.size());
  for (const StdKeypoint& corner : corners) positions.push_back(corner.position);
  const PointTree tree(std::move(positions));

  std::vector<StdKeypoint> kept;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    bool is_strongest = true;
    tree.for_each_within(corners[i].position, config.suppression_radius_m, [&](std::uint32_t j) {
      if (j != i && corners[j].count >= corners[i].count) is_strongest = false;
    });
    if (is_strongest) kept.push_back(corners[i]);
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const StdKeypoint& a, const StdKeypoint& b) { return a.count > b.count; });
  kept.resize(std::min<std::size_t>(kept.size(), config.max_keypoints));
  return kept;
}

void StdDescriber::add_scan(std::span<const Eigen::Vector3f> sensor_points,
                            const Pose& T_world_sensor) {
  std::vector<Eigen::Vector3d> scan;
  scan.reserve(sensor_points.size());
  for (const Eigen::Vector3f& point : sensor_points) {
    if (point.allFinite()) scan.emplace_back(T_world_sensor * point.cast<double>());
  }
  // Scans are downsampled one by one, so counts grow with the number of scans.
  const std::vector<Eigen::Vector3d> centroids = cell_centroids(scan, config_.downsample_m);
  cloud_.insert(cloud_.end(), centroids.begin(), centroids.end());
}

StdPlace StdDescriber::describe() {
  const StdVoxels voxels(cloud_, config_);
  cloud_.clear();
  return {select_keypoints(find_corners(voxels, config_), config_), voxels.planes()};
}

}  // namespace unimapper::bench
