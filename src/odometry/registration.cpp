#include "registration.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "motion.hpp"
#include "src/core/cholesky.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "sweep.hpp"

namespace unimapper::odometry {
namespace {

/// A point beside the surface that it belongs to.
struct Match {
  Eigen::Vector3d arm_m;    ///< from the sensor to the point, odometry axes
  Eigen::Matrix3d across;   ///< projection onto the directions across the surface
  Eigen::Vector3d off_m;    ///< from the surface to the point, in these directions
  double squared_m2 = 0.0;  ///< of the distance
  bool is_clear = false;    ///< as of the surface
  bool is_cluster = false;  ///< neither a plane nor a pole
};

bool match(SourcePoint& point, Maps maps, const Sweep& sweep, bool is_coarse,
           Match& result) noexcept {
  const Sweep::Place at = sweep.place(point.position_m.cast<double>(), point.time_s);
  for (std::size_t scale = is_coarse ? 1 : 0; scale < maps.size(); ++scale) {
    LocalMap& map = maps[scale];
    map.find_nearest(at.place_m, point.neighbourhood[scale]);
    const std::uint32_t entry = point.neighbourhood[scale].entry;
    if (entry == LocalMap::kNone) continue;
    const Surface& surface = map.voxel(entry).surface;
    const float* const a = surface.across;
    result.arm_m = at.arm_m;
    result.across << a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5];
    const Eigen::Vector3d from_mean_m =
        at.place_m - map.centre(entry) - surface.mean_m.cast<double>();
    result.off_m = result.across * from_mean_m;
    result.squared_m2 = from_mean_m.dot(result.off_m);
    result.is_clear = surface.is_clear;
    result.is_cluster = surface.is_cluster;
    return true;
  }
  return false;
}

/// Weight by Geman and McClure.
double robust_weight(double squared_m2, double kernel_m) noexcept {
  const double kernel_m2 = kernel_m * kernel_m;
  const double root = kernel_m2 / (kernel_m2 + squared_m2);
  return root * root;
}

/// How much a point says about a motion that moves it by `path`, from 0 to the square of its
/// length; 0 if that is little: noise in the normals of planes makes every point say a little about
/// all.
double says(const Match& m, const Eigen::Vector3d& path, double least) noexcept {
  if (!m.is_clear) return 0.0;
  const double squared = path.dot(m.across * path);
  return m.is_cluster || squared > least * least ? squared : 0.0;
}

double says_of_translation(const Match& m, const Eigen::Vector3d& axis) noexcept {
  constexpr double kLeast = 0.4;  // cosine between axis and normal
  return says(m, axis, kLeast);
}

/// Of a path as long as a radian's at a distance of one: far points say no more than near ones.
double says_of_rotation(const Match& m, const Eigen::Vector3d& axis) noexcept {
  constexpr double kLeast = 0.2;
  return says(m, axis.cross(m.arm_m.normalized()), kLeast);
}

/// Directions about which only points count that say much about them.
struct SparseDirections {
  Eigen::Matrix<double, 3, 6> axes = Eigen::Matrix<double, 3, 6>::Zero();
  bool is_sparse[6] = {};
  bool any = false;

