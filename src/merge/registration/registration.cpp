// Generalised ICP: Levenberg-Marquardt with Cauchy-like weights, and the overlap of structure.
#include "registration.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "src/core/cholesky.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "src/core/tilt_prior.hpp"
#include "surface_model.hpp"

namespace unimapper::merge {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Largest correspondence distances of the first and of the last stage, metres.
constexpr double kCoarseCorrespondenceM = 2.5;
constexpr double kFineCorrespondenceM = 1.0;
/// Neighbouring points repeat each other's errors: so many count as one observation.
constexpr double kCorrelatedPoints = 30.0;
/// Smallest standard deviations of a loop: of its translation, metres, and of its rotation,
/// radians.
constexpr double kSigmaFloorM = 0.08;
constexpr double kSigmaFloorRad = 0.006;

struct Match {
  std::uint32_t source;
  std::uint32_t target;
};

/// Normal equations by (translation added in the target frame, rotation on the left about the
/// source's origin).
struct Linearisation {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
};

Pose moved(const Pose& pose, const Vector6d& step) {
  const Eigen::Vector3d phi = step.tail<3>();
  const double angle = phi.norm();
  Pose next = pose;
  if (angle > 1e-12) {
    next.rotation = Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix() * pose.rotation;
    next.rotation = Eigen::Quaterniond(next.rotation).normalized().toRotationMatrix();
  }
  next.translation += step.head<3>();
  return next;
}

class Aligner {
 public:
  Aligner(const RegistrationCloud& target, const RegistrationCloud& source,
          const RegistrationConfig& config, const Eigen::Matrix2d& tilt_information)
      : target_(target),
        source_(source),
        config_(config),
        // So many points count as one observation.
        level_(kCorrelatedPoints * tilt_information),
        partner_(source.size(), RegistrationCloud::kNone) {}

  void match(const Pose& pose, double gate_m) {
    const Eigen::Matrix3f r = pose.rotation.cast<float>();
    const Eigen::Vector3f t = pose.translation.cast<float>();
    const auto gate = static_cast<float>(gate_m * gate_m);
    matches_.clear();
    const std::size_t stride = 1 + (source_.size() - 1) / config_.max_source_points;
    for (std::size_t i = 0; i < source_.size(); i += stride) {
      const Eigen::Vector3f p = r * source_.points()[i] + t;
      float bound = gate;
      // The partner of the last iteration is rarely far off, which prunes the search.
      const std::uint32_t last = partner_[i];
      if (last != RegistrationCloud::kNone) {
        bound = std::min(gate, (target_.points()[last] - p).squaredNorm() * 1.0001F + 1e-12F);
      }
      const std::uint32_t found = target_.nearest(p, bound);
      partner_[i] = found;
      if (found != RegistrationCloud::kNone) {
        matches_.push_back({static_cast<std::uint32_t>(i), found});
      }
    }
  }

  /// `slide` is taken off the shapes' information in every direction: what a surface seems to
  /// say about motion along itself comes from the pairing, not from the scene.
  Linearisation linearise(const Pose& pose, double slide = 0.0) {
    Linearisation sum;
    weight_.resize(matches_.size());
    mahalanobis_.resize(matches_.size());
    for (std::size_t k = 0; k < matches_.size(); ++k) {
      const Match& m = matches_[k];
      const Eigen::Vector3d rotated = pose.rotation * source_.points()[m.source].cast<double>();
      const Eigen::Vector3d d =
          target_.points()[m.target].cast<double>() - rotated - pose.translation;
      const Eigen::Matrix3d joint =
          target_.covariance(m.target).cast<double>() +
          pose.rotation * source_.covariance(m.source).cast<double>() * pose.rotation.transpose();
      mahalanobis_[k] = joint.inverse();
      const Eigen::Vector3d md = mahalanobis_[k] * d;
      const double e2 = d.dot(md);
      // What moved between the visits must not pull: weights fall off beyond a few sigma.
      weight_[k] = 1.0 / (1.0 + e2 / kSoftLimit);
      const Eigen::Matrix3d wm =
          weight_[k] * (mahalanobis_[k] - slide * Eigen::Matrix3d::Identity());
      const Eigen::Matrix3d lever = skew(rotated);
      const Eigen::Matrix3d wml = wm * lever;
      sum.hessian.topLeftCorner<3, 3>() += wm;
      sum.hessian.topRightCorner<3, 3>() -= wml;
      sum.hessian.bottomRightCorner<3, 3>() -= lever * wml;
      sum.gradient.head<3>() += weight_[k] * md;
      sum.gradient.tail<3>() += weight_[k] * lever * md;
      sum.cost += weight_[k] * e2;
    }
    const Eigen::Matrix<double, 2, 3> tilting = tilt_derivative(pose);
    sum.hessian.bottomRightCorner<3, 3>() += tilting.transpose() * level_ * tilting;
    sum.gradient.tail<3>() -= tilting.transpose() * (level_ * tilt_of(pose));
    sum.hessian.bottomLeftCorner<3, 3>() = sum.hessian.topRightCorner<3, 3>().transpose();
    return sum;
  }

