// Perceptual aliasing, and agreement of keyframes that a placement puts beside each other.
#include "placement_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <span>
#include <string>

#include "free_space_conflict.hpp"
#include "loop_verifier.hpp"
#include "overlap_distances.hpp"
#include "parallel.hpp"
#include "roofed_share.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/core/tilt_prior.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kLoopsMoved = 8;
constexpr std::size_t kPlacesPerLoop = 12;
constexpr std::size_t kPairsVerified = 16;
// Of a loop's overlap, what is needed elsewhere before registration is tried there.
constexpr double kWorthRegistering = 0.6;

/// Share of the source's structure that coincides with the target, of surfaces that face `axis` (of
/// the source's frame, of length one). 0 where there are too few.
double telling_overlap(const RegistrationCloud& target, const RegistrationCloud& source,
                       const Pose& T_target_source, const Eigen::Vector3f& axis) {
  constexpr std::size_t kFewestPoints = 50;
  // A surface at 60 degrees to the axis still faces it.
  constexpr float kFacing = 0.75F;
  const Eigen::Matrix3f r = T_target_source.rotation.cast<float>();
  const Eigen::Vector3f t = T_target_source.translation.cast<float>();
  const auto reach = static_cast<float>(kOverlapRadiusM * kOverlapRadiusM);
  std::size_t facing = 0;
  std::size_t coincides = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3f& own = source.points()[i];
    if (source.is_ground(i) || own.squaredNorm() > reach) continue;
    // Covariances are 1 along a surface and nearly 0 across it.
    if (axis.dot(source.covariance(i) * axis) > kFacing) continue;
    ++facing;
    auto gate = static_cast<float>(kFineDistanceM * kFineDistanceM);
    const std::uint32_t found = target.nearest(r * own + t, gate);
    coincides += found != RegistrationCloud::kNone && !target.is_ground(found) ? 1 : 0;
  }
  return facing < kFewestPoints ? 0.0
                                : static_cast<double>(coincides) / static_cast<double>(facing);
}

/// Evenly spread indices, at most `count` of `size`.
std::vector<std::size_t> spread(std::size_t size, std::size_t count) {
  std::vector<std::size_t> chosen;
  const std::size_t n = std::min(size, count);
  for (std::size_t i = 0; i < n; ++i) chosen.push_back(i * size / n);
  return chosen;
}

}  // namespace

/// A keyframe of the match session where the query would be if the surroundings repeated.
struct PlacementEvaluator::Elsewhere {
  KeyframeId match;
  Pose T_match_query;
  double shift_m = 0.0;            ///< from where the loop puts the query
  Eigen::Vector3f shift_in_query;  ///< its direction in the query's frame, of length one
};

PlacementEvidence PlacementEvaluator::evaluate(const Placement& placement) {
  PlacementEvidence evidence;
  evidence.aliasing = find_repetition(placement);
  if (evidence.aliasing.empty()) evidence.aliasing = find_storeys(placement);
  if (!evidence.aliasing.empty()) return evidence;
  const std::vector<LoopCandidate> pairs = beside_each_other(placement);
  const CorrectionLimit limit{config_.radius.max_correction_m, config_.radius.max_correction_rad};
  for (const LoopConstraint& pair : verify_loops(pairs, limit, clouds_, config_)) {
    ++(pair.decision.accepted ? evidence.supporting : evidence.contradicting);
  }
  return evidence;
}

/// Translations of the surroundings: the same heading at other keyframes of the match session, near
/// enough that registration would find the query there.
std::vector<PlacementEvaluator::Elsewhere> PlacementEvaluator::places_elsewhere(
    const Placement& placement, const LoopConstraint& loop) const {
  const auto& poses = placement.T_match_session_keyframe;
  const Pose& T_session_match = poses[loop.match.keyframe];
  const AliasingConfig& aliasing = config_.aliasing;
  std::vector<Elsewhere> places;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& T_session_other = poses[k];
    const Eigen::Vector3d shift = T_session_other.translation - T_session_match.translation;
    if (shift.norm() < aliasing.min_shift_m || shift.norm() > aliasing.max_shift_m) continue;
    Pose T_session_query = T_session_match * loop.T_match_query;
    T_session_query.translation += shift;
    const Eigen::Vector3d direction = T_session_query.rotation.transpose() * shift.normalized();
    places.push_back({{loop.match.session, k},
                      T_session_other.inverse() * T_session_query,
                      shift.norm(),
                      direction.cast<float>()});
  }
  std::vector<Elsewhere> chosen;
  for (const std::size_t i : spread(places.size(), kPlacesPerLoop)) chosen.push_back(places[i]);
  return chosen;
}

