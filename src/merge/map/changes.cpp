#include "changes.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "changed_objects.hpp"
#include "map_regions.hpp"
#include "session_observer.hpp"
#include "src/merge/limited_cache.hpp"

namespace unimapper::merge {
namespace {

/// What its own session sees from this many times farther away tells how long something stood.
constexpr float kOwnReach = 2.0F;

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

/// The comparison of all sessions in one region of the map, and the tiles around it.
class Comparison {
 public:
  Comparison(const TileBox& region, const std::vector<std::size_t>& order,
             const std::vector<const SessionVoxels*>& voxels,
             const std::vector<SessionObserver>& observers, const MergeConfig& config)
      : region_(region),
        around_(region.grown()),
        order_(order),
        voxels_(voxels),
        observers_(observers),
        config_(config),
        structures_(config.kept_bytes()) {}

  void run(Changes& changes) {
    for (std::size_t position = 0; position < observers_.size(); ++position) {
      for (const ChangeKind kind : {ChangeKind::kAppeared, ChangeKind::kGone}) {
        add(position, kind, changes);
      }
    }
  }

 private:
  void add(std::size_t position, ChangeKind kind, Changes& changes) {
    std::vector<ComparedVoxel> compared =
        compare(position, kind == ChangeKind::kAppeared ? -1 : +1);
    // Before their own session is asked about them, which costs more.
    forget_small_groups(compared, config_.map);
    forget_transparent(position, compared);
    for (ObjectVoxels& found : group_changes(compared, config_.map)) {
      // Whatever is in two regions and around both is of that in which its centre is.
      if (!region_.contains(tile_at(found.object.box.centre))) continue;
      found.object.kind = kind;
      found.object.session = static_cast<std::uint32_t>(order_[position]);
      const auto number = static_cast<std::uint32_t>(changes.objects.size());
      for (const std::uint32_t i : found.members) {
        changes.points.push_back(
            {compared[i].position, found.object.session, kind == ChangeKind::kAppeared, number});
      }
      changes.objects.push_back(found.object);
    }
  }

  [[nodiscard]] MapTile tile_at(const Eigen::Vector3d& point) const {
    const Eigen::Array3d voxel =
        (point / static_cast<double>(config_.map.voxel_size_m)).array().floor();
    return tile_of({static_cast<std::int32_t>(voxel.x()), static_cast<std::int32_t>(voxel.y()), 0});
  }

  /// What is not ground of one session, compared with the first session in the given direction
  /// (-1: earlier, +1: later) that observed it.
  [[nodiscard]] std::vector<ComparedVoxel> compare(std::size_t position, int direction) const {
    const SessionVoxels& own = *voxels_[order_[position]];
    std::vector<ComparedVoxel> compared;
    std::vector<std::uint32_t> open;
    std::vector<Eigen::Vector3f> points;
    own.visit(around_, [&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
      if (voxel.is_ground()) return;
      open.push_back(static_cast<std::uint32_t>(compared.size()));
      points.push_back(voxel.position(key, own.voxel_size_m()));
      compared.push_back({points.back()});
    });
    for (auto other = static_cast<std::ptrdiff_t>(position) + direction;
         other >= 0 && other < static_cast<std::ptrdiff_t>(observers_.size()) && !open.empty();
         other += direction) {
      const auto at = static_cast<std::size_t>(other);
      const std::vector<Presence> presence = observers_[at].observe(points, *structure(at));
      std::size_t left = 0;
      for (std::size_t i = 0; i < open.size(); ++i) {
        compared[open[i]].presence = presence[i];
        compared[open[i]].other = static_cast<std::uint32_t>(order_[at]);
        if (presence[i] != Presence::kUnknown) continue;
        open[left] = open[i];
        points[left++] = points[i];
      }
      open.resize(left);
      points.resize(left);
    }
    return compared;
  }

  /// Nothing is known of voxels that the session they are of saw through more often than not:
  /// leaves, wire mesh, and what remained of something that moved.
  void forget_transparent(std::size_t position, std::vector<ComparedVoxel>& compared) const {
    std::vector<std::uint32_t> free;
    std::vector<Eigen::Vector3f> points;
    for (std::uint32_t i = 0; i < compared.size(); ++i) {
      if (compared[i].presence != Presence::kFree) continue;
      free.push_back(i);
      points.push_back(compared[i].position);
    }
    const std::vector<Votes> votes =
        observers_[position].vote(points, kOwnReach * config_.map.change_range_m);
    for (std::size_t i = 0; i < free.size(); ++i) {
      compared[free[i]].own = votes[i];
      if (votes[i].free > votes[i].occupied) compared[free[i]].presence = Presence::kUnknown;
    }
  }

  /// Of the session at a position of the order. Those that were used last are kept.
  [[nodiscard]] std::shared_ptr<const VoxelTrees> structure(std::size_t position) const {
    return structures_.get(
        position, [&](std::size_t at) { return structure_trees(*voxels_[order_[at]], around_); },
        [](const VoxelTrees& trees) { return trees.bytes(); });
  }

  const TileBox region_;
  const TileBox around_;
  const std::vector<std::size_t>& order_;
  const std::vector<const SessionVoxels*>& voxels_;
  const std::vector<SessionObserver>& observers_;  // in the order of time
  const MergeConfig& config_;
  mutable LimitedCache<std::size_t, VoxelTrees> structures_;
};

}  // namespace

Changes find_changes(const std::vector<SessionData>& sessions,
                     const std::vector<MergedSession>& merged,
                     const std::vector<const SessionVoxels*>& voxels, const MergeConfig& config,
                     std::size_t most_voxels) {
  Changes changes;
  const std::vector<std::size_t> order = by_time(sessions, voxels);
  if (order.size() < 2) return changes;
  std::vector<SessionObserver> observers;
  observers.reserve(order.size());
  for (const std::size_t s : order) observers.emplace_back(sessions[s], merged[s], config);
  for (const TileBox& region : map_regions(voxels, most_voxels)) {
    Comparison(region, order, voxels, observers, config).run(changes);
  }
  pair_moved(changes.objects, changes.points);
  return changes;
}

}  // namespace unimapper::merge
