#include "changes.hpp"

#include <algorithm>
#include <memory>

#include "keyframe_free_space.hpp"
#include "near_points.hpp"
#include "parallel.hpp"
#include "voxel_trees.hpp"

namespace unimapper::merge {
namespace {

/// Their observations are held at a time, one list per keyframe.
constexpr std::size_t kKeyframesPerVote = 16;

enum class Presence : std::uint8_t { kUnknown, kOccupied, kFree };

/// Keyframes that observed a point as free, and as occupied.
struct Votes {
  std::uint32_t free = 0;
  std::uint32_t occupied = 0;
};

/// One session as an observer of points of others: its own points, and its keyframes' free space.
class SessionObserver {
 public:
  SessionObserver(const SessionData& session, const MergedSession& merged,
                  const SessionVoxels& voxels, const MergeConfig& config)
      : session_(session),
        merged_(merged),
        config_(config),
        visibility_(config.map.free_margin_m, config.refinement.range_margin_relative),
        weights_(EvidenceWeights::of(config.refinement)),
        trees_(points_of(voxels), config.map.tree_voxel_size_m) {}

  /// Whether the session had something at each point, map frame. O(points x images within reach).
  [[nodiscard]] std::vector<Presence> observe(const std::vector<Eigen::Vector3f>& points) const {
    std::vector<Presence> presence(points.size(), Presence::kUnknown);
    constexpr std::size_t kChunk = 4096;
    parallel_for((points.size() + kChunk - 1) / kChunk, config_.threads, [&](std::size_t chunk) {
      const std::size_t end = std::min((chunk + 1) * kChunk, points.size());
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (trees_.has_neighbor(points[i], config_.map.change_distance_m)) {
          presence[i] = Presence::kOccupied;
        }
      }
    });
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if (presence[i] == Presence::kUnknown) open.push_back(i);
    }
    const std::vector<Votes> votes = vote(points, open);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const auto [free, occupied] = votes[i];
      if (free >= config_.map.min_observers && free > 2 * occupied) {
        presence[open[i]] = Presence::kFree;
      }
    }
    return presence;
  }

 private:
  /// What one keyframe observed of some points.
  struct Observation {
    std::vector<std::uint32_t> numbers;
    PointEvidence evidence;
  };

  [[nodiscard]] std::vector<Votes> vote(const std::vector<Eigen::Vector3f>& points,
                                        const std::vector<std::uint32_t>& open) const {
    std::vector<Votes> votes(open.size());
    const NearPoints near(points, open);
    const std::size_t count = session_.keyframes.size();
    for (std::size_t first = 0; first < count; first += kKeyframesPerVote) {
      std::vector<Observation> batch(std::min(kKeyframesPerVote, count - first));
      parallel_for(batch.size(), config_.threads,
                   [&](std::size_t i) { batch[i] = observation(first + i, points, open, near); });
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

  [[nodiscard]] Observation observation(std::size_t keyframe,
                                        const std::vector<Eigen::Vector3f>& points,
                                        const std::vector<std::uint32_t>& open,
                                        const NearPoints& near) const {
    Observation seen;
    const Pose& T_map_keyframe = merged_.T_map_keyframe[keyframe];
    const Eigen::Vector3f origin = T_map_keyframe.translation.cast<float>();
    const float reach_m = config_.map.change_range_m;
    for (const std::uint32_t number : near.around(origin, reach_m)) {
      const Eigen::Vector3f p = points[open[number]] - origin;
      if (p.squaredNorm() > reach_m * reach_m) continue;
      seen.numbers.push_back(number);
      seen.evidence.push_back(p);
    }
    if (seen.numbers.empty()) return seen;
    const KeyframeFreeSpace space(session_.keyframes[keyframe], WithoutImages::kPaintFromCells);
    Pose T_map_points;
    T_map_points.translation = origin.cast<double>();
    space.observe(visibility_, weights_, T_map_keyframe.inverse() * T_map_points,
                  seen.evidence.points());
    return seen;
  }

  static std::vector<Eigen::Vector3f> points_of(const SessionVoxels& voxels) {
    std::vector<Eigen::Vector3f> points;
    points.reserve(voxels.voxels.size());
    for (std::uint32_t i = 0; i < voxels.voxels.size(); ++i) points.push_back(voxels.position(i));
    return points;
  }

  const SessionData& session_;
  const MergedSession& merged_;
  const MergeConfig& config_;
  VisibilityTest visibility_;
  EvidenceWeights weights_;
  VoxelTrees trees_;
};

/// Sessions that take part, in the order of their first scans.
std::vector<std::size_t> by_time(const std::vector<SessionData>& sessions,
                                 const std::vector<const SessionVoxels*>& voxels) {
  std::vector<std::size_t> order;
  const auto start = [&](std::size_t s) {
    const auto& scans = sessions[s].keyframes.front().scans;
    return scans.empty() ? std::int64_t{0} : scans.front().stamp_ns;
  };
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (voxels[s] != nullptr && !sessions[s].keyframes.empty()) order.push_back(s);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return start(a) < start(b); });
  return order;
}

