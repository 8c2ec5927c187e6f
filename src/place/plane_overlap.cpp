#include "unimapper/place/plane_overlap.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "unimapper/core/cholesky.hpp"
#include "unimapper/core/symmetric_eigen.hpp"
#include "unimapper/core/voxel_key.hpp"
#include "unimapper/place/plane_voxels.hpp"

namespace unimapper {
namespace {

constexpr float kMinNormalCosine = 0.95F;   // 18 degrees
constexpr float kMaxPlaneDistance = 0.4F;   // along the normal, metres
constexpr float kMaxCenterDistance = 2.0F;  // metres
// Level ground coincides with level ground wherever two robots stand: it says little, so only
// every third level plane is asked, and counts for less than an upright one.
constexpr std::uint32_t kLevelStride = 3;
constexpr float kLevelWeight = 0.2F * static_cast<float>(kLevelStride);
constexpr float kHorizonSlack = 2.0F;  // metres
constexpr float kSlopeSlack = 0.05F;
constexpr int kRefinements = 4;

// Direction as a number in [0, kSectors) that grows with the azimuth; no trigonometry.
std::uint32_t sector_of(float x, float y) noexcept {
  const float sum = std::abs(x) + std::abs(y);
  if (!(sum > 0.0F)) return 0;
  const float part = y / sum;                                    // -1 .. 1
  const float turn = x >= 0.0F ? (part + 1.0F) : (3.0F - part);  // 0 .. 4
  const auto sector = static_cast<std::uint32_t>(turn * (Horizon::kSectors / 4.0F));
  return std::min(sector, Horizon::kSectors - 1);
}

}  // namespace

void Horizon::build(std::span<const PlanePatch> planes) noexcept {
  std::fill_n(range_m, kSectors, 0.0F);
  slope_min = 1e9F;
  slope_max = -1e9F;
  for (const PlanePatch& patch : planes) {
    const float range = patch.center.head<2>().norm();
    float& sector = range_m[sector_of(patch.center.x(), patch.center.y())];
    sector = std::max(sector, range);
    // Near the sensor a metre of height is any slope.
    if (range < 4.0F) continue;
    slope_min = std::min(slope_min, patch.center.z() / range);
    slope_max = std::max(slope_max, patch.center.z() / range);
  }
}

bool Horizon::sees(const Eigen::Vector3f& position) const noexcept {
  const float range = position.head<2>().norm();
  if (range > range_m[sector_of(position.x(), position.y())] + kHorizonSlack) return false;
  if (range < 4.0F) return true;
  const float slope = position.z() / range;
  return slope >= slope_min - kSlopeSlack && slope <= slope_max + kSlopeSlack;
}

void PlaneOverlap::attach(Arena& arena, std::uint32_t max_planes, float voxel_size_m) noexcept {
  query_.voxels.attach(arena, max_planes);
  match_.voxels.attach(arena, max_planes);
  inverse_size_ = 1.0F / voxel_size_m;
}

void PlaneOverlap::fill(Side& side, std::span<const PlanePatch> planes) noexcept {
  side.voxels.clear();
  side.planes = planes;
  side.horizon.build(planes);
  for (std::uint32_t i = 0; i < planes.size(); ++i) {
    const std::uint32_t entry =
        side.voxels.find_or_insert(pack(voxel_index(planes[i].center, inverse_size_)));
    if (entry == FixedHashMap<std::uint32_t>::kNotFound) continue;
    if (side.voxels[entry] == 0) side.voxels[entry] = i + 1;
  }
}

void PlaneOverlap::set_query(std::span<const PlanePatch> planes) noexcept { fill(query_, planes); }
void PlaneOverlap::set_match(std::span<const PlanePatch> planes) noexcept { fill(match_, planes); }

const PlanePatch* PlaneOverlap::counterpart(const Side& side, const Eigen::Vector3f& center,
                                            const Eigen::Vector3f& normal) const noexcept {
  // The eight voxels whose centres surround the position.
  const Eigen::Vector3f grid = center * inverse_size_ - Eigen::Vector3f::Constant(0.5F);
  const VoxelIndex base = voxel_index(grid, 1.0F);
  const PlanePatch* best = nullptr;
  float best_distance = kMaxCenterDistance * kMaxCenterDistance;
  for (std::int32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t entry = side.voxels.find(
        pack({base.x + (corner & 1), base.y + ((corner >> 1) & 1), base.z + (corner >> 2)}));
    if (entry == FixedHashMap<std::uint32_t>::kNotFound) continue;
    const PlanePatch& patch = side.planes[side.voxels[entry] - 1];
    if (std::abs(patch.normal.dot(normal)) < kMinNormalCosine) continue;
    const Eigen::Vector3f offset = center - patch.center;
    if (std::abs(patch.normal.dot(offset)) > kMaxPlaneDistance) continue;
    const float distance = offset.squaredNorm();
    if (distance >= best_distance) continue;
    best_distance = distance;
    best = &patch;
  }
  return best;
}

OverlapResult PlaneOverlap::compare(const Pose& T_match_query) const noexcept {
  float visible[2] = {0.0F, 0.0F};  // level, upright
  float coincide[2] = {0.0F, 0.0F};
  const auto count = [&](const Side& from, const Side& to, const Pose& pose) {
    const Eigen::Matrix3f rotation = pose.rotation.cast<float>();
    const Eigen::Vector3f shift = pose.translation.cast<float>();
    for (std::uint32_t i = 0; i < from.planes.size(); ++i) {
      const PlanePatch& patch = from.planes[i];
      if (!is_upright(patch.normal) && i % kLevelStride != 0) continue;
      const Eigen::Vector3f center = rotation * patch.center + shift;
      if (!to.horizon.sees(center)) continue;
      const Eigen::Vector3f normal = rotation * patch.normal;
      const int kind = is_upright(normal) ? 1 : 0;
      visible[kind] += 1.0F;
      if (counterpart(to, center, normal) != nullptr) coincide[kind] += 1.0F;
    }
  };
  if (!T_match_query.is_finite()) return {};
  count(query_, match_, T_match_query);
  count(match_, query_, T_match_query.inverse());
  OverlapResult result;
  const float weighted = visible[1] + kLevelWeight * visible[0];
  if (weighted > 0.0F) {
    result.overlap = (coincide[1] + kLevelWeight * coincide[0]) / weighted;
  }
  if (visible[1] > 0.0F) result.upright_overlap = coincide[1] / visible[1];
  result.upright = static_cast<std::uint32_t>(coincide[1]);
  return result;
}

Pose PlaneOverlap::refine(const Pose& T_match_query) const noexcept {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Pose pose = T_match_query;
  for (int iteration = 0; iteration < kRefinements; ++iteration) {
    // A weak pull to where we are keeps directions the planes do not determine from drifting.
    Matrix6 hessian = Matrix6::Identity();
    hessian.topLeftCorner<3, 3>() *= 100.0;
    Vector6 gradient = Vector6::Zero();
    const Eigen::Matrix3f rotation = pose.rotation.cast<float>();
    const Eigen::Vector3f shift = pose.translation.cast<float>();
    std::uint32_t pairs = 0;
    for (std::uint32_t i = 0; i < query_.planes.size(); ++i) {
      const PlanePatch& patch = query_.planes[i];
      if (!is_upright(patch.normal) && i % kLevelStride != 0) continue;
      const Eigen::Vector3f center = rotation * patch.center + shift;
      const Eigen::Vector3f normal = rotation * patch.normal;
      const PlanePatch* other = counterpart(match_, center, normal);
      if (other == nullptr) continue;
      const double residual = static_cast<double>(other->normal.dot(center - other->center));
      Vector6 jacobian;
      jacobian << center.cross(other->normal).cast<double>(), other->normal.cast<double>();
      // Geman-McClure with a scale of 0.15 m: one misplaced plane must not bend the pose.
      const double scaled = residual * residual / (0.15 * 0.15);
      const double weight = 1.0 / ((1.0 + scaled) * (1.0 + scaled));
      hessian += weight * jacobian * jacobian.transpose();
      gradient += weight * residual * jacobian;
      ++pairs;
    }
    if (pairs < 6) return pose;
    const Cholesky<6> factor(hessian);
    const Vector6 step = -factor.solve(gradient);
    if (!factor.valid() || !step.allFinite() || step.norm() > 2.0) return pose;
    // A rotation by `step` to second order, made orthonormal again by the quaternion.
    const Eigen::Quaterniond turn(1.0, 0.5 * step(0), 0.5 * step(1), 0.5 * step(2));
    const Eigen::Matrix3d turned = turn.normalized().toRotationMatrix();
    pose.rotation = (Eigen::Quaterniond(turned * pose.rotation)).normalized().toRotationMatrix();
    pose.translation = turned * pose.translation + step.tail<3>();
    // Steps below a centimetre (and a milliradian) change no association.
    if (step.head<3>().squaredNorm() < 1e-6 && step.tail<3>().squaredNorm() < 1e-4) break;
  }
  return pose;
}

}  // namespace unimapper