  SparseDirections() = default;
  explicit SparseDirections(const Determination& determination) noexcept
      : axes(determination.axes) {
    constexpr double kTranslation = 0.01;
    constexpr double kRotation = 0.002;
    for (int i = 0; i < 6; ++i) {
      is_sparse[i] = !(determination.share(i) > (i < 3 ? kTranslation : kRotation));
      any = any || is_sparse[i];
    }
  }
};

/// Takes the sparse directions that a point says little about out of how its place depends on
/// translation (`move`) and rotation (`turn`). Whether it says much about one.
bool leave_out(const Match& m, const SparseDirections& sparse, Eigen::Matrix3d& move,
               Eigen::Matrix3d& turn) noexcept {
  bool says_much = false;
  for (int i = 0; i < 6; ++i) {
    if (!sparse.is_sparse[i]) continue;
    const Eigen::Vector3d axis = sparse.axes.col(i);
    const double much = i < 3 ? says_of_translation(m, axis) : says_of_rotation(m, axis);
    says_much = says_much || much > 0.0;
    if (much > 0.0) continue;
    Eigen::Matrix3d& derivative = i < 3 ? move : turn;
    derivative -= (derivative * axis) * axis.transpose();
  }
  return says_much;
}

NormalEquations linearise(std::span<SourcePoint> points, Maps maps, const Sweep& sweep,
                          const Tolerance& tolerance, const SparseDirections& sparse) noexcept {
  NormalEquations sum;
  const double reach_m2 = tolerance.reach_m * tolerance.reach_m;
  Match m;
  for (SourcePoint& point : points) {
    if (!match(point, maps, sweep, tolerance.is_coarse, m) || m.squared_m2 > reach_m2) continue;
    Eigen::Matrix3d move = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d turn = skew(-m.arm_m);
    const bool says_much = sparse.any && leave_out(m, sparse, move, turn);
    const double k =
        robust_weight(m.squared_m2, says_much ? tolerance.sparse_m : tolerance.kernel_m);
    const Eigen::Matrix3d across_turn = m.across * turn;
    if (sparse.any) {
      const Eigen::Matrix3d across_move = m.across * move;
      sum.matrix.topLeftCorner<3, 3>() += k * (move.transpose() * across_move);
      sum.matrix.topRightCorner<3, 3>() += k * (move.transpose() * across_turn);
      sum.right.head<3>() -= k * (move.transpose() * m.off_m);
    } else {
      sum.matrix.topLeftCorner<3, 3>() += k * m.across;
      sum.matrix.topRightCorner<3, 3>() += k * across_turn;
      sum.right.head<3>() -= k * m.off_m;
    }
    sum.matrix.bottomRightCorner<3, 3>() += k * (turn.transpose() * across_turn);
    sum.right.tail<3>() -= k * (turn.transpose() * m.off_m);
    sum.weight += k;
    sum.squares_m2 += k * m.squared_m2;
  }
  sum.matrix.bottomLeftCorner<3, 3>() = sum.matrix.topRightCorner<3, 3>().transpose();
  return sum;
}

/// Which share of the points says much about the axes of translation and rotation. Clusters may be
/// the sensor's pattern, which stands still in its view, as a vehicle that drives along does: they
/// count along directions in which the sensor `moved_m`.
Determination determine(std::span<SourcePoint> points, Maps maps, const Sweep& sweep,
                        const Tolerance& tolerance, const NormalEquations& sum,
                        const Eigen::Vector3d& moved_m) noexcept {
  constexpr double kMoves_m = 0.02;
  const Eigen::Matrix3d translation = sum.matrix.topLeftCorner<3, 3>();
  const Eigen::Matrix3d rotation = sum.matrix.bottomRightCorner<3, 3>();
  Determination result;
  result.axes.leftCols<3>() = symmetric_eigen(translation).vectors;
  result.axes.rightCols<3>() = symmetric_eigen(rotation).vectors;
  double all = 0.0;
  Match m;
  for (SourcePoint& point : points) {
    if (!match(point, maps, sweep, tolerance.is_coarse, m) || !m.is_clear) continue;
    const double k = robust_weight(m.squared_m2, tolerance.sparse_m);
    all += k;
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d axis = result.axes.col(i);
      if (m.is_cluster && i < 3 && std::abs(axis.dot(moved_m)) < kMoves_m) continue;
      result.share(i) += k * (i < 3 ? says_of_translation(m, axis) : says_of_rotation(m, axis));
    }
  }
  if (all > 0.0) result.share /= all;
  return result;
}

