// Loop search, verification: from pose hypotheses to confidences.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "column_code.hpp"
#include "database_state.hpp"
#include "src/core/cholesky.hpp"
#include "src/core/quantile.hpp"
#include "src/core/tilt_prior.hpp"

namespace unimapper {
namespace {

// Keypoints this close to each other agree with a pose; measured.
constexpr float kInlierDistanceM = 0.8F;

// Evidence at which a factor of the confidence is half its largest value: keypoints that agree,
// and their share of the smaller place's keypoints.
constexpr float kHalfCount = 4.0F;
constexpr float kHalfShare = 0.1F;
// Shapes the score so that 0.5 lies above what chance reaches; see docs/design on keypoints and
// search.
constexpr float kHalfProduct = 0.47F;

// Refinement improves the keypoints' agreement too: poses above this share of the accepted score
// are refined.
constexpr float kRefinedShare = 0.7F;

// Candidates above this share of the accepted score are checked for ambiguity.
constexpr float kCheckedShare = 0.7F;

// Two places of one session put the query at the same position within this, metres.
constexpr float kSamePosition = 2.0F;

// Two poses relative to one place are the same with this cosine of their turn: 10 degrees.
constexpr float kSameHeading = 0.985F;
// Two places of one session that put the query farther apart than its odometry can have drifted.
constexpr float kBeyondDrift = 30.0F;

// Each factor rises and saturates: none compensates for the lack of another.
float confidence_of(float evidence, float smaller_place, float overlap) noexcept {
  if (!(smaller_place > 0.0F)) return 0.0F;
  const float share = evidence / smaller_place;
  const float product = evidence / (evidence + kHalfCount) * share / (share + kHalfShare) * overlap;
  return (1.0F + kHalfProduct) * product / (product + kHalfProduct);
}

// Heights of keypoints are the ground's, which a sensor that hardly sees the ground measures badly:
// standard deviation of each height, metres, and of the slope that all of them err by together,
// rad: 1.3 degrees.
constexpr double kHeightSigma = 0.3;
constexpr double kSlopeSigma = 0.0227;
// Standard deviation of the tilt that planes determine, rad: 1 degree.
constexpr double kPlaneTilt = 0.0175;

// Information about the tilt that is in the heights of matched keypoints, 1/rad².
Eigen::Matrix2d tilt_information(const Pose& pose, std::span<const PointPair> pairs) noexcept {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (const PointPair& pair : pairs) {
    const Eigen::Vector2d at = (pose.rotation * pair.a).head<2>();
    mean += at;
    second += at * at.transpose();
  }
  mean /= static_cast<double>(pairs.size());
  const Eigen::Matrix2d heights =
      (second - static_cast<double>(pairs.size()) * mean * mean.transpose()) /
      (kHeightSigma * kHeightSigma);
  // The inverse of the sum of both covariances; the slope's alone has one where pairs lie on a
  // line.
  const Eigen::Matrix2d sum = Eigen::Matrix2d::Identity() + kSlopeSigma * kSlopeSigma * heights;
  const Eigen::Matrix2d information = heights * Cholesky<2>(sum).inverse();
  return 0.5 * (information + information.transpose());
}

// The pose with another tilt, and the translation that belongs to it. The median of the height
// differences is more accurate than their mean.
Pose turned(const Pose& pose, const Eigen::Vector2d& tilt,
            std::span<const PointPair> pairs) noexcept {
  Pose result = with_tilt(pose, tilt);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double heights[255];
  const std::size_t count = std::min<std::size_t>(pairs.size(), 255);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d difference = pairs[i].b - result.rotation * pairs[i].a;
    offset += difference;
    heights[i] = difference.z();
  }
  result.translation = offset / static_cast<double>(count);
  result.translation.z() = median(std::span(heights, count));
  return result;
}

// Ratio test: 1 while the best competing pose has at most three quarters of the evidence, falling
// to 0 where it has as much.
float distinctness_of(float evidence, float competing) noexcept {
  if (!(evidence > 0.0F)) return 0.0F;
  return std::clamp((1.0F - competing / evidence) / 0.25F, 0.0F, 1.0F);
}

}  // namespace

void PlaceDatabase::State::load_targets(std::uint32_t slot) noexcept {
  targets_.clear();
  const std::size_t first = std::size_t{slot} * shape_.max_keypoints;
  for (std::uint32_t i = 0; i < places_[slot].keypoints; ++i) {
    const Eigen::Vector3f& p = vertices_[first + i];
    targets_.add({p.x(), p.y(), p.z(), codes_[first + i]});
  }
}

