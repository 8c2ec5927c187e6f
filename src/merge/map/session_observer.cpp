#include "session_observer.hpp"

#include <algorithm>

#include "src/merge/parallel.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::merge {
namespace {

/// Their observations are held at a time, one list per keyframe.
constexpr std::size_t kKeyframesPerVote = 16;
/// Edge of the voxels that have one kd-tree each, metres.
constexpr float kTreeVoxelSizeM = 10.0F;
/// Keyframes that observed free space where a point changed.
constexpr std::uint32_t kMinObservers = 2;

}  // namespace

VoxelTrees structure_trees(const SessionVoxels& voxels, const TileBox& tiles) {
  std::vector<Eigen::Vector3f> points;
  voxels.visit(tiles, [&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
    if (!voxel.is_ground()) points.push_back(voxel.position(key, voxels.voxel_size_m()));
  });
  return {points, kTreeVoxelSizeM};
}

SessionObserver::SessionObserver(const SessionData& session, const MergedSession& merged,
                                 const MergeConfig& config)
    : session_(session),
      merged_(merged),
      config_(config),
      visibility_(kFreeMarginM, EvidenceDefaults::kRangeMarginRelative) {}

std::vector<Presence> SessionObserver::observe(const std::vector<Eigen::Vector3f>& points,
                                               const VoxelTrees& structure) const {
  std::vector<Presence> presence(points.size(), Presence::kUnknown);
  constexpr std::size_t kChunk = 4096;
  parallel_for((points.size() + kChunk - 1) / kChunk, config_.threads, [&](std::size_t chunk) {
    const std::size_t end = std::min((chunk + 1) * kChunk, points.size());
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      if (structure.has_neighbor(points[i], config_.map.change_distance_m)) {
        presence[i] = Presence::kOccupied;
      }
    }
  });
  std::vector<std::uint32_t> open;
  std::vector<Eigen::Vector3f> open_points;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (presence[i] != Presence::kUnknown) continue;
    open.push_back(i);
    open_points.push_back(points[i]);
  }
  const std::vector<Votes> votes = vote(open_points, config_.map.change_range_m);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const auto [free, occupied] = votes[i];
    if (free >= kMinObservers && free > 2 * occupied) {
      presence[open[i]] = Presence::kFree;
    }
  }
  return presence;
}

std::vector<Votes> SessionObserver::vote(const std::vector<Eigen::Vector3f>& points,
                                         float reach_m) const {
  std::vector<Votes> votes(points.size());
  const NearPoints near(points);
  const std::size_t count = session_.keyframes.size();
  for (std::size_t first = 0; first < count; first += kKeyframesPerVote) {
    std::vector<Observation> batch(std::min(kKeyframesPerVote, count - first));
    parallel_for(batch.size(), config_.threads,
                 [&](std::size_t i) { batch[i] = observation(first + i, points, near, reach_m); });
    for (const Observation& seen : batch) {
      for (std::size_t i = 0; i < seen.numbers.size(); ++i) {
        const std::int32_t log_odds = seen.evidence.log_odds(i);
        votes[seen.numbers[i]].free += log_odds > 0 ? 1 : 0;
        votes[seen.numbers[i]].occupied += log_odds < 0 ? 1 : 0;
      }
    }
  }
  return votes;
}

SessionObserver::Observation SessionObserver::observation(
    std::size_t keyframe, const std::vector<Eigen::Vector3f>& points, const NearPoints& near,
    float reach_m) const {
  Observation seen;
  const Pose& T_map_keyframe = merged_.T_map_keyframe[keyframe];
  const Eigen::Vector3f origin = T_map_keyframe.translation.cast<float>();
  for (const std::uint32_t number : near.around(origin, reach_m)) {
    const Eigen::Vector3f p = points[number] - origin;
    if (p.squaredNorm() > reach_m * reach_m) continue;
    seen.numbers.push_back(number);
    seen.evidence.push_back(p);
  }
  if (seen.numbers.empty()) return seen;
  const KeyframeFreeSpace space(*whole_keyframe(session_, keyframe),
                                WithoutImages::kPaintFromCells);
  Pose T_map_points;
  T_map_points.translation = origin.cast<double>();
  space.observe(visibility_, weights_, T_map_keyframe.inverse() * T_map_points,
                seen.evidence.points());
  return seen;
}

}  // namespace unimapper::merge
