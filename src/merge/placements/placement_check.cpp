// Perceptual aliasing, and agreement of keyframes that a placement puts beside each other.
#include "placement_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <utility>

#include "changed_structure.hpp"
#include "placement_walls.hpp"
#include "roofed_share.hpp"
#include "src/core/quantile.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/merge/loops/free_space_conflict.hpp"
#include "src/merge/loops/loop_cycle.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "src/merge/loops/radius_search.hpp"
#include "src/merge/parallel.hpp"
#include "src/merge/registration/overlap_distances.hpp"
#include "src/merge/sessions/session_path.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kLoopsMoved = 8;
constexpr std::size_t kPlacesPerLoop = 12;
constexpr std::size_t kPairsVerified = 16;
// Of what two keyframes see in common, the share that may be seen through where registration ends
// at the placement, and the share that speaks against a placement where it does not
// (docs/design/loop-acceptance.md).
constexpr double kAgreeing = 0.45;
constexpr double kDiffering = 0.2;
// A placement is excluded where more than this many times the share of the common view was seen
// through, and this much more, as at the other one (docs/design/loop-acceptance.md).
constexpr double kTimesSeenThrough = 1.5;
constexpr double kMoreSeenThrough = 0.01;
// Of the keyframes that both placements put beside the map: so many at least, and this share of
// them must exclude a competing placement.
constexpr std::size_t kFewestCompared = 5;
constexpr double kExcludingShare = 2.0 / 3.0;
// Walls do not fit where they lie so far apart, and so many times as far as within one session
// (docs/design/loop-acceptance.md).
constexpr double kWallsApartM = 0.14;
constexpr double kTimesApart = 1.3;
// Of the structure, what stands during one visit alone where storeys differ, and how many times
// what changes between keyframes so far apart of one session (docs/design/loop-acceptance.md).
constexpr std::size_t kLoopsStanding = 16;
constexpr std::size_t kKeyframesApart = 6;
constexpr double kStandsOnce = 0.004;
constexpr double kTimesStanding = 2.0;
// Loops are moved to keyframes of the same map at most so far away, metres; measured.
constexpr double kMaxShiftM = 60.0;
// Storeys are at least so far above each other, metres: heights that are known better say which one
// it is.
constexpr double kStoreyM = 2.2;
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

/// Whether what is seen through at a place speaks against it, beside what is at another.
bool is_excluded(double share, double at_other) {
  return share > kTimesSeenThrough * at_other + kMoreSeenThrough;
}

/// Empty where none is known.
std::optional<double> median_of_known(const std::vector<std::optional<double>>& values) {
  std::vector<double> known;
  for (const std::optional<double>& value : values) {
    if (value) known.push_back(*value);
  }
  if (known.empty()) return std::nullopt;
  return median(std::span(known));
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
  evidence.aliasing = find_competing(placement);
  if (!evidence.aliasing.empty()) return evidence;
  evidence.competing_excluded = placement.competing.size();
  evidence.aliasing = find_repetition(placement);
  if (evidence.aliasing.empty()) evidence.aliasing = find_storeys(placement);
  if (!evidence.aliasing.empty()) return evidence;
  for (const Vote vote : ask_neighbours(placement)) {
    evidence.supporting += vote == Vote::kAgrees ? 1 : 0;
    evidence.contradicting += vote == Vote::kDiffers ? 1 : 0;
  }
  evidence.aliasing = find_walls_apart(placement);
  return evidence;
}

std::vector<PlacementEvaluator::Vote> PlacementEvaluator::ask_neighbours(
    const Placement& placement) {
  const std::vector<LoopCandidate> pairs =
      beside_each_other(placement, placement.loops, placement.T_match_session_query_session);
  const std::vector<LoopConstraint> verified = verify_loops(pairs, kRadiusLimit, clouds_, config_);
  std::vector<Vote> votes(pairs.size());
  parallel_for(pairs.size(), config_.threads,
               [&](std::size_t i) { votes[i] = vote_of(pairs[i], verified[i]); });
  return votes;
}

/// Overlap is a share of all that a keyframe sees, which one of a narrow field of view cannot
/// cover: a pair that is refused as a loop votes by what both could see.
PlacementEvaluator::Vote PlacementEvaluator::vote_of(const LoopCandidate& pair,
                                                     const LoopConstraint& verified) const {
  if (verified.decision.accepted) return Vote::kAgrees;
  const bool is_confirmed = is_registered(pair, verified);
  const CommonView view = common_view(clouds_, pair.match, pair.query,
                                      is_confirmed ? verified.T_match_query : pair.T_match_query);
  if (!view.is_enough()) return Vote::kNone;
  if (is_confirmed) return view.contradiction <= kAgreeing ? Vote::kAgrees : Vote::kDiffers;
  return view.contradiction >= kDiffering ? Vote::kDiffers : Vote::kNone;
}

