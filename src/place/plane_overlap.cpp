#include "plane_overlap.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "plane_voxels.hpp"
#include "src/core/cholesky.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::place {
namespace {

constexpr float kMinNormalCosine = 0.95F;   // 18 degrees
constexpr float kMaxPlaneDistance = 0.4F;   // along the normal, metres
constexpr float kMaxCenterDistance = 2.0F;  // metres
// Level ground coincides with level ground wherever two robots are: a level plane counts for less
// than an upright one.
constexpr float kLevelWeight = 0.2F;
// So many planes of each kind are compared, evenly sampled: more do not change their share.
constexpr std::uint32_t kSampledUpright = 192;
constexpr std::uint32_t kSampledLevel = 96;
constexpr float kRangeSlack = 2.0F;  // metres
constexpr float kSlopeSlack = 0.05F;
constexpr int kRefinements = 4;
// Distance of a plane to its counterpart, standard deviation; that of all planes together, since
// neighbours of one facade err alike.
constexpr double kPlaneSigma = 0.15;
// An entry of the voxels has 16 bits.
constexpr std::uint32_t kMaxPlanes = 65535;

// Direction as a number in [0, kSectors) that grows with the azimuth; no trigonometry.
std::uint32_t sector_of(float x, float y) noexcept {
  const float sum = std::abs(x) + std::abs(y);
  if (!(sum > 0.0F && sum <= std::numeric_limits<float>::max())) return 0;
  const float part = y / sum;                                    // -1 .. 1
  const float turn = x >= 0.0F ? (part + 1.0F) : (3.0F - part);  // 0 .. 4
  const auto sector = static_cast<std::uint32_t>(turn * (VisibleExtent::kSectors / 4.0F));
  return std::min(sector, VisibleExtent::kSectors - 1);
}

}  // namespace

void VisibleExtent::build(std::span<const PlanePatch> planes) noexcept {
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

bool VisibleExtent::contains(const Eigen::Vector3f& position) const noexcept {
  const float range = position.head<2>().norm();
  if (range > range_m[sector_of(position.x(), position.y())] + kRangeSlack) return false;
  if (range < 4.0F) return true;
  const float slope = position.z() / range;
  return slope >= slope_min - kSlopeSlack && slope <= slope_max + kSlopeSlack;
}

void PlaneOverlap::allocate(Arena& arena, std::uint32_t max_planes, float voxel_size_m) noexcept {
  constexpr std::size_t kVoxels = std::size_t{kWidth} * kWidth * kHeight;
  for (Side* side : {&query_, &match_}) {
    side->entries.allocate(arena, std::min(max_planes, kMaxPlanes));
    side->voxels = arena.allocate<std::uint16_t>(kVoxels);
    side->planes = {};
    side->sampled_count = 0;
  }
  inverse_size_ = 1.0F / voxel_size_m;
}

// Chooses the planes of a side to compare: every n-th of each kind.
void PlaneOverlap::sample_planes(Side& side) noexcept {
  std::uint32_t upright = 0;
  for (const PlanePatch& patch : side.planes) upright += is_upright(patch.normal) ? 1 : 0;
  const auto level = static_cast<std::uint32_t>(side.planes.size()) - upright;
  side.sampled_count = 0;
  std::uint32_t share[2] = {0, 0};  // grows by `wanted` with every plane
  const std::uint32_t count[2] = {level, upright};
  const std::uint32_t wanted[2] = {std::min(level, kSampledLevel),
                                   std::min(upright, kSampledUpright)};
  for (std::uint32_t i = 0; i < side.planes.size(); ++i) {
    const int kind = is_upright(side.planes[i].normal) ? 1 : 0;
    share[kind] += wanted[kind];
    if (share[kind] < count[kind]) continue;
    share[kind] -= count[kind];
    side.sampled[side.sampled_count++] = i;
  }
  side.weight[0] =
      wanted[0] == 0 ? 0.0F : static_cast<float>(count[0]) / static_cast<float>(wanted[0]);
  side.weight[1] =
      wanted[1] == 0 ? 0.0F : static_cast<float>(count[1]) / static_cast<float>(wanted[1]);
}

void PlaneOverlap::fill(Side& side, std::span<const PlanePatch> planes) noexcept {
  for (const std::uint32_t entry : side.entries) side.voxels[entry] = 0;
  side.entries.clear();
  // Without memory there is room for none.
  side.planes = planes.first(std::min(planes.size(), side.entries.capacity()));
  side.extent.build(side.planes);
  for (std::uint32_t i = 0; i < side.planes.size(); ++i) {
    const std::uint32_t entry = entry_of(voxel_index(side.planes[i].center, inverse_size_));
    if (side.voxels[entry] != 0) continue;
    side.voxels[entry] = static_cast<std::uint16_t>(i + 1);
    side.entries.push_back(entry);
  }
  sample_planes(side);
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
    const std::uint16_t entry = side.voxels[entry_of(
        {base.x + (corner & 1), base.y + ((corner >> 1) & 1), base.z + (corner >> 2)})];
    if (entry == 0) continue;
    const PlanePatch& patch = side.planes[entry - 1U];
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
    for (std::uint32_t k = 0; k < from.sampled_count; ++k) {
      const PlanePatch& patch = from.planes[from.sampled[k]];
      const Eigen::Vector3f center = rotation * patch.center + shift;
      if (!to.extent.contains(center)) continue;
      const Eigen::Vector3f normal = rotation * patch.normal;
      const int kind = is_upright(normal) ? 1 : 0;
      visible[kind] += from.weight[kind];
      if (counterpart(to, center, normal) != nullptr) coincide[kind] += from.weight[kind];
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

Pose PlaneOverlap::refine(const Pose& T_match_query,
                          const Eigen::Matrix2d& tilt_information) const noexcept {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Pose pose = T_match_query;
  for (int iteration = 0; iteration < kRefinements; ++iteration) {
    // A weak prior on the current pose keeps directions the planes do not determine from drifting.
    Matrix6 hessian = Matrix6::Identity();
    hessian.topLeftCorner<3, 3>() *= 100.0;
    Vector6 gradient = Vector6::Zero();
    // The residuals of the planes are metres: what else counts is weighed by their variance.
    const Eigen::Matrix2d level = kPlaneSigma * kPlaneSigma * tilt_information;
    const Eigen::Matrix<double, 2, 3> tilting = tilt_derivative(pose);
    hessian.topLeftCorner<3, 3>() += tilting.transpose() * level * tilting;
    gradient.head<3>() += tilting.transpose() * (level * tilt_of(pose));
    const Eigen::Matrix3f rotation = pose.rotation.cast<float>();
    const Eigen::Vector3f shift = pose.translation.cast<float>();
    std::uint32_t pairs = 0;
    for (std::uint32_t k = 0; k < query_.sampled_count; ++k) {
      const PlanePatch& patch = query_.planes[query_.sampled[k]];
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

}  // namespace unimapper::place