  /// Cost at another pose with the pairs, shapes and weights of the last linearisation.
  [[nodiscard]] double cost(const Pose& pose) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < matches_.size(); ++k) {
      const Eigen::Vector3d d =
          target_.points()[matches_[k].target].cast<double>() -
          pose * Eigen::Vector3d(source_.points()[matches_[k].source].cast<double>());
      sum += weight_[k] * d.dot(mahalanobis_[k] * d);
    }
    return sum + tilt_cost(pose);
  }

  /// One damped step; false when it no longer moves.
  bool step(Pose& pose, double gate_m) {
    match(pose, gate_m);
    if (matches_.size() < kMinMatches) return false;
    const Linearisation at = linearise(pose);
    for (int attempt = 0; attempt < 6; ++attempt) {
      Matrix6d damped = at.hessian;
      damped.diagonal() *= 1.0 + damping_;
      damped.diagonal().array() += 1e-9;
      const Cholesky<6> factor(damped);
      const Vector6d delta = factor.solve(at.gradient);
      if (!factor.valid() || !delta.allFinite()) return false;
      const Pose next = moved(pose, delta);
      if (cost(next) <= at.cost + tilt_cost(pose)) {
        pose = next;
        damping_ = std::max(damping_ * 0.1, 1e-9);
        return delta.head<3>().norm() > 1e-3 || delta.tail<3>().norm() > 2e-4;
      }
      damping_ = std::max(damping_ * 10.0, 1e-6);
    }
    return false;
  }

  [[nodiscard]] bool enough() const { return matches_.size() >= kMinMatches; }

  void finish(RegistrationResult& result) {
    match(result.T_target_source, kFineCorrespondenceM);
    const Linearisation at = linearise(result.T_target_source, kSlide);
    result.matched = matches_.size();
    if (!enough()) return;
    const double thin = 2.0 * kPlaneSigmaM * kPlaneSigmaM;
    double weights = 0.0;
    for (const double w : weight_) weights += w;
    result.rmse_m = std::sqrt(at.cost / weights * thin);
    result.information = information(at.hessian, result.T_target_source.rotation);
    const Eigen::Vector3d axes = symmetric_eigen<double>(at.hessian.topLeftCorner<3, 3>()).values;
    result.condition = axes[0] / axes[2];
  }

 private:
  [[nodiscard]] double tilt_cost(const Pose& pose) const {
    const Eigen::Vector2d tilt = tilt_of(pose);
    return tilt.dot(level_ * tilt);
  }

  static constexpr std::size_t kMinMatches = 50;
  static constexpr double kSoftLimit = 9.0;
  // Two surfaces that slide with one metre each know 0.5 per square metre along themselves.
  static constexpr double kSlide = 0.49;

  [[nodiscard]] Matrix6d information(const Matrix6d& hessian, const Eigen::Matrix3d& r) const {
    // The pose graph turns on the right, the normal equations on the left.
    Matrix6d turn = Matrix6d::Identity();
    turn.bottomRightCorner<3, 3>() = r;
    Matrix6d independent = turn.transpose() * hessian * turn / kCorrelatedPoints;
    // A direction nothing constrains must stay invertible: 100 m and 10 rad are no knowledge.
    independent.diagonal().head<3>().array() += 1e-4;
    independent.diagonal().tail<3>().array() += 1e-2;
    Matrix6d covariance = Cholesky<6>(independent).inverse();
    covariance.diagonal().head<3>().array() += kSigmaFloorM * kSigmaFloorM;
    covariance.diagonal().tail<3>().array() += kSigmaFloorRad * kSigmaFloorRad;
    return Cholesky<6>(covariance).inverse();
  }

  const RegistrationCloud& target_;
  const RegistrationCloud& source_;
  const RegistrationConfig& config_;
  const Eigen::Matrix2d level_;  // weight of the tilt
  std::vector<std::uint32_t> partner_;
  std::vector<Match> matches_;
  std::vector<double> weight_;
  std::vector<Eigen::Matrix3d> mahalanobis_;
  double damping_ = 1e-6;
};