/// Whether registration ended, near where it began.
bool PlacementEvaluator::is_registered(const LoopCandidate& pair,
                                       const LoopConstraint& verified) const {
  const Pose moved = pair.T_match_query.inverse() * verified.T_match_query;
  // Without registration there is no overlap after it.
  return verified.overlap > 0.0 && moved.translation.norm() <= kRadiusLimit.translation_m &&
         rotation_angle(moved.rotation) <= kRadiusLimit.rotation_rad;
}

std::map<std::size_t, double> PlacementEvaluator::seen_through(
    const Placement& placement, std::span<const LoopConstraint> loops, const Pose& T_match_query) {
  const std::vector<LoopCandidate> pairs = beside_each_other(placement, loops, T_match_query);
  const std::vector<LoopConstraint> verified = verify_loops(pairs, kRadiusLimit, clouds_, config_);
  std::vector<CommonView> views(pairs.size());
  parallel_for(pairs.size(), config_.threads, [&](std::size_t i) {
    const bool registered = is_registered(pairs[i], verified[i]);
    views[i] = common_view(clouds_, pairs[i].match, pairs[i].query,
                           registered ? verified[i].T_match_query : pairs[i].T_match_query);
  });
  std::map<std::size_t, double> shares;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (views[i].is_enough()) shares[pairs[i].query.keyframe] = views[i].contradiction;
  }
  return shares;
}

/// A placement that other loops propose and that the scans do not exclude. What moved between the
/// visits is seen through at every placement alike; what stands there is at a wrong one alone.
std::string PlacementEvaluator::find_competing(const Placement& placement) {
  if (placement.competing.empty()) return {};
  const std::map<std::size_t, double> here =
      seen_through(placement, placement.loops, placement.T_match_session_query_session);
  std::vector<double> all;
  all.reserve(here.size());
  for (const auto& [keyframe, share] : here) all.push_back(share);
  const double usual = all.empty() ? 1.0 : median(std::span(all));
  for (const CompetingPlacement& other : placement.competing) {
    const Pose& T_match_query = other.T_match_session_query_session;
    const auto shares = seen_through(placement, other.loops, T_match_query);
    const auto excluding = std::count_if(shares.begin(), shares.end(), [&](const auto& there) {
      const auto found = here.find(there.first);
      return is_excluded(there.second, found == here.end() ? usual : found->second);
    });
    const bool is_known = std::min(shares.size(), here.size()) >= kFewestCompared;
    if (is_known &&
        static_cast<double>(excluding) >= kExcludingShare * static_cast<double>(shares.size())) {
      continue;
    }
    const Eigen::Vector3d at =
        placement.T_query_session_keyframe[placement.loops.front().query.keyframe].translation;
    char text[128];
    std::snprintf(text, sizeof text,
                  "the scans do not exclude the other placement, %.0f m off (%td of %zu keyframes)",
                  (T_match_query * at - placement.T_match_session_query_session * at).norm(),
                  excluding, shares.size());
    return text;
  }
  return {};
}

/// Translations of the surroundings: the same heading at other keyframes of the match session, near
/// enough that registration would find the query there.
std::vector<PlacementEvaluator::Elsewhere> PlacementEvaluator::places_elsewhere(
    const Placement& placement, const LoopConstraint& loop) const {
  const auto& poses = placement.T_match_session_keyframe;
  const Pose& T_session_match = poses[loop.match.keyframe];
  std::vector<Elsewhere> places;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& T_session_other = poses[k];
    const Eigen::Vector3d shift = T_session_other.translation - T_session_match.translation;
    if (shift.norm() < AliasingConfig::kMinShiftM || shift.norm() > kMaxShiftM) continue;
    if (placement.beyond.excludes(shift)) continue;
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
  const auto target_cloud = clouds_.cloud(place.match);
  const auto source_cloud = clouds_.cloud(loop.query);
  const RegistrationCloud& target = *target_cloud;
  const RegistrationCloud& source = *source_cloud;
  if (structure_overlap(target, source, place.T_match_query, kOverlapRadiusM, kCoarseDistanceM) <
      std::max(kMinInitialOverlap, kWorthRegistering * loop.overlap)) {
    return 0.0;
  }
  const TiltPrior prior(clouds_.record(place.match).up, clouds_.record(loop.query).up,
                        place.T_match_query);
  const RegistrationResult aligned = register_clouds(target, source, place.T_match_query,
                                                     config_.registration, prior.information());
  const Pose correction = place.T_match_query.inverse() * aligned.T_target_source;
  if (!aligned.converged || correction.translation.norm() > kDescriptorLimit.translation_m) {
    return 0.0;
  }
  const double here =
      telling_overlap(*clouds_.cloud(loop.match), source, loop.T_match_query, place.shift_in_query);
  const double there =
      telling_overlap(target, source, aligned.T_target_source, place.shift_in_query);
  const double share = here > 0.0 ? there / here : 0.0;
  if (share < config_.aliasing.alike_share) return share;
  // Alike, but for what stands at one of the two places alone.
  const CommonView at_other =
      common_view(clouds_, place.match, loop.query, aligned.T_target_source);
  const CommonView at_loop = common_view(clouds_, loop.match, loop.query, loop.T_match_query);
  const bool is_known = at_other.is_enough() && at_loop.is_enough();
  return is_known && is_excluded(at_other.contradiction, at_loop.contradiction) ? 0.0 : share;
}