/// Keeps points with enough of their kind within about a metre.
void drop_specks(std::vector<ChangedPoint>& points, std::uint32_t min_cluster) {
  constexpr float kInverseCell = 2.0F;
  VoxelTable table;
  std::vector<std::uint32_t> count;
  for (const auto& point : points) {
    const std::uint32_t number =
        table.find_or_insert(pack(voxel_index(point.position, kInverseCell)));
    if (number == count.size()) count.push_back(0);
    ++count[number];
  }
  std::erase_if(points, [&](const ChangedPoint& point) {
    const VoxelIndex v = voxel_index(point.position, kInverseCell);
    std::uint32_t near = 0;
    for (int i = 0; i < 27; ++i) {
      const std::uint32_t number =
          table.find(pack({v.x + i % 3 - 1, v.y + i / 3 % 3 - 1, v.z + i / 9 - 1}));
      if (number != VoxelTable::kNone) near += count[number];
    }
    return near < min_cluster;
  });
}

/// Voxels of one session that differ from the first session in the given direction (-1: earlier,
/// +1: later) that observed them, as a mask.
std::vector<std::uint8_t> compare(const std::vector<std::unique_ptr<SessionObserver>>& observers,
                                  std::size_t position, int direction, const SessionVoxels& own) {
  std::vector<std::uint8_t> differs(own.voxels.size(), 0);
  std::vector<std::uint32_t> open;
  std::vector<Eigen::Vector3f> points;
  for (std::uint32_t i = 0; i < own.voxels.size(); ++i) {
    if (2 * own.voxels[i].ground > own.voxels[i].cells) continue;
    open.push_back(i);
    points.push_back(own.position(i));
  }
  for (auto other = static_cast<std::ptrdiff_t>(position) + direction;
       other >= 0 && other < static_cast<std::ptrdiff_t>(observers.size()); other += direction) {
    const std::vector<Presence> presence =
        observers[static_cast<std::size_t>(other)]->observe(points);
    std::size_t left = 0;
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (presence[i] == Presence::kFree) differs[open[i]] = 1;
      if (presence[i] != Presence::kUnknown) continue;
      open[left] = open[i];
      points[left++] = points[i];
    }
    open.resize(left);
    points.resize(left);
  }
  return differs;
}

}  // namespace

std::vector<ChangedPoint> find_changes(const std::vector<SessionData>& sessions,
                                       const std::vector<MergedSession>& merged,
                                       const std::vector<const SessionVoxels*>& voxels,
                                       const MergeConfig& config) {
  const std::vector<std::size_t> order = by_time(sessions, voxels);
  if (order.size() < 2) return {};
  std::vector<std::unique_ptr<SessionObserver>> observers;
  observers.reserve(order.size());
  for (const std::size_t s : order) {
    observers.push_back(
        std::make_unique<SessionObserver>(sessions[s], merged[s], *voxels[s], config));
  }
  std::vector<ChangedPoint> changes;
  for (std::size_t position = 0; position < order.size(); ++position) {
    const SessionVoxels& own = *voxels[order[position]];
    for (const bool appeared : {true, false}) {
      const std::vector<std::uint8_t> differs =
          compare(observers, position, appeared ? -1 : +1, own);
      std::vector<ChangedPoint> kind;
      for (std::uint32_t i = 0; i < own.voxels.size(); ++i) {
        if (differs[i] == 0) continue;
        kind.push_back({own.position(i), static_cast<std::uint32_t>(order[position]), appeared});
      }
      drop_specks(kind, config.map.min_cluster);
      changes.insert(changes.end(), kind.begin(), kind.end());
    }
  }
  return changes;
}

}  // namespace unimapper::merge
