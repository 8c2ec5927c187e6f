// Agreement of neighbouring scans under a given motion
#include "src/input/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "src/core/quantile.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kFewestFacing = 15;
constexpr std::size_t kMostSurfacePoints = 900;
constexpr std::size_t kDrawn = 4;
constexpr std::size_t kPortions = 8;  // of a cloud, each spread over it
constexpr float kNearest_m = 1.0F;    // nearer is the robot itself

/// Small clouds: neighbouring scans overlap widely.
merge::RegistrationConfig config(std::size_t max_points, float leaf_m) {
  merge::RegistrationConfig config;
  config.leaf_m = leaf_m;
  config.max_points = static_cast<std::uint32_t>(max_points);
  config.max_source_points = 700;
  config.max_iterations = 16;
  return config;
}

/// Unit normal where the surroundings of point `i` are a plane, else zero.
Eigen::Vector3f normal_of(const merge::RegistrationCloud& cloud, std::size_t i) {
  // Covariances are next to 1 along surfaces and to 0 across them: what misses to 1 is n n^T of a
  // plane, more of poles and foliage, nothing where the surroundings are not known.
  const Eigen::Matrix3f across = Eigen::Matrix3f::Identity() - cloud.covariance(i);
  if (!(std::fabs(across.trace() - 1.0F) < 0.5F)) return Eigen::Vector3f::Zero();
  Eigen::Index axis = 0;
  across.diagonal().maxCoeff(&axis);
  return across.col(axis).normalized();
}

}  // namespace

std::vector<Eigen::Vector3f> spread_points(const datasets::Scan& scan, std::size_t most) {
  const std::size_t size = scan.points.size();
  const std::size_t drawn = std::min(size, most);
  std::vector<Eigen::Vector3f> points;
  points.reserve(drawn);
  for (std::uint64_t n = 0; n < drawn; ++n) {
    // One anywhere in each of as many parts, since a stride may meet one ring alone.
    const std::uint64_t of_1024 = size == drawn ? 0 : (n * 0x9E3779B97F4A7C15U) >> 54U;
    const std::size_t i = (1024 * n + of_1024) * size / (1024 * drawn);
    const Eigen::Vector3f p(scan.points[i].x, scan.points[i].y, scan.points[i].z);
    if (p.allFinite() && p.squaredNorm() > kNearest_m * kNearest_m) points.push_back(p);
  }
  return points;
}

ScanShape::ScanShape(const datasets::Scan& scan, std::size_t max_points, float leaf_m)
    : cloud_(spread_points(scan, kDrawn * max_points), {}, config(max_points, leaf_m)) {}

float ScanShape::next_leaf_m() const {
  constexpr float kFiner = 1.3F;  // a step of the thinning
  return std::max(kLeaf_m, cloud_.leaf_m() / kFiner);
}

std::optional<std::size_t> ScanShape::facing(std::size_t point) const {
  const Eigen::Vector3f normal = normal_of(cloud_, point);
  if (normal.isZero()) return std::nullopt;
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<std::size_t>(axis);
}

const ScanShape::Surfaces& ScanShape::surfaces() const {
  if (surfaces_) return *surfaces_;
  Surfaces& found = surfaces_.emplace();
  found.facing.fill(0);
  for (std::size_t k = 0; k < cloud_.size(); ++k) {
    const auto axis = facing(k);
    if (!axis) continue;
    found.points.push_back({cloud_.points()[k], *axis});
    ++found.facing[*axis];
  }
  // Directions that are seen much of are thinned, none is left out.
  std::array<std::size_t, 3> stride{};
  for (std::size_t a = 0; a < 3; ++a) stride[a] = 1 + 3 * found.facing[a] / kMostSurfacePoints;
  std::array<std::size_t, 3> seen{};
  std::erase_if(found.points, [&](const SurfacePoint& point) {
    return seen[point.facing]++ % stride[point.facing] != 0;
  });
  for (std::size_t a = 0; a < 3; ++a) {
    found.facing[a] = (found.facing[a] + stride[a] - 1) / stride[a];
  }
  return found;
}

