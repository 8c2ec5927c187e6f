// Covariance of the cycle through two loops, to first order.
#include "loop_cycle.hpp"

#include <Eigen/Geometry>

#include "src/core/cholesky.hpp"

namespace unimapper::merge {
namespace {

/// Derivative of T * step by (dt, theta) of T: translation added in T's frame, rotation on its
/// right.
Matrix6d by_first(const Pose& T, const Pose& step) {
  Matrix6d j = Matrix6d::Identity();
  j.topRightCorner<3, 3>() = -T.rotation * skew(step.translation);
  j.bottomRightCorner<3, 3>() = step.rotation.transpose();
  return j;
}

/// Derivative of T * step by (dt, theta) of the step.
Matrix6d by_second(const Pose& T) {
  Matrix6d j = Matrix6d::Identity();
  j.topLeftCorner<3, 3>() = T.rotation;
  return j;
}

Matrix6d propagated(const Matrix6d& jacobian, const Matrix6d& covariance) {
  return jacobian * covariance * jacobian.transpose();
}

}  // namespace

Matrix6d odometry_covariance(const SessionPath& path, std::size_t i, std::size_t j) {
  const RelativeVariance v = path.variance(i, j);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = path.translation_covariance(i, j);
  covariance.bottomRightCorner<3, 3>().diagonal().setConstant(v.rotation);
  return covariance;
}

Matrix6d loop_covariance(const LoopConstraint& loop) {
  return Cholesky<6>(loop.information).inverse();
}

Matrix6d LoopCycle::covariance(double query_scale, double match_scale) const {
  return propagated(into_error, first_loop + query_scale * query_scale * query_odometry +
                                    match_scale * match_scale * match_odometry + second_loop);
}

LoopCycle loop_cycle(const LoopConstraint& a, const Matrix6d& covariance_a, const LoopConstraint& b,
                     const Matrix6d& covariance_b, const SessionPath& query,
                     const SessionPath& match) {
  const Pose query_step = query[a.query.keyframe].inverse() * query[b.query.keyframe];
  const Pose match_step = match[a.match.keyframe].inverse() * match[b.match.keyframe];
  // Both sides are the pose of b's query keyframe in a's match keyframe.
  const Pose forth = a.T_match_query * query_step;
  const Pose back = match_step * b.T_match_query;
  const Pose error = back.inverse() * forth;
  const Eigen::AngleAxisd turn(error.rotation);
  LoopCycle cycle;
  cycle.error << error.translation, turn.angle() * turn.axis();
  cycle.first_loop = propagated(by_first(a.T_match_query, query_step), covariance_a);
  cycle.query_odometry = propagated(by_second(a.T_match_query),
                                    odometry_covariance(query, a.query.keyframe, b.query.keyframe));
  cycle.match_odometry = propagated(by_first(match_step, b.T_match_query),
                                    odometry_covariance(match, a.match.keyframe, b.match.keyframe));
  cycle.second_loop = propagated(by_second(match_step), covariance_b);
  // Translations so far are in the frame of a's match keyframe, the error's in that of b's query.
  cycle.into_error = Matrix6d::Identity();
  cycle.into_error.topLeftCorner<3, 3>() = back.rotation.transpose();
  return cycle;
}

double cycle_chi2(const LoopConstraint& a, const Matrix6d& covariance_a, const LoopConstraint& b,
                  const Matrix6d& covariance_b, const SessionPath& query,
                  const SessionPath& match) {
  const LoopCycle cycle = loop_cycle(a, covariance_a, b, covariance_b, query, match);
  return cycle.error.dot(Cholesky<6>(cycle.covariance(1.0, 1.0)).solve(cycle.error));
}

double cycle_chi2(const LoopConstraint& a, const LoopConstraint& b, const SessionPath& query,
                  const SessionPath& match) {
  return cycle_chi2(a, loop_covariance(a), b, loop_covariance(b), query, match);
}

double drift_between(const LoopConstraint& a, const LoopConstraint& b, const SessionPath& query,
                     const SessionPath& match) {
  return query.variance(a.query.keyframe, b.query.keyframe).translation +
         match.variance(a.match.keyframe, b.match.keyframe).translation;
}

}  // namespace unimapper::merge