std::vector<PlacementEvaluator::Repetition> PlacementEvaluator::look_elsewhere(
    const Placement& placement) {
  struct Moved {
    std::size_t loop;  ///< position in `chosen`
    Elsewhere place;
    double share = 0.0;
  };
  const std::vector<std::size_t> chosen = spread(placement.loops.size(), kLoopsMoved);
  std::vector<Moved> moved;
  std::vector<KeyframeId> needed;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const LoopConstraint& loop = placement.loops[chosen[i]];
    needed.push_back(loop.query);
    needed.push_back(loop.match);
    for (const Elsewhere& place : places_elsewhere(placement, loop)) {
      needed.push_back(place.match);
      moved.push_back({i, place});
    }
  }
  clouds_.prepare(std::move(needed));
  parallel_for(moved.size(), config_.threads, [&](std::size_t m) {
    moved[m].share = share_elsewhere(placement.loops[chosen[moved[m].loop]], moved[m].place);
  });
  std::vector<Repetition> repetitions(chosen.size());
  for (const Moved& m : moved) {
    Repetition& of_loop = repetitions[m.loop];
    of_loop.best_share = std::max(of_loop.best_share, m.share);
    if (m.share < config_.aliasing.alike_share) continue;
    of_loop.shift_m = std::min(of_loop.shift_m, m.place.shift_m);
  }
  return repetitions;
}

/// Most loops must repeat.
std::string PlacementEvaluator::find_repetition(const Placement& placement) {
  const std::vector<Repetition> repetitions = look_elsewhere(placement);
  std::vector<double> shifts;
  for (const Repetition& of_loop : repetitions) {
    if (std::isfinite(of_loop.shift_m)) shifts.push_back(of_loop.shift_m);
  }
  if (2 * shifts.size() <= repetitions.size()) return {};
  char text[128];
  std::snprintf(text, sizeof text,
                "the surroundings repeat: %zu of %zu loops fit as well %.0f m away", shifts.size(),
                repetitions.size(), median(std::span(shifts)));
  return text;
}

/// Storeys repeat each other but for what stands in them; a person, a height or more of the way
/// must tell which one it is.
std::string PlacementEvaluator::find_storeys(const Placement& placement) const {
  if (placement.beyond.vertical_m < kStoreyM) return {};
  std::vector<double> roofed;
  std::vector<double> changed;
  for (const std::size_t i : spread(placement.loops.size(), kLoopsMoved)) {
    const LoopConstraint& loop = placement.loops[i];
    roofed.push_back(roofed_share(*clouds_.whole(loop.match)));
    roofed.push_back(roofed_share(*clouds_.whole(loop.query)));
    changed.push_back(
        common_view(clouds_, loop.match, loop.query, loop.T_match_query).contradiction);
  }
  if (median(std::span(roofed)) < AliasingConfig::kRoofedShare) return {};
  const double change = median(std::span(changed));
  const bool is_changed = change >= config_.aliasing.changed_share;
  const bool may_repeat = !placement.competing.empty() || is_continued(placement);
  if (!is_changed && !may_repeat) return {};
  const StandingShares standing = standing_shares(placement);
  char text[160];
  const double alone = standing.between.value_or(change);
  if (is_changed && std::sqrt(change * alone) >= config_.aliasing.changed_share) {
    std::snprintf(text, sizeof text,
                  "below a ceiling it may be another storey: %.0f %% of the structure differs, "
                  "%.0f %% stands in one session alone",
                  100.0 * change, 100.0 * alone);
    return text;
  }
  // A session too short to tell what changes within it is compared with the limit alone.
  const double within = standing.within.value_or(0.0);
  if (!may_repeat || !standing.between ||
      *standing.between < std::max(kStandsOnce, kTimesStanding * within)) {
    return {};
  }
  std::snprintf(text, sizeof text,
                "below a ceiling it may be another storey: %.1f %% of the structure stands in one "
                "session alone, %.1f %% changes within one",
                100.0 * *standing.between, 100.0 * within);
  return text;
}