bool ScanShape::shows_walls() const {
  if (shows_walls_) return *shows_walls_;
  std::array<std::size_t, 3> facing_axis{};
  for (std::size_t part = 0; part < kPortions; ++part) {
    for (std::size_t k = part; k < cloud_.size(); k += kPortions) {
      const auto axis = facing(k);
      if (!axis || ++facing_axis[*axis] < kFewestFacing || *axis == 2) continue;
      shows_walls_ = true;
      return true;
    }
  }
  shows_walls_ = false;
  return false;
}

Eigen::Vector3d ScanShape::middle() const {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (Eigen::Index a = 0; a < 3 && cloud_.size() > 0; ++a) {
    std::vector<float> coordinates;
    for (const Eigen::Vector3f& p : cloud_.points()) coordinates.push_back(p[a]);
    middle[a] = static_cast<double>(median(std::span(coordinates)));
  }
  return middle;
}

ScanPair::ScanPair(std::size_t i, std::shared_ptr<const ScanShape> first, std::size_t j,
                   std::shared_ptr<const ScanShape> second)
    : i_(i), j_(j), first_(std::move(first)), second_(std::move(second)) {}

bool ScanPair::is_informative() const { return first_->shows_walls() && second_->shows_walls(); }

bool ScanPair::is_on_surface(const Eigen::Vector3f& point, const Eigen::Matrix3f& rotation,
                             const Eigen::Vector3f& translation) const {
  constexpr float kReach_m = 2.0F;
  constexpr float kOnSurface_m = 0.12F;
  constexpr float kPerMetre = 0.003F;  // of range
  const Eigen::Vector3f p = rotation * point + translation;
  float squared = kReach_m * kReach_m;
  const std::uint32_t nearest = first_->cloud_.nearest(p, squared);
  if (nearest == merge::RegistrationCloud::kNone) return false;
  const Eigen::Vector3f normal = normal_of(first_->cloud_, nearest);
  const float across_m = normal.isZero()
                             ? std::sqrt(squared)
                             : std::fabs(normal.dot(p - first_->cloud_.points()[nearest]));
  return across_m < kOnSurface_m + kPerMetre * point.norm();
}

double ScanPair::agreement(const Pose& T_first_second) const {
  if (!T_first_second.is_finite()) return 0.0;
  const Eigen::Matrix3f r = T_first_second.rotation.cast<float>();
  const Eigen::Vector3f t = T_first_second.translation.cast<float>();
  const ScanShape::Surfaces& surfaces = second_->surfaces();
  std::array<std::size_t, 3> on_surface{};
  for (const ScanShape::SurfacePoint& point : surfaces.points) {
    if (is_on_surface(point.position, r, t)) ++on_surface[point.facing];
  }
  double sum = 0.0;
  int directions = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (surfaces.facing[a] < kFewestFacing) continue;
    sum += static_cast<double>(on_surface[a]) / static_cast<double>(surfaces.facing[a]);
    ++directions;
  }
  return directions == 0 ? 0.0 : sum / directions;
}

bool ScanPair::is_peak(const Pose& T_first_second, double agrees) const {
  constexpr double kBeside_m = 0.4;
  constexpr double kBeside_rad = 3.0 / kDegreesPerRadian;
  for (const double side : {-1.0, 1.0}) {
    std::array<Pose, 3> beside;
    beside[0].translation.x() = side * kBeside_m;
    beside[1].translation.y() = side * kBeside_m;
    beside[2].rotation =
        Eigen::AngleAxisd(side * kBeside_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (const Pose& step : beside) {
      if (agreement(T_first_second * step) >= agrees) return false;
    }
  }
  return true;
}

merge::RegistrationResult ScanPair::registration(const Pose& start) const {
  return merge::register_clouds(first_->cloud_, second_->cloud_, start,
                                config(first_->cloud_.size(), first_->cloud_.leaf_m()));
}

}  // namespace unimapper::input
