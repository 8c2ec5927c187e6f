#include "unimapper/merge/keyframe_level.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "src/merge/in_arena.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::merge {
namespace {

constexpr double kDriftSigma = kTiltDriftDeg / kDegreesPerRadian;
// No robot drives so far from one keyframe to the next: the odometry was started anew.
constexpr double kJumpM = 50.0;

double variance_of(const KeyframeUp& up) {
  return static_cast<double>(up.variance_x) + static_cast<double>(up.variance_y);
}

double drift_variance(std::size_t steps) {
  return kDriftSigma * kDriftSigma * static_cast<double>(steps);
}

/// The keyframe that tells most about up at keyframe `i`: the more certain and the nearer the
/// better.
std::optional<std::size_t> best_known(const std::vector<KeyframeRecord>& keyframes, std::size_t i) {
  std::optional<std::size_t> best;
  double smallest = 0.0;
  const auto consider = [&](std::size_t k) {
    if (!keyframes[k].up.known) return;
    const double variance =
        variance_of(keyframes[k].up) + 2.0 * drift_variance(k > i ? k - i : i - k);
    if (best && variance >= smallest) return;
    best = k;
    smallest = variance;
  };
  const auto jumps = [&](std::size_t k) {  // from k to k + 1
    return (keyframes[k + 1].T_odometry_keyframe.translation -
            keyframes[k].T_odometry_keyframe.translation)
               .norm() > kJumpM;
  };
  for (std::size_t k = i; k > 0 && !jumps(k - 1); --k) consider(k - 1);
  for (std::size_t k = i; k + 1 < keyframes.size() && !jumps(k); ++k) consider(k + 1);
  return best;
}

KeyframeUp up_in(const KeyframeRecord& keyframe, const KeyframeRecord& known, std::size_t steps) {
  const Eigen::Matrix2d turn =
      (keyframe.T_odometry_keyframe.rotation.transpose() * known.T_odometry_keyframe.rotation)
          .topLeftCorner<2, 2>();
  Eigen::Matrix2d covariance;
  covariance << known.up.variance_x, known.up.covariance_xy, known.up.covariance_xy,
      known.up.variance_y;
  covariance = (turn * covariance * turn.transpose()).eval() +
               drift_variance(steps) * Eigen::Matrix2d::Identity();
  return {true, static_cast<float>(covariance(0, 0)),
          static_cast<float>(0.5 * (covariance(0, 1) + covariance(1, 0))),
          static_cast<float>(covariance(1, 1))};
}

}  // namespace

void turn_keyframe(KeyframeRecord& keyframe, const Pose& T_odometry_level) {
  const Eigen::Matrix3f rotation =
      (T_odometry_level.rotation.transpose() * keyframe.T_odometry_keyframe.rotation).cast<float>();
  for (auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    for (FineCell& cell : *cells) cell.position = (rotation * cell.position).eval();
  }
  for (Keypoint& keypoint : keyframe.keypoints) {
    keypoint.position = (rotation * keypoint.position).eval();
    keypoint.normal = (rotation * keypoint.normal).eval();
  }
  keyframe.T_odometry_keyframe = T_odometry_level;
}

std::size_t level_keyframes(std::vector<KeyframeRecord>& keyframes) {
  SessionData session;
  session.keyframes = std::move(keyframes);
  const std::size_t count = level_keyframes(session);
  keyframes = std::move(session.keyframes);
  return count;
}

std::size_t level_keyframes(SessionData& session) {
  std::vector<KeyframeRecord>& keyframes = session.keyframes;
  std::vector<std::optional<std::size_t>> source(keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (!keyframes[i].up.known) source[i] = best_known(keyframes, i);
  }
  const auto count = static_cast<std::size_t>(
      std::count_if(source.begin(), source.end(), [](const auto& k) { return k.has_value(); }));
  if (count == 0) return 0;
  // The defaults of the robots, except that no cell is too many.
  InArena<PlaceDescriber> describer{DescriptorConfig{}, DescriptorInput{.max_cells = 1U << 19U}};
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (!source[i]) continue;
    KeyframeRecord& keyframe = keyframes[i];
    const KeyframeRecord& known = keyframes[*source[i]];
    turn_keyframe(keyframe, level_frame(keyframe.T_odometry_keyframe,
                                        known.T_odometry_keyframe.rotation.col(2)));
    keyframe.up = up_in(keyframe, known, *source[i] > i ? *source[i] - i : i - *source[i]);
    if (keyframe.is_summary) continue;
    const PlaceView place = describer->describe(whole_keyframe(session, i)->static_cells);
    keyframe.keypoints.assign(place.keypoints.begin(), place.keypoints.end());
    keyframe.planes.assign(place.planes.begin(), place.planes.end());
  }
  return count;
}

}  // namespace unimapper::merge
