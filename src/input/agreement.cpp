// Agreement of neighbouring scans under a given motion
#include "src/input/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "unimapper/core/quantile.hpp"
#include "unimapper/core/symmetric_eigen.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kFewestFacing = 15;
constexpr std::size_t kMostSurfacePoints = 900;
constexpr float kNearest_m = 1.0F;  // nearer is the robot itself

/// Small clouds: neighbouring scans overlap widely.
const merge::RegistrationConfig& config() {
  static const merge::RegistrationConfig kConfig = [] {
    merge::RegistrationConfig c;
    c.leaf_m = 0.3F;
    c.max_points = 4000;
    c.max_source_points = 700;
    c.max_iterations = 16;
    return c;
  }();
  return kConfig;
}

std::vector<Eigen::Vector3f> points_of(const datasets::Scan& scan) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  for (const auto& point : scan.points) {
    const Eigen::Vector3f p(point.x, point.y, point.z);
    if (p.allFinite() && p.squaredNorm() > kNearest_m * kNearest_m) points.push_back(p);
  }
  return points;
}

/// Unit normal where the surroundings of point `i` are a plane, else zero.
Eigen::Vector3f normal_of(const merge::RegistrationCloud& cloud, std::size_t i) {
  const SymmetricEigen<float> shape = symmetric_eigen<float>(cloud.covariance(i));
  const bool is_plane = shape.values[0] < 0.05F && shape.values[1] > 0.5F;
  return is_plane ? Eigen::Vector3f(shape.vectors.col(0)) : Eigen::Vector3f(0.0F, 0.0F, 0.0F);
}

}  // namespace

ScanPair::ScanPair(std::size_t i, const datasets::Scan& first, std::size_t j,
                   const datasets::Scan& second)
    : i_(i),
      j_(j),
      target_(points_of(first), {}, config()),
      source_(points_of(second), {}, config()) {
  for (Eigen::Index a = 0; a < 3 && target_.size() > 0; ++a) {
    std::vector<float> coordinates;
    for (const Eigen::Vector3f& p : target_.points()) coordinates.push_back(p[a]);
    middle_[a] = static_cast<double>(median(std::span(coordinates)));
  }
  target_normals_.reserve(target_.size());
  for (std::size_t k = 0; k < target_.size(); ++k) {
    target_normals_.push_back(normal_of(target_, k));
    if (std::fabs(target_normals_.back().z()) < 0.9F) continue;
    ++(target_.points()[k].z() > 0.0F ? level_above_ : level_below_);
  }
  for (std::size_t k = 0; k < source_.size(); ++k) {
    const Eigen::Vector3f normal = normal_of(source_, k);
    if (normal.isZero()) continue;
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    surface_.push_back({source_.points()[k], static_cast<int>(axis)});
    ++facing_[static_cast<std::size_t>(axis)];
  }
  // Directions that are seen much of are thinned, none is left out.
  std::array<std::size_t, 3> stride{};
  for (std::size_t a = 0; a < 3; ++a) stride[a] = 1 + 3 * facing_[a] / kMostSurfacePoints;
  std::array<std::size_t, 3> seen{};
  std::erase_if(surface_, [&](const SurfacePoint& point) {
    const auto a = static_cast<std::size_t>(point.facing);
    return seen[a]++ % stride[a] != 0;
  });
  for (std::size_t a = 0; a < 3; ++a) facing_[a] = (facing_[a] + stride[a] - 1) / stride[a];
  informative_ = facing_[0] >= kFewestFacing || facing_[1] >= kFewestFacing;
}

double ScanPair::agreement(const Pose& T_first_second) const {
  if (!T_first_second.is_finite()) return 0.0;
  const Eigen::Matrix3f r = T_first_second.rotation.cast<float>();
  const Eigen::Vector3f t = T_first_second.translation.cast<float>();
  constexpr float kReach_m = 2.0F;
  constexpr float kOnSurface_m = 0.12F;
  constexpr float kPerMetre = 0.003F;  // of range
  std::array<std::size_t, 3> on_surface{};
  for (const SurfacePoint& point : surface_) {
    const Eigen::Vector3f p = r * point.position + t;
    float squared = kReach_m * kReach_m;
    const std::uint32_t nearest = target_.nearest(p, squared);
    if (nearest == merge::RegistrationCloud::kNone) continue;
    const Eigen::Vector3f& normal = target_normals_[nearest];
    const float across_m =
        normal.isZero() ? std::sqrt(squared) : std::fabs(normal.dot(p - target_.points()[nearest]));
    const float allowed_m = kOnSurface_m + kPerMetre * point.position.norm();
    if (across_m < allowed_m) ++on_surface[static_cast<std::size_t>(point.facing)];
  }
  double sum = 0.0;
  int directions = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (facing_[a] < kFewestFacing) continue;
    sum += static_cast<double>(on_surface[a]) / static_cast<double>(facing_[a]);
    ++directions;
  }
  return directions == 0 ? 0.0 : sum / directions;
}

Pose ScanPair::registered(const Pose& start) const {
  if (!start.is_finite()) return Pose();
  return merge::register_clouds(target_, source_, start, config()).T_target_source;
}

}  // namespace unimapper::input
