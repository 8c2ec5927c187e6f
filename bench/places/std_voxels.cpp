#include "bench/places/std_voxels.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace unimapper::bench {
namespace {

constexpr std::int64_t kCellOffset = 1LL << (kStdCellBits - 1U);

/// Truncated after a subtraction below zero, as STD does it: exact negative multiples of the size
/// belong to the cell below.
std::int64_t index_of(double coordinate_m, double size_m) {
  const double scaled = coordinate_m / size_m;
  return static_cast<std::int64_t>(scaled < 0.0 ? scaled - 1.0 : scaled);
}

StdCell pack(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto ux = static_cast<StdCell>(x);
  const auto uy = static_cast<StdCell>(y);
  return (ux << (2U * kStdCellBits)) + (uy << kStdCellBits) + static_cast<StdCell>(z);
}

/// The plane of a voxel's points. STD tests the smallest eigenvalue only, so a pole is a plane,
/// too.
std::optional<StdPlane> plane_of(std::span<const Eigen::Vector3d> points, const StdConfig& config) {
  if (points.size() <= config.voxel_min_points) return std::nullopt;
  const Eigen::Vector3d origin = points.front();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d d = point - origin;
    sum += d;
    products += d * d.transpose();
  }
  const auto count = static_cast<double>(points.size());
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(products / count -
                                                              mean * mean.transpose());
  if (solver.eigenvalues()[0] >= config.plane_max_variance_m2) return std::nullopt;
  return StdPlane{origin + mean, solver.eigenvectors().col(0)};
}

}  // namespace

StdCell neighbour_cell(StdCell cell, const Eigen::Vector3i& steps) {
  return cell + pack(steps.x(), steps.y(), steps.z());
}

std::optional<StdCell> cell_of(const Eigen::Vector3d& point, double size_m) {
  // Two cells less than there are, so that neighbours are cells as well.
  const double limit_m = static_cast<double>(kCellOffset - 2) * size_m;
  if (!(point.array().abs() < limit_m).all()) return std::nullopt;
  return pack(index_of(point.x(), size_m) + kCellOffset, index_of(point.y(), size_m) + kCellOffset,
              index_of(point.z(), size_m) + kCellOffset);
}

std::vector<Eigen::Vector3d> cell_centroids(std::span<const Eigen::Vector3d> points,
                                            double size_m) {
  std::vector<std::pair<StdCell, std::uint32_t>> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (const auto cell = cell_of(points[i], size_m)) order.emplace_back(*cell, i);
  }
  std::sort(order.begin(), order.end());

  std::vector<Eigen::Vector3d> centroids;
  for (auto first = order.begin(); first != order.end();) {
    const auto last = std::find_if(first, order.end(),
                                   [&](const auto& item) { return item.first != first->first; });
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (auto item = first; item != last; ++item) sum += points[item->second];
    centroids.emplace_back(sum / static_cast<double>(last - first));
    first = last;
  }
  return centroids;
}

std::span<const Eigen::Vector3i> std_faces() {
  static const std::array<Eigen::Vector3i, 6> faces = {
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  return faces;
}

StdVoxels::StdVoxels(std::span<const Eigen::Vector3d> points, const StdConfig& config) {
  sort_points(points, config.voxel_size_m);
  find_planes(config);
  connect_planes(config.coplanar_normals);
}

std::optional<std::uint32_t> StdVoxels::find(StdCell cell) const {
  const auto found = numbers_.find(cell);
  return found == numbers_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<StdPlane> StdVoxels::planes() const {
  std::vector<StdPlane> planes;
  for (const StdVoxel& voxel : voxels_) {
    if (voxel.plane) planes.push_back(*voxel.plane);
  }
  return planes;
}

void StdVoxels::sort_points(std::span<const Eigen::Vector3d> points, double size_m) {
  // Voxels are first numbered as they come, then by their cells.
  std::vector<std::uint32_t> voxel_of_point;
  std::vector<std::pair<StdCell, std::uint32_t>> cells;
  std::vector<std::size_t> ends;
  voxel_of_point.reserve(points.size());
  points_.reserve(points.size());
  for (const Eigen::Vector3d& point : points) {
    const auto cell = cell_of(point, size_m);
    if (!cell) continue;
    const auto next = static_cast<std::uint32_t>(cells.size());
    const auto [entry, is_new] = numbers_.try_emplace(*cell, next);
    if (is_new) {
      cells.emplace_back(*cell, next);
      ends.push_back(0);
    }
    voxel_of_point.push_back(entry->second);
    ++ends[entry->second];
    points_.push_back(point);
  }
  std::sort(cells.begin(), cells.end());

  voxels_.resize(cells.size());
  std::vector<Eigen::Vector3d> sorted(points_.size());
  std::size_t begin = 0;
  for (std::uint32_t number = 0; number < cells.size(); ++number) {
    const auto [cell, as_it_came] = cells[number];
    numbers_[cell] = number;
    voxels_[number].cell = cell;
    voxels_[number].points = std::span(sorted).subspan(begin, ends[as_it_came]);
    begin += std::exchange(ends[as_it_came], begin);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) sorted[ends[voxel_of_point[i]]++] = points_[i];
  points_.swap(sorted);  // the spans stay with the sorted points
}

void StdVoxels::find_planes(const StdConfig& config) {
  for (StdVoxel& voxel : voxels_) voxel.plane = plane_of(voxel.points, config);
}

void StdVoxels::connect_planes(double coplanar_normals) {
  for (StdVoxel& voxel : voxels_) {
    if (!voxel.plane) continue;
    for (const Eigen::Vector3i& face : std_faces()) {
      const auto number = find(neighbour_cell(voxel.cell, face));
      if (!number || !voxels_[*number].plane) continue;
      voxel.is_continued |=
          are_parallel(voxel.plane->normal, voxels_[*number].plane->normal, coplanar_normals);
    }
  }
}

}  // namespace unimapper::bench
