// Distance of walls between two sessions, beside that within each.
#include "placement_walls.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/merge/parallel.hpp"
#include "wall_distance.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kLoops = 16;
constexpr std::size_t kQueries = 2'000;
// Points that two keyframes have at walls, and pairs of keyframes that have them.
constexpr std::size_t kFewestPoints = 100;
constexpr std::size_t kFewestPairs = 2;
constexpr float kAboveSensorM = 0.5F;

/// Above people and most vehicles, which have other places on another day; in the frame that `T`
/// maps the keyframe's to.
std::vector<Eigen::Vector3f> structure_of(const KeyframeClouds& clouds, KeyframeId keyframe,
                                          const Pose& T) {
  const Eigen::Matrix3f r = T.rotation.cast<float>();
  const Eigen::Vector3f t = T.translation.cast<float>();
  const auto record = clouds.whole(keyframe);
  std::vector<Eigen::Vector3f> points;
  for (const FineCell& cell : record->static_cells) {
    const bool is_structure = cell.ground == 0 && cell.position.z() > kAboveSensorM;
    if (is_structure) points.emplace_back(r * cell.position + t);
  }
  return points;
}

/// A keyframe beside another one.
struct Beside {
  KeyframeId at;
  KeyframeId other;
  Pose T_at_other;
};

/// Median over the pairs that share walls; NaN where they are too few.
double median_distance(const std::vector<Beside>& pairs, const KeyframeClouds& clouds,
                       unsigned threads) {
  std::vector<WallDistance> walls(pairs.size());
  parallel_for(pairs.size(), threads, [&](std::size_t i) {
    walls[i] = wall_distance(structure_of(clouds, pairs[i].other, pairs[i].T_at_other),
                             structure_of(clouds, pairs[i].at, Pose{}), kQueries);
  });
  std::vector<double> distances;
  for (const WallDistance& of_pair : walls) {
    if (of_pair.points >= kFewestPoints) distances.push_back(of_pair.p90_m);
  }
  if (distances.size() < kFewestPairs) return std::numeric_limits<double>::quiet_NaN();
  return median(std::span(distances));
}

/// Each with the last keyframe before it that is `away_m` from it, or the first one of a few.
std::vector<Beside> with_those_before(const std::vector<KeyframeId>& keyframes,
                                      const std::vector<double>& away_m,
                                      std::span<const Pose> T_session_keyframe) {
  constexpr std::size_t kMostBefore = 8;
  std::vector<Beside> pairs;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const KeyframeId& at = keyframes[i];
    if (at.keyframe == 0) continue;
    const auto moved = [&](std::size_t k) {
      return T_session_keyframe[at.keyframe].inverse() * T_session_keyframe[k];
    };
    std::size_t before = at.keyframe - 1;
    while (before > 0 && at.keyframe - before < kMostBefore &&
           moved(before).translation.norm() < away_m[i]) {
      --before;
    }
    pairs.push_back({at, {at.session, before}, moved(before)});
  }
  return pairs;
}

}  // namespace

PlacementWalls compare_walls(const Placement& placement, const KeyframeClouds& clouds,
                             unsigned threads) {
  std::vector<Beside> loops;
  std::vector<KeyframeId> queries;
  std::vector<KeyframeId> matches;
  std::vector<double> away_m;
  const std::size_t count = std::min(placement.loops.size(), kLoops);
  for (std::size_t i = 0; i < count; ++i) {
    const LoopConstraint& loop = placement.loops[i * placement.loops.size() / count];
    loops.push_back({loop.match, loop.query, loop.T_match_query});
    queries.push_back(loop.query);
    matches.push_back(loop.match);
    away_m.push_back(loop.T_match_query.translation.norm());
  }
  PlacementWalls walls;
  walls.between_m = median_distance(loops, clouds, threads);
  const double of_query = median_distance(
      with_those_before(queries, away_m, placement.T_query_session_keyframe), clouds, threads);
  const double of_match = median_distance(
      with_those_before(matches, away_m, placement.T_match_session_keyframe), clouds, threads);
  walls.within_m = std::fmax(of_query, of_match);
  return walls;
}

}  // namespace unimapper::merge