// Pairs every query keypoint with the nearest target that a pose brings it to; a target is used
// once, by the first (strongest) query keypoint. Returns the evidence: a pair counts the more
// the closer it is and the more alike its columns are, at most 1. A chance pair, somewhere within
// the radius and of another shape, counts about 0.15, a true one 0.5 to 0.8.
template <typename ToMatch>
float PlaceDatabase::State::pair_keypoints(const ToMatch& to_match, float radius_m) noexcept {
  pairs_.clear();
  float evidence = 0.0F;
  std::uint64_t used[4] = {0, 0, 0, 0};
  for (const Keypoint& keypoint : keypoints_) {
    const Eigen::Vector2f at = to_match(keypoint.position);
    float distance_squared = 0.0F;
    const std::uint32_t nearest = targets_.nearest(at.x(), at.y(), radius_m, distance_squared);
    if (nearest == KeypointGrid::kNone) continue;
    if (((used[nearest / 64U] >> (nearest % 64U)) & 1U) != 0) continue;
    used[nearest / 64U] |= 1ULL << (nearest % 64U);
    const KeypointGrid::Point& point = targets_[nearest];
    pairs_.push_back({keypoint.position.cast<double>(),
                      Eigen::Vector3f(point.x, point.y, point.z).cast<double>()});
    const float closeness = 1.0F - distance_squared / (radius_m * radius_m);
    evidence += closeness * column_similarity(keypoint.occupancy, point.code);
  }
  return evidence;
}

float PlaceDatabase::State::consensus(const PlanarPose& pose, float radius_m) noexcept {
  return pair_keypoints(
      [&](const Eigen::Vector3f& p) -> Eigen::Vector2f {
        return pose * Eigen::Vector2f(p.head<2>());
      },
      radius_m);
}

float PlaceDatabase::State::consensus(const Pose& pose, float radius_m) noexcept {
  const Eigen::Matrix<float, 2, 3> rotation = pose.rotation.topRows<2>().cast<float>();
  const Eigen::Vector2f shift = pose.translation.head<2>().cast<float>();
  return pair_keypoints(
      [&](const Eigen::Vector3f& p) -> Eigen::Vector2f { return rotation * p + shift; }, radius_m);
}

// Alternates between pairing and fitting with a shrinking radius.
void PlaceDatabase::State::refine(Hypothesis& hypothesis) noexcept {
  for (const float scale : {2.0F, 1.0F}) {
    (void)consensus(hypothesis.pose, kInlierDistanceM * scale);
    Eigen::Vector2f a[255];
    Eigen::Vector2f b[255];
    const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(pairs_.size(), 255));
    for (std::uint32_t i = 0; i < count; ++i) {
      a[i] = pairs_[i].a.head<2>().cast<float>();
      b[i] = pairs_[i].b.head<2>().cast<float>();
    }
    if (count < 3 || !fit_planar(a, b, count, hypothesis.pose)) {
      pairs_.clear();
      return;
    }
  }
  hypothesis.evidence = consensus(hypothesis.pose, kInlierDistanceM);
}

void PlaceDatabase::State::load_planes(std::uint32_t slot) noexcept {
  match_planes_.clear();
  const std::size_t first = std::size_t{slot} * shape_.max_planes;
  for (std::size_t plane = first; plane < first + places_[slot].planes; ++plane) {
    PlanePatch patch;
    for (int axis = 0; axis < 3; ++axis) {
      patch.center(axis) = static_cast<float>(centers_[plane].cm[axis]) * 0.01F;
      patch.normal(axis) = static_cast<float>(normals_[plane].of[axis]);
    }
    const float norm = patch.normal.norm();
    if (!(norm > 0.0F)) continue;
    patch.normal /= norm;
    match_planes_.push_back(patch);
  }
  overlap_.set_match(match_planes_.view());
}

// Both cannot be true: two poses relative to one place, or two positions in one session so far
// apart that no drift of its odometry explains it.
bool PlaceDatabase::State::exclude_each_other(const Hypothesis& a,
                                              const Hypothesis& b) const noexcept {
  const auto apart = [](const PlanarPose& p, const PlanarPose& q) {
    return std::sqrt((p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y));
  };
  const auto turned = [](const PlanarPose& p, const PlanarPose& q) {
    return p.cosine * q.cosine + p.sine * q.sine < kSameHeading;
  };
  if (a.slot == b.slot) return apart(a.pose, b.pose) > kSamePose || turned(a.pose, b.pose);
  const StoredPlace& of_a = places_[a.slot];
  const StoredPlace& of_b = places_[b.slot];
  if (of_a.id.session != of_b.id.session) return false;
  return apart(of_a.T_session_place * a.pose, of_b.T_session_place * b.pose) > kBeyondDrift;
}

