#include "bench/places/std_baseline.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <unordered_set>

namespace unimapper::bench {
namespace {

constexpr std::size_t kVoxelMinPoints = 10;  // voxels with more are planes or boundaries
constexpr int kMostCells = 1 << 20;          // to either side of the origin
const std::array<Eigen::Vector3i, 6> kFaces = {
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};

/// The steps to a cell and to those around it.
Eigen::Vector3i surrounding(int i) { return {i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1}; }

/// Whether two unit vectors or opposites of theirs differ by less; 0.1 is 5.7 degrees.
bool are_parallel(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double tolerance) {
  return std::min((a - b).norm(), (a + b).norm()) < tolerance;
}

/// STD tests the smallest eigenvalue only, so a pole is a plane, too.
std::optional<StdPlane> plane_of(const StdCloud& points) {
  if (points.size() <= kVoxelMinPoints) return std::nullopt;
  const auto count = static_cast<Eigen::Index>(points.size());
  const Eigen::Map<const Eigen::Matrix3Xd> all(points.front().data(), 3, count);
  const Eigen::Vector3d mean = all.rowwise().mean();
  const Eigen::Matrix3Xd offsets = all.colwise() - mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(offsets * offsets.transpose());
  if (solver.eigenvalues()[0] >= 0.01 * static_cast<double>(count)) return std::nullopt;
  return StdPlane{mean, solver.eigenvectors().col(0)};
}

/// The image of points on a plane, counted in pixels of 0.5 m, begins at the least of all
/// coordinates. Each square segment of it gives one keypoint at most, its densest pixel. STD's
/// first axis is along (1, 1, -(nx + ny) / nz), which this is without the division.
void append_corners(const StdCloud& projected, const StdPlane& plane, const StdConfig& config,
                    std::vector<StdKeypoint>& corners) {
  const Eigen::Vector3d& n = plane.normal;
  Eigen::Matrix<double, 2, 3> axes;
  axes.row(0) =
      (n.z() < 0.0 ? -1.0 : 1.0) * Eigen::Vector3d(n.z(), n.z(), -(n.x() + n.y())).normalized();
  axes.row(1) = n.cross(Eigen::Vector3d(axes.row(0)));
  const auto on_plane = [&](const Eigen::Vector3d& point) -> Eigen::Array2d {
    return axes * (point - plane.center);
  };
  Eigen::Array2d low = Eigen::Array2d::Constant(1e9);
  for (const Eigen::Vector3d& point : projected) low = low.min(on_plane(point));
  using Pixel = std::pair<double, Eigen::Vector3d>;  // count and sum
  std::map<std::array<int, 2>, std::map<std::array<int, 2>, Pixel>> segments;
  for (const Eigen::Vector3d& point : projected) {
    const Eigen::Array2i at = ((on_plane(point) - low) / 0.5).cast<int>();
    const Eigen::Array2i segment = at / config.segment_pixels;
    auto& pixels = segments[{segment.x(), segment.y()}];
    auto& [count, sum] =
        pixels.try_emplace({at.x(), at.y()}, 0.0, Eigen::Vector3d::Zero()).first->second;
    ++count;
    sum += point;
  }
  for (const auto& [segment, pixels] : segments) {
    const auto& [count, sum] =
        std::max_element(pixels.begin(), pixels.end(), [](const auto& a, const auto& b) {
          return a.second.first < b.second.first;
        })->second;
    if (count >= config.corner_min_points) corners.push_back({sum / count, n, count});
  }
}

std::istream& operator>>(std::istream& in, Eigen::Vector3d& v) {
  return in >> v.x() >> v.y() >> v.z();
}

using Triangles = std::pair<const StdTriangle*, const StdTriangle*>;  // the query's, the stored one
StdCell key_of(const Eigen::Array3d& sides) {
  return neighbour_cell(0, sides.cast<int>().matrix());
}

bool are_alike(const StdTriangle& query, const StdTriangle& stored, const StdConfig& config) {
  const double sides = (query.sides - stored.sides).norm();
  const double counts = 2.0 * (query.counts - stored.counts).norm();
  return sides < config.side_tolerance * query.sides.norm() &&
         counts < config.count_tolerance * (query.counts + stored.counts).norm();
}

/// The pose of the triangle with which most others agree, of 50 at most: all vertices fall within
/// 3 m. STD does not refit it to all that agree.
std::optional<Pose> find_pose(const std::vector<Triangles>& pairs, const StdConfig& config) {
  const std::size_t step = pairs.size() / 50 + 1;
  std::ptrdiff_t most = config.min_agreeing - 1;
  std::optional<Pose> best;
  for (std::size_t i = 0; i + step <= pairs.size(); i += step) {
    const Eigen::Matrix4d moves =
        Eigen::umeyama(pairs[i].first->corners, pairs[i].second->corners, false);
    const Pose pose{moves.topLeftCorner<3, 3>(), moves.topRightCorner<3, 1>()};
    const auto agreeing = std::count_if(pairs.begin(), pairs.end(), [&](const Triangles& pair) {
      const Eigen::Matrix3d moved =
          (pose.rotation * pair.first->corners).colwise() + pose.translation;
      return (moved - pair.second->corners).colwise().norm().maxCoeff() < 3.0;
    });
    if (agreeing <= most) continue;
    most = agreeing;
    best = pose;
  }
  return best;
}

/// Whether a plane coincides with one of the three nearest, however far. `stored` ascends in x.
bool is_among(const StdPlane& plane, const std::vector<StdPlane>& stored) {
  std::array<std::pair<double, const StdPlane*>, 4> nearest;  // with distances; the last is dropped
  nearest.fill({1e9, nullptr});
  const double x = plane.center.x();
  const auto compare = [&](const StdPlane& other) {
    if (std::abs(other.center.x() - x) >= nearest[2].first) return false;
    nearest[3] = {(other.center - plane.center).norm(), &other};
    std::sort(nearest.begin(), nearest.end());
    return true;
  };
  const auto from =
      std::lower_bound(stored.begin(), stored.end(), x,
                       [](const auto& other, double at) { return other.center.x() < at; });
  for (auto other = from; other != stored.end() && compare(*other);) ++other;
  for (auto other = from; other != stored.begin() && compare(*std::prev(other));) --other;
  return std::any_of(nearest.begin(), nearest.begin() + 3, [&](const auto& found) {
    return found.second != nullptr && are_parallel(plane.normal, found.second->normal, 0.2) &&
           std::abs(found.second->normal.dot(plane.center - found.second->center)) < 0.5;
  });
}

}  // namespace

StdCell neighbour_cell(StdCell cell, const Eigen::Vector3i& steps) {
  const Eigen::Matrix<StdCell, 3, 1> by = steps.cast<StdCell>();
  return cell + (by.x() << 42U) + (by.y() << 21U) + by.z();
}

std::optional<StdCell> cell_of(const Eigen::Vector3d& point, double size_m) {
  const Eigen::Array3d at = point.array() / size_m;
  if (!(at.abs() < kMostCells - 2).all()) return std::nullopt;
  // Exact negative multiples of the size belong to the cell below, as STD has it.
  const Eigen::Array3d index = (at < 0.0).select(at - 1.0, at);
  return neighbour_cell(0, (index.cast<int>() + kMostCells).matrix());
}

void add_scan(const PointView& sensor_points, const Pose& T_world_sensor, StdCloud& cloud) {
  std::unordered_map<StdCell, std::size_t> numbers;  // of cells, as they come
  std::vector<std::pair<double, Eigen::Vector3d>> sums;
  for (std::size_t i = 0; i < sensor_points.count; ++i) {
    const Eigen::Vector3d point = T_world_sensor * sensor_points[i].cast<double>();
    const auto cell = cell_of(point, 0.1);
    if (!cell) continue;
    const std::size_t number = numbers.try_emplace(*cell, sums.size()).first->second;
    if (number == sums.size()) sums.emplace_back(0.0, Eigen::Vector3d::Zero());
    ++sums[number].first;
    sums[number].second += point;
  }
  for (const auto& [count, sum] : sums) cloud.emplace_back(sum / count);
}

StdVoxels find_voxels(const StdCloud& cloud) {
  StdVoxels voxels;
  for (const Eigen::Vector3d& point : cloud) {
    if (const auto cell = cell_of(point, 2.0)) voxels[*cell].points.push_back(point);
  }
  for (auto& [cell, voxel] : voxels) voxel.plane = plane_of(voxel.points);
  for (auto& [cell, voxel] : voxels) {
    for (const Eigen::Vector3i& face : kFaces) {
      const auto beside = voxels.find(neighbour_cell(cell, face));
      if (!voxel.plane || beside == voxels.end() || !beside->second.plane) continue;
      voxel.is_continued |= are_parallel(voxel.plane->normal, beside->second.plane->normal, 0.1);
    }
  }
  return voxels;
}

std::vector<StdKeypoint> find_corners(const StdVoxels& voxels, const StdConfig& config) {
  std::vector<StdKeypoint> corners;
  // Normals of the planes that a voxel was projected onto: never onto two that are similar.
  std::map<StdCell, StdCloud> projected_onto;
  const auto project = [&](StdCell cell, const StdPlane& plane, StdCloud& projected) {
    const auto voxel = voxels.find(cell);
    if (voxel == voxels.end() || voxel->second.plane) return;
    StdCloud& done = projected_onto[cell];
    for (const auto& normal : done) {
      if (are_parallel(plane.normal, normal, 0.5)) return;
    }
    done.push_back(plane.normal);
    for (const Eigen::Vector3d& point : voxel->second.points) {
      const double distance_m = plane.normal.dot(point - plane.center);
      if (std::abs(distance_m) > 5.0) continue;
      projected.emplace_back(point - distance_m * plane.normal);
    }
  };
  for (const auto& [cell, boundary] : voxels) {
    if (boundary.plane || boundary.points.size() <= kVoxelMinPoints) continue;
    for (const Eigen::Vector3i& face : kFaces) {
      const auto beside = voxels.find(neighbour_cell(cell, face));
      if (beside == voxels.end() || !beside->second.is_continued) continue;
      const StdPlane& plane = *beside->second.plane;
      StdCloud projected;
      for (int i = 0; i < 27; ++i) {
        project(neighbour_cell(cell, surrounding(i)), plane, projected);
      }
      append_corners(projected, plane, config, corners);
    }
  }
  return corners;
}

std::vector<StdKeypoint> select_keypoints(const std::vector<StdKeypoint>& corners,
                                          const StdConfig& config) {
  std::vector<StdKeypoint> kept;
  std::copy_if(corners.begin(), corners.end(), std::back_inserter(kept), [&](const auto& corner) {
    return std::none_of(corners.begin(), corners.end(), [&](const StdKeypoint& other) {
      return &other != &corner && other.count >= corner.count &&
             (other.position - corner.position).norm() < 2.0;
    });
  });
  std::stable_sort(kept.begin(), kept.end(),
                   [](const StdKeypoint& a, const StdKeypoint& b) { return a.count > b.count; });
  kept.resize(std::min(kept.size(), config.max_keypoints));
  return kept;
}

StdPlace describe_cloud(const StdCloud& cloud) {
  const StdVoxels voxels = find_voxels(cloud);
  StdPlace place{select_keypoints(find_corners(voxels)), {}};
  for (const auto& [cell, voxel] : voxels) {
    if (voxel.plane) place.planes.push_back(*voxel.plane);
  }
  return place;
}

std::vector<StdTriangle> form_triangles(const std::vector<StdKeypoint>& keypoints) {
  using Neighbour = std::pair<double, const StdKeypoint*>;  // with a distance
  std::vector<StdTriangle> triangles;
  std::unordered_set<StdCell> known;
  const auto add = [&](const StdKeypoint& a, const StdKeypoint& b, const StdKeypoint& c) {
    // Sides with the keypoint opposite to them.
    std::array<Neighbour, 3> sides = {{{(b.position - c.position).norm(), &a},
                                       {(c.position - a.position).norm(), &b},
                                       {(a.position - b.position).norm(), &c}}};
    std::sort(sides.begin(), sides.end());
    const Eigen::Vector3d lengths_m(sides[0].first, sides[1].first, sides[2].first);
    if (lengths_m[0] < 2.0 || lengths_m[2] > 30.0) return;
    if (!known.insert(key_of(1e3 * lengths_m)).second) return;
    StdTriangle& triangle = triangles.emplace_back();
    triangle.sides = lengths_m / 0.2;
    for (std::size_t i = 0; i < 3; ++i) {
      triangle.counts[static_cast<int>(i)] = sides[2 - i].second->count;
      triangle.corners.col(static_cast<int>(i)) = sides[2 - i].second->position;
    }
  };
  for (const StdKeypoint& keypoint : keypoints) {
    std::vector<Neighbour> nearest;  // twenty; the first is the keypoint itself
    for (const StdKeypoint& other : keypoints) {
      nearest.emplace_back((other.position - keypoint.position).norm(), &other);
    }
    std::sort(nearest.begin(), nearest.end());
    nearest.resize(std::min<std::size_t>(nearest.size(), 20));
    for (std::size_t m = 1; m < nearest.size(); ++m) {
      for (std::size_t n = m + 1; n < nearest.size(); ++n) {
        add(keypoint, *nearest[m].second, *nearest[n].second);
      }
    }
  }
  return triangles;
}

std::uint32_t StdDatabase::insert(const StdPlace& place) {
  const auto number = static_cast<std::uint32_t>(planes_.size());
  for (const StdTriangle& triangle : form_triangles(place.keypoints)) {
    cells_[key_of(triangle.sides.array() + 0.5)].emplace_back(number, triangle);
  }
  std::vector<StdPlane>& planes = planes_.emplace_back(place.planes);
  std::stable_sort(planes.begin(), planes.end(),
                   [](const auto& a, const auto& b) { return a.center.x() < b.center.x(); });
  return number;
}

std::optional<StdLoop> StdDatabase::search(const StdPlace& query) const {
  const std::vector<StdTriangle> triangles = form_triangles(query.keypoints);
  std::vector<std::vector<Triangles>> pairs(planes_.size());
  for (const StdTriangle& triangle : triangles) {
    for (int i = 0; i < 27; ++i) {
      // Insertion rounds and this truncates, as STD does, so the range is asymmetric.
      const Eigen::Vector3d near = triangle.sides + surrounding(i).cast<double>();
      const Eigen::Vector3d center = near.array().floor() + 0.5;
      const auto cell = cells_.find(key_of(near));
      if ((triangle.sides - center).norm() >= 1.5 || cell == cells_.end()) continue;
      for (const auto& [place, stored] : cell->second) {
        if (are_alike(triangle, stored, config_)) pairs[place].emplace_back(&triangle, &stored);
      }
    }
  }
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t place = 0; place < pairs.size(); ++place) {
    if (pairs[place].size() >= config_.min_votes) candidates.push_back(place);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](auto a, auto b) { return pairs[a].size() > pairs[b].size(); });
  candidates.resize(std::min<std::size_t>(candidates.size(), 50));

  std::optional<StdLoop> best;
  for (const std::uint32_t place : candidates) {
    const auto pose = find_pose(pairs[place], config_);
    if (!pose) continue;
    const auto found =
        std::count_if(query.planes.begin(), query.planes.end(), [&](const StdPlane& plane) {
          return is_among({*pose * plane.center, pose->rotation * plane.normal}, planes_[place]);
        });
    const double planes = std::max(1.0, static_cast<double>(query.planes.size()));
    const double score = static_cast<double>(found) / planes;
    if (!best || score > best->score) best = {place, score, pairs[place].size(), *pose};
  }
  return best;
}