/// How well a loop's query fits at another place, relative to where the loop puts it: of the
/// structure that tells the two apart. Walls along the shift, floors and ceilings fit anywhere.
double PlacementEvaluator::share_elsewhere(const LoopConstraint& loop,
                                           const Elsewhere& place) const {
  const RegistrationCloud& target = clouds_.cloud(place.match);
  const RegistrationCloud& source = clouds_.cloud(loop.query);
  if (structure_overlap(target, source, place.T_match_query, kOverlapRadiusM, kCoarseDistanceM) <
      std::max(config_.loops.min_initial_overlap, kWorthRegistering * loop.overlap)) {
    return 0.0;
  }
  const TiltPrior prior(clouds_.record(place.match).up, clouds_.record(loop.query).up,
                        place.T_match_query, config_.loops.tilt);
  const RegistrationResult aligned = register_clouds(target, source, place.T_match_query,
                                                     config_.registration, prior.information());
  const Pose correction = place.T_match_query.inverse() * aligned.T_target_source;
  if (!aligned.converged || correction.translation.norm() > config_.loops.max_correction_m) {
    return 0.0;
  }
  const double here =
      telling_overlap(clouds_.cloud(loop.match), source, loop.T_match_query, place.shift_in_query);
  const double there =
      telling_overlap(target, source, aligned.T_target_source, place.shift_in_query);
  return here > 0.0 ? there / here : 0.0;
}

std::string PlacementEvaluator::find_repetition(const Placement& placement) {
  struct Moved {
    std::size_t loop;
    Elsewhere place;
    double share = 0.0;
  };
  std::vector<Moved> moved;
  std::vector<KeyframeId> needed;
  const std::vector<std::size_t> chosen = spread(placement.loops.size(), kLoopsMoved);
  for (const std::size_t i : chosen) {
    needed.push_back(placement.loops[i].query);
    needed.push_back(placement.loops[i].match);
    for (const Elsewhere& place : places_elsewhere(placement, placement.loops[i])) {
      needed.push_back(place.match);
      moved.push_back({i, place});
    }
  }
  clouds_.prepare(std::move(needed));
  parallel_for(moved.size(), config_.threads, [&](std::size_t m) {
    moved[m].share = share_elsewhere(placement.loops[moved[m].loop], moved[m].place);
  });
  std::map<std::size_t, double> alike;  // shift of the nearest place where a loop fits as well
  for (const Moved& m : moved) {
    if (m.share < config_.aliasing.alike_share) continue;
    const auto [entry, inserted] = alike.try_emplace(m.loop, m.place.shift_m);
    entry->second = std::min(entry->second, m.place.shift_m);
  }
  if (2 * alike.size() <= chosen.size()) return {};
  std::vector<double> shifts;
  for (const auto& [loop, shift] : alike) shifts.push_back(shift);
  char text[128];
  std::snprintf(text, sizeof text,
                "the surroundings repeat: %zu of %zu loops fit as well %.0f m away", alike.size(),
                chosen.size(), median(std::span(shifts)));
  return text;
}

/// Storeys repeat each other but for what stands in them; a person, a height or more of the way
/// must tell which one it is.
std::string PlacementEvaluator::find_storeys(const Placement& placement) const {
  std::vector<double> roofed;
  std::vector<double> changed;
  for (const std::size_t i : spread(placement.loops.size(), kLoopsMoved)) {
    const LoopConstraint& loop = placement.loops[i];
    roofed.push_back(roofed_share(clouds_.record(loop.match)));
    roofed.push_back(roofed_share(clouds_.record(loop.query)));
    changed.push_back(
        structure_in_free_space(clouds_, loop.match, loop.query, loop.T_match_query, config_));
  }
  const double change = median(std::span(changed));
  if (median(std::span(roofed)) < config_.aliasing.roofed_share ||
      change < config_.aliasing.changed_share) {
    return {};
  }
  char text[128];
  std::snprintf(text, sizeof text,
                "below a ceiling it may be another storey: %.0f %% of the structure differs",
                100.0 * change);
  return text;
}

/// Pairs of keyframes within the radius of the placement, where odometry since the next loop is
/// sure, evenly spread.
std::vector<LoopCandidate> PlacementEvaluator::beside_each_other(const Placement& placement) const {
  const std::size_t query = placement.loops.front().query.session;
  const std::size_t match = placement.loops.front().match.session;
  const auto& queries = placement.T_query_session_keyframe;
  const auto& matches = placement.T_match_session_keyframe;
  std::vector<LoopCandidate> pairs;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const Pose placed = placement.T_match_session_query_session * queries[q];
    double nearest = config_.radius.radius_m;
    LoopCandidate pair;
    for (std::size_t m = 0; m < matches.size(); ++m) {
      const Pose T = matches[m].inverse() * placed;
      if (!(T.translation.norm() < nearest)) continue;
      nearest = T.translation.norm();
      pair.query = {query, q};
      pair.match = {match, m};
      pair.T_match_query = T;
      pair.accepted = true;
    }
    if (pair.accepted) pairs.push_back(pair);
  }
  std::vector<LoopCandidate> chosen;
  for (const std::size_t i : spread(pairs.size(), kPairsVerified)) chosen.push_back(pairs[i]);
  return chosen;
}

}  // namespace unimapper::merge
