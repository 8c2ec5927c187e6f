#include "changes.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "free_space_view.hpp"
#include "parallel.hpp"
#include "voxel_trees.hpp"

namespace unimapper::merge {
namespace {

enum class Testimony : std::uint8_t { kNone, kThere, kFree };

/// One session as a witness: where it had points, and what its keyframes saw as free.
class Witness {
 public:
  Witness(const SessionData& session, const MergedSession& merged, const SessionVoxels& voxels,
          const MapConfig& config, unsigned threads)
      : config_(config), trees_(points_of(voxels), config.tree_voxel_size_m) {
    views_.resize(session.keyframes.size());
    for (const auto& pose : merged.T_map_keyframe) T_keyframe_map_.push_back(pose.inverse());
    parallel_for(views_.size(), threads,
                 [&](std::size_t k) { views_[k].emplace(session.keyframes[k]); });
  }

  [[nodiscard]] Testimony ask(const Eigen::Vector3f& point) const {
    if (trees_.has_neighbor(point, config_.change_distance_m)) return Testimony::kThere;
    std::uint32_t free = 0;
    std::uint32_t occupied = 0;
    const Eigen::Vector3d p = point.cast<double>();
    const double reach = static_cast<double>(config_.change_range_m);
    for (std::size_t k = 0; k < views_.size(); ++k) {
      const Eigen::Vector3d local = T_keyframe_map_[k] * p;
      if (local.squaredNorm() > reach * reach) continue;
      const Visibility seen = views_[k]->look(local.cast<float>(), config_.free_margin_m);
      free += seen == Visibility::kFree ? 1 : 0;
      occupied += seen == Visibility::kOccupied ? 1 : 0;
    }
    return free >= config_.min_witnesses && free > 2 * occupied ? Testimony::kFree
                                                                : Testimony::kNone;
  }

 private:
  static std::vector<Eigen::Vector3f> points_of(const SessionVoxels& voxels) {
    std::vector<Eigen::Vector3f> points;
    points.reserve(voxels.voxels.size());
    for (std::uint32_t i = 0; i < voxels.voxels.size(); ++i) points.push_back(voxels.position(i));
    return points;
  }

  const MapConfig& config_;
  VoxelTrees trees_;
  std::vector<Pose> T_keyframe_map_;
  std::vector<std::optional<FreeSpaceView>> views_;
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

}  // namespace

std::vector<ChangedPoint> find_changes(const std::vector<SessionData>& sessions,
                                       const std::vector<MergedSession>& merged,
                                       const std::vector<const SessionVoxels*>& voxels,
                                       const MapConfig& config, unsigned threads) {
  const std::vector<std::size_t> order = by_time(sessions, voxels);
  if (order.size() < 2) return {};
  std::vector<std::unique_ptr<Witness>> witnesses;
  witnesses.reserve(order.size());
  for (const std::size_t s : order) {
    witnesses.push_back(
        std::make_unique<Witness>(sessions[s], merged[s], *voxels[s], config, threads));
  }
  // The first session in the given direction that can say anything.
  const auto differs = [&](std::size_t position, int direction, const Eigen::Vector3f& point) {
    for (auto other = static_cast<std::ptrdiff_t>(position) + direction;
         other >= 0 && other < static_cast<std::ptrdiff_t>(order.size()); other += direction) {
      const Testimony word = witnesses[static_cast<std::size_t>(other)]->ask(point);
      if (word != Testimony::kNone) return word == Testimony::kFree;
    }
    return false;
  };
  std::vector<ChangedPoint> changes;
  for (std::size_t position = 0; position < order.size(); ++position) {
    const SessionVoxels& own = *voxels[order[position]];
    std::vector<std::uint8_t> verdict(own.voxels.size(), 0);
    constexpr std::size_t kChunk = 4096;
    parallel_for((own.voxels.size() + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
      const std::size_t end = std::min((chunk + 1) * kChunk, own.voxels.size());
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (2 * own.voxels[i].ground > own.voxels[i].cells) continue;
        const Eigen::Vector3f point = own.position(static_cast<std::uint32_t>(i));
        verdict[i] = static_cast<std::uint8_t>((differs(position, -1, point) ? 1 : 0) |
                                               (differs(position, +1, point) ? 2 : 0));
      }
    });
    for (const bool appeared : {true, false}) {
      std::vector<ChangedPoint> kind;
      for (std::uint32_t i = 0; i < own.voxels.size(); ++i) {
        if ((verdict[i] & (appeared ? 1 : 2)) == 0) continue;
        kind.push_back({own.position(i), static_cast<std::uint16_t>(order[position]), appeared});
      }
      drop_specks(kind, config.min_cluster);
      changes.insert(changes.end(), kind.begin(), kind.end());
    }
  }
  return changes;
}

}  // namespace unimapper::merge