/// Whether one session goes on where the odometry of the other ended, seconds to minutes later: a
/// robot that was shut in or carried. Nobody rearranged the place meanwhile.
bool PlacementEvaluator::is_continued(const Placement& placement) const {
  constexpr double kNearM = 3.5;
  constexpr double kShortestS = 2.0;
  constexpr double kLongestS = 120.0;
  const auto follows = [&](const KeyframeRecord& last, const KeyframeRecord& first) {
    if (first.scans.empty() || last.scans.empty()) return false;
    const double gap_s =
        static_cast<double>(first.scans.front().stamp_ns - last.scans.back().stamp_ns) * 1e-9;
    const Eigen::Vector3d moved =
        first.T_odometry_keyframe.translation - last.T_odometry_keyframe.translation;
    return gap_s >= kShortestS && gap_s <= kLongestS && moved.norm() <= kNearM;
  };
  const auto& query = sessions_[placement.loops.front().query.session].keyframes;
  const auto& match = sessions_[placement.loops.front().match.session].keyframes;
  return follows(match.back(), query.front()) || follows(query.back(), match.front());
}

/// What stands at a place during one visit alone, beside what changes while a session passes it.
PlacementEvaluator::StandingShares PlacementEvaluator::standing_shares(
    const Placement& placement) const {
  const VisitPoses match_poses = placement.T_match_session_keyframe;
  const VisitPoses query_poses = placement.T_query_session_keyframe;
  const std::vector<std::size_t> chosen = spread(placement.loops.size(), kLoopsStanding);
  std::vector<std::optional<double>> between(chosen.size());
  std::vector<std::optional<double>> within(2 * chosen.size());
  const auto in_one = [&](KeyframeId at, VisitPoses poses) -> std::optional<double> {
    const std::size_t other = at.keyframe >= kKeyframesApart ? at.keyframe - kKeyframesApart
                                                             : at.keyframe + kKeyframesApart;
    if (other >= poses.size()) return std::nullopt;
    const Pose T_other_at = poses[other].inverse() * poses[at.keyframe];
    return changed_share(clouds_, {{at.session, other}, poses}, {at, poses}, T_other_at);
  };
  parallel_for(chosen.size(), config_.threads, [&](std::size_t i) {
    const LoopConstraint& loop = placement.loops[chosen[i]];
    between[i] = changed_share(clouds_, {loop.match, match_poses}, {loop.query, query_poses},
                               loop.T_match_query);
    within[2 * i] = in_one(loop.match, match_poses);
    within[2 * i + 1] = in_one(loop.query, query_poses);
  });
  return {median_of_known(between), median_of_known(within)};
}

/// Two places of one plan, mirrored or alike, are registered to each other where most of their
/// walls fit; what does not fit lies beside the other's.
std::string PlacementEvaluator::find_walls_apart(const Placement& placement) const {
  const PlacementWalls walls = compare_walls(placement, clouds_, config_.threads);
  const bool is_known = std::isfinite(walls.between_m) && std::isfinite(walls.within_m);
  if (!is_known) return placement.is_short ? "too few walls are seen to confirm them" : "";
  if (walls.between_m <= std::max(kWallsApartM, kTimesApart * walls.within_m)) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                "the walls do not fit: nine in ten points lie within %.2f m of the other session's "
                "walls, within %.2f m of their own session's",
                walls.between_m, walls.within_m);
  return text;
}

/// Pairs as radius search finds them, evenly spread, as far as odometry from a loop is sure:
/// farther on, the placement says little.
std::vector<LoopCandidate> PlacementEvaluator::beside_each_other(
    const Placement& placement, std::span<const LoopConstraint> loops,
    const Pose& T_match_query) const {
  const std::size_t query = loops.front().query.session;
  const std::size_t match = loops.front().match.session;
  const auto& matches = placement.T_match_session_keyframe;
  std::vector<Pose> placed;
  for (const Pose& T_session_keyframe : placement.T_query_session_keyframe) {
    placed.push_back(T_match_query * T_session_keyframe);
  }
  const SessionPath query_path(placed, config_.odometry);
  const SessionPath match_path({matches.begin(), matches.end()}, config_.odometry);
  const double limit = AcceptanceConfig::kConfirmingSigmaM * AcceptanceConfig::kConfirmingSigmaM;
  std::vector<LoopCandidate> pairs = find_radius_candidates(
      sessions_, query, match, std::move(placed), {matches.begin(), matches.end()}, config_);
  std::erase_if(pairs, [&](const LoopCandidate& pair) {
    LoopConstraint at;
    at.query = pair.query;
    at.match = pair.match;
    return std::none_of(loops.begin(), loops.end(), [&](const auto& loop) {
      return drift_between(loop, at, query_path, match_path) <= limit;
    });
  });
  std::vector<LoopCandidate> chosen;
  for (const std::size_t i : spread(pairs.size(), kPairsVerified)) chosen.push_back(pairs[i]);
  return chosen;
}

}  // namespace unimapper::merge