// Evidence of the best hypothesis that excludes this one. In a hall of equal bays a pose one bay
// off finds support as well, and so does another street of equal houses.
float PlaceDatabase::State::strongest_alternative(const Hypothesis& hypothesis) const noexcept {
  float evidence = 0.0F;
  for (const Hypothesis& other : hypotheses_) {
    if (other.evidence > evidence && exclude_each_other(hypothesis, other))
      evidence = other.evidence;
  }
  return evidence;
}

// Pose, plane overlap and confidence of one hypothesis; targets and planes of its place are loaded.
bool PlaceDatabase::State::score_pose(const Hypothesis& hypothesis,
                                      LoopCandidate& result) noexcept {
  (void)consensus(hypothesis.pose, kInlierDistanceM);
  Pose pose;
  if (!fit_rigid(pairs_.view(), pose)) return false;
  // What the keypoints' heights say of the tilt, and what is known before of it.
  const TiltPrior prior(places_[hypothesis.slot].up, query_up_, pose);
  const Eigen::Matrix2d measured = tilt_information(pose, pairs_.view());
  if (!(pose.rotation(2, 2) > 0.0)) return false;  // the other way up
  if (prior.sigmas(tilt_of(pose), measured) > kMaxTiltSigmas) return false;
  pose = turned(pose, prior.posterior(tilt_of(pose), measured), pairs_.view());
  const auto smaller = static_cast<float>(
      std::min<std::size_t>(keypoints_.size(), places_[hypothesis.slot].keypoints));
  const float distinctness =
      distinctness_of(hypothesis.evidence, strongest_alternative(hypothesis));
  // Where not even perfect planes could make the match acceptable, its pose is left as it is.
  const float ceiling = confidence_of(hypothesis.evidence, smaller, 1.0F) * distinctness;
  if (ceiling > kRefinedShare * accept_score_) {
    pose = overlap_.refine(pose, prior.information());
    if (prior.sigmas(tilt_of(pose), kPlaneTilt) > kMaxTiltSigmas) return false;
  }
  const OverlapResult overlap = overlap_.compare(pose);

  // The planes may have moved the pose: the keypoints are paired once more.
  const float evidence = consensus(pose, kInlierDistanceM);
  result.match = places_[hypothesis.slot].id;
  result.votes = hypothesis.votes;
  result.inliers = static_cast<std::uint32_t>(pairs_.size());
  result.plane_overlap = overlap.overlap;
  result.T_match_query = pose;
  result.confidence = confidence_of(evidence, smaller, overlap.overlap) * distinctness;
  return true;
}

bool PlaceDatabase::State::verify(const Hypothesis& hypothesis, LoopCandidate& result) noexcept {
  load_targets(hypothesis.slot);
  load_planes(hypothesis.slot);
  if (!score_pose(hypothesis, result)) return false;
  if (result.confidence < kCheckedShare * accept_score_) return true;

  check_ambiguity(hypothesis, result);
  return true;
}

// On a facade of equal bays all triangles may have voted for one pose while another is as good. The
// pose must have clearly more evidence than any other with the same heading; if another has more,
// it replaces the first.
void PlaceDatabase::State::check_ambiguity(const Hypothesis& hypothesis,
                                           LoopCandidate& result) noexcept {
  const StoredPlace& place = places_[hypothesis.slot];
  const PlanarPose pose = seen_from_above(result.T_match_query);
  const PlanarPose T_session_query = place.T_session_place * pose;
  // Neighbouring places that put the query at the same position share the outcome.
  const AmbiguityCheck* same =
      std::find_if(checks_.begin(), checks_.end(), [&](const AmbiguityCheck& known) {
        const float dx = known.T_session_query.x - T_session_query.x;
        const float dy = known.T_session_query.y - T_session_query.y;
        return known.session == place.id.session &&
               dx * dx + dy * dy < kSamePosition * kSamePosition;
      });
  if (same != checks_.end()) {
    result.confidence *= same->distinctness;
  } else {
    Hypothesis shifted = best_shifted(hypothesis, pose);
    float evidence = consensus(pose, kInlierDistanceM);
    LoopCandidate other;
    other.query = result.query;
    if (shifted.evidence > evidence && score_pose(shifted, other) &&
        other.confidence > result.confidence) {
      result = other;
      std::swap(shifted.evidence, evidence);
    }
    const float distinctness = distinctness_of(evidence, shifted.evidence);
    result.confidence *= distinctness;
    checks_.push_back({place.id.session,
                       place.T_session_place * seen_from_above(result.T_match_query),
                       distinctness});
  }
}

}  // namespace unimapper
