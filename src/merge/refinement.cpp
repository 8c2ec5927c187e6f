#include "unimapper/merge/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "cell_classification.hpp"
#include "keyframe_free_space.hpp"
#include "occupied_voxels.hpp"
#include "parallel.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {
namespace {

/// Decoded images take memory: so many keyframes are refined before they are freed.
constexpr std::size_t kKeyframesPerBatch = 64;

using FreeSpaces = std::map<KeyframeId, std::unique_ptr<KeyframeFreeSpace>>;

/// The keyframes whose images and cells are evidence about one: those before and after it, and
/// those of other visits.
struct Observers {
  std::vector<KeyframeId> window;
  std::vector<KeyframeId> revisits;

  [[nodiscard]] bool revisit(KeyframeId keyframe) const {
    return std::binary_search(revisits.begin(), revisits.end(), keyframe);
  }
};

/// Ground levels of a keyframe by square metre.
class GroundHeights {
 public:
  explicit GroundHeights(const KeyframeRecord& keyframe) {
    for (const FineCell& cell : keyframe.static_cells) {
      if (cell.ground == 0) continue;
      const auto [at, is_new] = height_.try_emplace(square(cell.position), cell.position.z());
      if (!is_new) at->second = std::max(at->second, cell.position.z());
    }
  }
  [[nodiscard]] bool is_within(const Eigen::Vector3f& point, float height_m) const {
    const auto at = height_.find(square(point));
    return at != height_.end() && point.z() < at->second + height_m;
  }

 private:
  static std::pair<int, int> square(const Eigen::Vector3f& p) {
    return {static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y()))};
  }
  std::map<std::pair<int, int>, float> height_;
};

/// The online labels.
RefinedKeyframe unrefined(const KeyframeRecord& keyframe) {
  RefinedKeyframe same;
  same.dynamic.assign(keyframe.static_cells.size(), 0);
  same.dynamic.resize(same.dynamic.size() + keyframe.dynamic_cells.size(), 1);
  return same;
}

class Refinement {
 public:
  Refinement(const std::vector<PosedSession>& sessions, const RefinementConfig& config,
             unsigned threads)
      : sessions_(sessions),
        config_(config),
        threads_(threads),
        visibility_(config.range_margin_m, config.range_margin_relative),
        weights_(EvidenceWeights::of(config)),
        most_by_revisits_(in_thousandths(config.most_by_revisits)),
        occupied_(sessions.size()) {
    parallel_for(sessions.size(), threads, [&](std::size_t s) {
      occupied_[s] = std::make_unique<OccupiedVoxels>(sessions[s], config.cell_size_m);
    });
  }