void write_std_file(const std::filesystem::path& file, const std::vector<StdPlace>& places) {
  std::ofstream out(file);
  out.precision(17);
  out << "STD " << places.size() << '\n';
  for (const StdPlace& place : places) {
    out << place.keypoints.size() << ' ' << place.planes.size() << '\n';
    for (const auto& [position, normal, count] : place.keypoints) {
      out << position.transpose() << ' ' << normal.transpose() << ' ' << count << '\n';
    }
    for (const auto& [center, normal] : place.planes) {
      out << center.transpose() << ' ' << normal.transpose() << '\n';
    }
  }
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

std::vector<StdPlace> read_std_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string kind;
  std::size_t count = 0;
  if (!(in >> kind >> count) || kind != "STD") {
    throw std::runtime_error(file.string() + ": holds no STD descriptions");
  }
  std::vector<StdPlace> places(count);
  for (auto& [keypoints, planes] : places) {
    if (in >> count) keypoints.resize(count);
    if (in >> count) planes.resize(count);
    for (auto& [position, normal, points] : keypoints) in >> position >> normal >> points;
    for (auto& [center, normal] : planes) in >> center >> normal;
  }
  if (in.get() != '\n') throw std::runtime_error(file.string() + ": ends too early");
  return places;
}

}  // namespace unimapper::bench