/// Steps with the coarse gate, then with the fine one, up to the last pose or the first one that
/// `ends_at` is true for.
template <typename EndsAt>
void approach(Aligner& aligner, const RegistrationConfig& config, const EndsAt& ends_at,
              RegistrationResult& result) {
  double gate_m = kCoarseCorrespondenceM;
  while (result.iterations < config.max_iterations && !ends_at(result.T_target_source)) {
    ++result.iterations;
    if (aligner.step(result.T_target_source, gate_m)) continue;
    if (!aligner.enough()) break;
    if (gate_m <= kFineCorrespondenceM) {
      result.converged = true;
      break;
    }
    gate_m = kFineCorrespondenceM;
  }
}

struct Share {
  std::size_t common = 0;
  std::size_t coinciding = 0;
};

Share coinciding(const RegistrationCloud& target, const RegistrationCloud& source, const Pose& T,
                 double radius_m, double distance_m) {
  const Eigen::Matrix3f r = T.rotation.cast<float>();
  const Eigen::Vector3f t = T.translation.cast<float>();
  const auto reach = static_cast<float>(radius_m * radius_m);
  Share share;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3f& own = source.points()[i];
    if (source.is_ground(i) || own.squaredNorm() > reach) continue;
    const Eigen::Vector3f p = r * own + t;
    if (p.squaredNorm() > reach) continue;
    ++share.common;
    auto gate = static_cast<float>(distance_m * distance_m);
    const std::uint32_t found = target.nearest(p, gate);
    if (found != RegistrationCloud::kNone && !target.is_ground(found)) ++share.coinciding;
  }
  return share;
}

}  // namespace

RegistrationResult register_clouds(const RegistrationCloud& target, const RegistrationCloud& source,
                                   const Pose& T_target_source, const RegistrationConfig& config,
                                   const Eigen::Matrix2d& tilt_information) {
  RegistrationResult result;
  result.T_target_source = T_target_source;
  Aligner aligner(target, source, config, tilt_information);
  approach(
      aligner, config, [](const Pose&) { return false; }, result);
  aligner.finish(result);
  result.converged = result.converged && aligner.enough();
  return result;
}

Pose registered_pose(const RegistrationCloud& target, const RegistrationCloud& source,
                     const Pose& T_target_source, const RegistrationConfig& config,
                     const Eigen::Matrix2d& tilt_information,
                     const std::function<bool(const Pose&)>& ends_at) {
  RegistrationResult result;
  result.T_target_source = T_target_source;
  Aligner aligner(target, source, config, tilt_information);
  approach(aligner, config, ends_at, result);
  return result.T_target_source;
}

double structure_overlap(const RegistrationCloud& target, const RegistrationCloud& source,
                         const Pose& T_target_source, double radius_m, double distance_m) {
  constexpr std::size_t kMinCommon = 50;
  const Share there = coinciding(target, source, T_target_source, radius_m, distance_m);
  const Share back = coinciding(source, target, T_target_source.inverse(), radius_m, distance_m);
  const auto share = [](const Share& s) {
    return s.common < kMinCommon
               ? 0.0
               : static_cast<double>(s.coinciding) / static_cast<double>(s.common);
  };
  return std::max(share(there), share(back));
}

}  // namespace unimapper::merge