  std::vector<std::vector<RefinedKeyframe>> run() {
    std::vector<std::vector<RefinedKeyframe>> refined(sessions_.size());
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const std::size_t count = sessions_[s].session->keyframes.size();
      refined[s].resize(count);
      for (std::size_t first = 0; first < count; first += kKeyframesPerBatch) {
        const std::size_t size = std::min(kKeyframesPerBatch, count - first);
        std::vector<Observers> observers;
        for (std::size_t i = 0; i < size; ++i)
          observers.push_back(select_observers({s, first + i}));
        const FreeSpaces spaces = load(observers);
        parallel_for(size, threads_, [&](std::size_t i) {
          refined[s][first + i] = refine({s, first + i}, observers[i], spaces);
        });
      }
    }
    return refined;
  }

 private:
  [[nodiscard]] Observers select_observers(KeyframeId of) const {
    Observers observers;
    const std::size_t count = sessions_[of.session].session->keyframes.size();
    const std::size_t first = of.keyframe - std::min<std::size_t>(of.keyframe, config_.window);
    const std::size_t end = std::min<std::size_t>(count, of.keyframe + config_.window + 1);
    for (std::size_t k = first; k < end; ++k) observers.window.push_back({of.session, k});

    const Eigen::Vector3d here = sessions_[of.session].T_map_keyframe[of.keyframe].translation;
    std::vector<std::pair<double, KeyframeId>> near;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (sessions_[s].map != sessions_[of.session].map) continue;
      for (std::size_t k = 0; k < sessions_[s].T_map_keyframe.size(); ++k) {
        if (s == of.session && k >= first && k < end) continue;
        const double distance = (sessions_[s].T_map_keyframe[k].translation - here).norm();
        if (distance <= static_cast<double>(config_.reach_m)) near.push_back({distance, {s, k}});
      }
    }
    std::sort(near.begin(), near.end());
    near.resize(std::min<std::size_t>(near.size(), config_.revisits));
    for (const auto& [distance, keyframe] : near) observers.revisits.push_back(keyframe);
    std::sort(observers.revisits.begin(), observers.revisits.end());
    return observers;
  }

  /// Decodes the images of all observers.
  [[nodiscard]] FreeSpaces load(const std::vector<Observers>& all) const {
    FreeSpaces spaces;
    for (const Observers& observers : all) {
      for (const KeyframeId& keyframe : observers.window) spaces.emplace(keyframe, nullptr);
      for (const KeyframeId& keyframe : observers.revisits) spaces.emplace(keyframe, nullptr);
    }
    std::vector<FreeSpaces::value_type*> entries;
    for (auto& entry : spaces) entries.push_back(&entry);
    parallel_for(entries.size(), threads_, [&](std::size_t i) {
      const KeyframeId of = entries[i]->first;
      entries[i]->second = std::make_unique<KeyframeFreeSpace>(
          sessions_[of.session].session->keyframes[of.keyframe], WithoutImages::kUnknown);
    });
    return spaces;
  }

  [[nodiscard]] RefinedKeyframe refine(KeyframeId of, const Observers& observers,
                                       const FreeSpaces& spaces) const {
    const KeyframeRecord& keyframe = sessions_[of.session].session->keyframes[of.keyframe];
    RefinedKeyframe refined = unrefined(keyframe);
    // Without images of its own a keyframe keeps its online labels.
    if (spaces.at(of)->empty()) return refined;

    const Eigen::Vector3d origin = sessions_[of.session].T_map_keyframe[of.keyframe].translation;
    PointEvidence points;
    CellEvidence cells = gather(of, origin, points);
    add_evidence(observers, of, points, origin, spaces, cells);
    const std::vector<std::uint8_t> dynamic = classify_cells(cells, config_);
    for (std::size_t i = 0; i < cells.size(); ++i) refined.dynamic[cells.number[i]] = dynamic[i];
    return refined;
  }

  /// The cells of a keyframe with the evidence of their online labels, and their positions relative
  /// to `origin`, map frame.
  [[nodiscard]] CellEvidence gather(KeyframeId of, const Eigen::Vector3d& origin,
                                    PointEvidence& points) const {
    const PosedSession& posed = sessions_[of.session];
    const KeyframeRecord& keyframe = posed.session->keyframes[of.keyframe];
    const GroundHeights ground(keyframe);
    const std::int32_t prior = in_thousandths(config_.prior_log_odds);
    CellEvidence cells;
    std::uint32_t number = 0;
    for (const auto* list : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
      const bool was_dynamic = list == &keyframe.dynamic_cells;
      for (const FineCell& cell : *list) {
        const Eigen::Vector3d p = posed.T_map_keyframe[of.keyframe] * cell.position.cast<double>();
        const auto voxel = observed_voxel(p, config_.cell_size_m);
        const std::uint32_t own = number++;
        if (!voxel) continue;
        cells.number.push_back(own);
        cells.voxel.push_back(*voxel);
        cells.ground.push_back(cell.ground);
        const bool low =
            cell.ground != 0 || ground.is_within(cell.position, config_.connecting_height_m);
        cells.low.push_back(low ? 1 : 0);
        cells.was_dynamic.push_back(was_dynamic ? 1 : 0);
        cells.log_odds.push_back(was_dynamic ? prior : 0);
        cells.occupied.push_back(0);
        points.push_back((p - origin).cast<float>());
      }
    }
    return cells;
  }

  void add_evidence(const Observers& observers, KeyframeId of, PointEvidence& points,
                    const Eigen::Vector3d& origin, const FreeSpaces& spaces,
                    CellEvidence& cells) const {
    for (const KeyframeId& keyframe : observers.window) observe(keyframe, origin, spaces, points);
    std::vector<std::int32_t> window = points.log_odds();
    points.clear_log_odds();
    for (const KeyframeId& keyframe : observers.revisits) {
      observe(keyframe, origin, spaces, points);
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      std::int32_t revisits = points.log_odds(i);
      cells.occupied[i] = subtract_occupied(observers, of, cells.voxel[i], window[i], revisits);
      // What another day saw must not make something dynamic that stood here all the time.
      cells.log_odds[i] += window[i] + std::clamp(revisits, -most_by_revisits_, most_by_revisits_);
    }
  }

  void observe(KeyframeId observer, const Eigen::Vector3d& origin, const FreeSpaces& spaces,
               PointEvidence& points) const {
    Pose T_map_points;
    T_map_points.translation = origin;
    const Pose& T_map_keyframe = sessions_[observer.session].T_map_keyframe[observer.keyframe];
    spaces.at(observer)->observe(visibility_, weights_, T_map_keyframe.inverse() * T_map_points,
                                 points.points());
  }

  /// Subtracts from the evidence for every other keyframe that observed a voxel as occupied.
  /// Returns how many of the window did, up to 255.
  [[nodiscard]] std::uint8_t subtract_occupied(const Observers& observers, KeyframeId of,
                                               VoxelKey voxel, std::int32_t& window,
                                               std::int32_t& revisits) const {
    std::uint8_t times = 0;
    const std::size_t first = observers.window.front().keyframe;
    const std::size_t last = observers.window.back().keyframe;
    for (const std::uint32_t k : occupied_[of.session]->keyframes_at(voxel)) {
      if (k == of.keyframe) continue;
      if (k >= first && k <= last) {
        window -= weights_.occupied;
        if (times < UINT8_MAX) ++times;
      } else if (observers.revisit({of.session, k})) {
        revisits -= weights_.occupied;
      }
    }
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (s == of.session || sessions_[s].map != sessions_[of.session].map) continue;
      for (const std::uint32_t k : occupied_[s]->keyframes_at(voxel)) {
        if (observers.revisit({s, k})) revisits -= weights_.occupied;
      }
    }
    return times;
  }

  const std::vector<PosedSession>& sessions_;
  const RefinementConfig& config_;
  unsigned threads_;
  VisibilityTest visibility_;
  EvidenceWeights weights_;
  std::int32_t most_by_revisits_;  ///< thousandths
  std::vector<std::unique_ptr<OccupiedVoxels>> occupied_;
};

}  // namespace

std::vector<std::vector<RefinedKeyframe>> refine(const std::vector<PosedSession>& sessions,
                                                 const RefinementConfig& config, unsigned threads) {
  if (config.window > 0) return Refinement(sessions, config, threads).run();
  std::vector<std::vector<RefinedKeyframe>> same;
  for (const PosedSession& posed : sessions) {
    same.emplace_back();
    for (const KeyframeRecord& keyframe : posed.session->keyframes) {
      same.back().push_back(unrefined(keyframe));
    }
  }
  return same;
}

}  // namespace unimapper::merge
