#include "pair_registration.hpp"

#include <algorithm>
#include <cmath>

#include "src/core/cholesky.hpp"
#include "src/core/rotation_vector.hpp"
#include "src/core/symmetric_eigen.hpp"

namespace unimapper::onboard {
namespace {

/// A point beside the plane in its direction.
struct Match {
  std::size_t index = 0;
  Eigen::Vector3f point_m;
  Eigen::Vector3f normal;
  float off_m = 0.0F;
  bool is_within = false;
};

/// Calls `use` with each point that has a plane.
template <typename Use>
void for_matches(const DirectionPlanes& planes, std::span<const Eigen::Vector3f> points,
                 const Pose& pose, const Use& use, std::size_t step = 1) noexcept {
  const Eigen::Matrix3f rotation = pose.rotation.cast<float>();
  const Eigen::Vector3f translation = pose.translation.cast<float>();
  Match match;
  for (std::size_t i = 0; i < points.size(); i += step) {
    match.index = i;
    match.point_m = rotation * points[i] + translation;
    const DirectionPlane* const plane = planes.find(match.point_m);
    if (plane == nullptr) continue;
    const Eigen::Vector3f from_mean = match.point_m - plane->mean_m;
    match.normal = plane->normal;
    match.off_m = plane->normal.dot(from_mean);
    match.is_within = from_mean.squaredNorm() - match.off_m * match.off_m <= plane->reach_m2;
    use(match);
  }
}

}  // namespace

std::uint32_t choose_points(const DirectionPlanes& planes, std::span<const Eigen::Vector3f> points,
                            const Pose& T_first_second,
                            std::span<Eigen::Vector3f> chosen) noexcept {
  constexpr std::size_t kStep = 4;
  Eigen::Matrix3f normals = Eigen::Matrix3f::Zero();
  for_matches(
      planes, points, T_first_second,
      [&](const Match& m) noexcept { normals += m.normal * m.normal.transpose(); }, kStep);
  const Eigen::Matrix3f axes = symmetric_eigen(normals).vectors.transpose();
  const std::size_t most = chosen.size() / 3;
  std::size_t taken[3] = {};
  std::uint32_t size = 0;
  for_matches(planes, points, T_first_second, [&](const Match& m) noexcept {
    const Eigen::Vector3f along = (axes * m.normal).cwiseAbs();
    std::size_t axis = along.y() > along.x() ? 1 : 0;
    if (along.z() > std::max(along.x(), along.y())) axis = 2;
    if (taken[axis] == most) return;
    ++taken[axis];
    chosen[size++] = points[m.index];
  });
  return size;
}

bool PairRegistration::step(const DirectionPlanes& planes,
                            std::span<const Eigen::Vector3f> points) noexcept {
  constexpr float kKernels_m[] = {0.6F, 0.4F, 0.25F, 0.15F, 0.1F, 0.06F};
  constexpr int kKernels = 6;
  constexpr double kSmallStep = 3e-4;  // m and rad
  const float kernel_m = kKernels_m[std::min(steps_, kKernels - 1)];
  const float kernel_m2 = kernel_m * kernel_m;
  const float reach_m = 3.0F * kernel_m;
  Eigen::Matrix<float, 6, 6> sum = Eigen::Matrix<float, 6, 6>::Zero();
  Eigen::Matrix<float, 6, 1> right = Eigen::Matrix<float, 6, 1>::Zero();
  const Eigen::Vector3f origin = pose_.translation.cast<float>();
  for_matches(planes, points, pose_, [&](const Match& m) noexcept {
    if (!m.is_within || std::fabs(m.off_m) > reach_m) return;
    const float root = kernel_m2 / (kernel_m2 + m.off_m * m.off_m);
    const float weight = root * root;
    Eigen::Matrix<float, 6, 1> j;
    j << m.normal, (m.point_m - origin).cross(m.normal);
    for (int c = 0; c < 6; ++c) {
      const float weighted = weight * j[c];
      for (int r = c; r < 6; ++r) sum(r, c) += weighted * j[r];
      right[c] -= weighted * m.off_m;
    }
  });
  Eigen::Matrix<double, 6, 6> normal = sum.cast<double>();
  // What nothing shows stays as it is.
  normal.diagonal().array() += 1e-3;
  const Cholesky<6> factors(normal);
  is_valid_ = factors.valid();
  if (!is_valid_) return false;
  const Eigen::Matrix<double, 6, 1> change = factors.solve(right.cast<double>());
  pose_.translation += change.head<3>();
  pose_.rotation = rotation_of(change.tail<3>()) * pose_.rotation;
  is_valid_ = pose_.is_finite() && pose_.translation.squaredNorm() < 1e6;
  ++steps_;
  return is_valid_ && steps_ < kMostSteps && (steps_ < kKernels || change.norm() > kSmallStep);
}

PlaneFit fit_of(const DirectionPlanes& planes, std::span<const Eigen::Vector3f> points,
                const Pose& T_first_second) noexcept {
  constexpr std::size_t kStep = 2;
  constexpr float kOn_m = 0.1F;
  PlaneFit fit;
  constexpr float kFewest = 8.0F;  // of a direction
  float beside[3] = {};
  float on[3] = {};
  Eigen::Matrix3f normals = Eigen::Matrix3f::Zero();
  for_matches(
      planes, points, T_first_second,
      [&](const Match& m) noexcept {
        const Eigen::Vector3f along = m.normal.cwiseAbs();
        std::size_t axis = along.y() > along.x() ? 1 : 0;
        if (along.z() > std::max(along.x(), along.y())) axis = 2;
        beside[axis] += 1.0F;
        if (!m.is_within || std::fabs(m.off_m) > kOn_m) return;
        on[axis] += 1.0F;
        ++fit.points;
        normals += m.normal * m.normal.transpose();
      },
      kStep);
  if (fit.points == 0) return fit;
  float directions = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (beside[axis] < kFewest) continue;
    fit.share += on[axis] / beside[axis];
    directions += 1.0F;
  }
  fit.share /= std::max(directions, 1.0F);
  fit.least = symmetric_eigen(normals).values.x();
  return fit;
}

}  // namespace unimapper::onboard