/// Adds what is expected along sparse directions, as that many points would.
void expect(const SparseDirections& sparse, const Expectation& expectation, const Pose& pose,
            NormalEquations& sum) noexcept {
  constexpr double kPoint_m = 0.05;   // by which points are off
  constexpr double kSteady_m = 0.02;  // a steady velocity
  constexpr double kRotation = 25.0;  // ... and by 0.01 rad
  const double off_m = std::max(kSteady_m, expectation.off_m);
  const double translation = kPoint_m * kPoint_m / (off_m * off_m);
  const Pose& expected = expectation.pose;
  const Eigen::Vector3d shift_m = expected.translation - pose.translation;
  const Eigen::Vector3d turn_rad = rotation_vector(expected.rotation * pose.rotation.transpose());
  for (int i = 0; i < 6; ++i) {
    if (!sparse.is_sparse[i]) continue;
    const Eigen::Vector3d axis = sparse.axes.col(i);
    const int first = i < 3 ? 0 : 3;
    const double weight = i < 3 ? translation : kRotation;
    const double off = axis.dot(i < 3 ? shift_m : turn_rad);
    sum.matrix.block<3, 3>(first, first) += weight * axis * axis.transpose();
    sum.right.segment<3>(first) += weight * off * axis;
  }
}

/// Solves the equations and moves the pose; the length of the step, or a negative number if they
/// have no solution.
double step(Registered& result) noexcept {
  const Cholesky<6> cholesky(result.equations.matrix);
  const Vector6d change = cholesky.solve(result.equations.right);
  result.is_valid = cholesky.valid() && change.allFinite();
  if (!result.is_valid) return -1.0;
  result.pose.translation += change.head<3>();
  result.pose.rotation = rotation_of(change.tail<3>()) * result.pose.rotation;
  return change.norm();
}

}  // namespace

Registered register_points(std::span<SourcePoint> points, Maps maps, const Interval& interval,
                           const Pose& start, const Expectation& expectation,
                           const Tolerance& tolerance) noexcept {
  constexpr double kSmallStep = 1e-4;  // m and rad
  const auto sweep_at = [&](const Pose& pose) {
    return Sweep::of(points, interval.T_odometry_before, pose, interval.seconds, 0.0,
                     interval.turns);
  };
  const auto moved_m = [&](const Pose& pose) -> Eigen::Vector3d {
    return pose.translation - interval.T_odometry_before.translation;
  };
  Registered result;
  result.pose = start;
  SparseDirections sparse;
  if (expectation.is_known) {
    const Sweep sweep = sweep_at(start);
    const NormalEquations all = linearise(points, maps, sweep, tolerance, {});
    sparse = SparseDirections(determine(points, maps, sweep, tolerance, all, moved_m(start)));
  }
  for (int i = 0; i < tolerance.iterations; ++i) {
    result.equations = linearise(points, maps, sweep_at(result.pose), tolerance, sparse);
    expect(sparse, expectation, result.pose, result.equations);
    const double length = step(result);
    if (!result.is_valid) return result;
    if (length < kSmallStep) break;
  }
  const Sweep sweep = sweep_at(result.pose);
  const NormalEquations all =
      sparse.any ? linearise(points, maps, sweep, tolerance, {}) : result.equations;
  result.determination = determine(points, maps, sweep, tolerance, all, moved_m(result.pose));
  return result;
}

double fit_of(std::span<SourcePoint> points, Maps maps, const Interval& interval, const Pose& pose,
              double kernel_m) noexcept {
  const Sweep sweep =
      Sweep::of(points, interval.T_odometry_before, pose, interval.seconds, 0.0, interval.turns);
  double sum = 0.0;
  Match m;
  for (SourcePoint& point : points) {
    if (match(point, maps, sweep, false, m)) sum += robust_weight(m.squared_m2, kernel_m);
  }
  return sum / std::max(1.0, static_cast<double>(points.size()));
}

}  // namespace unimapper::odometry
