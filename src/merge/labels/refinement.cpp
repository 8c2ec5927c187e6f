#include "unimapper/merge/refinement.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "cell_classification.hpp"
#include "occupied_voxels.hpp"
#include "src/merge/parallel.hpp"
#include "src/merge/sessions/keyframe_free_space.hpp"
#include "src/merge/voxel_table.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {
namespace {

/// Decoded images take memory: so many keyframes are refined before those are freed that the next
/// ones do without, fewer where many others observed them.
constexpr std::size_t kKeyframesPerBatch = 24;
constexpr std::size_t kObserversPerBatch = 80;

/// Largest log-odds of all revisits together, either way; measured.
constexpr float kMostByRevisits = 1.0F;

/// What one keyframe is evidence of.
struct Observer {
  KeyframeFreeSpace free;
  OccupiedBlocks occupied;
};
using LoadedObservers = std::map<KeyframeId, std::unique_ptr<Observer>>;

/// The keyframes whose images and cells are evidence about one: those before and after it, and
/// those of other visits.
struct Observers {
  std::vector<KeyframeId> window;
  std::vector<KeyframeId> revisits;
};

/// Ground levels of a keyframe by square metre.
class GroundHeights {
 public:
  explicit GroundHeights(const KeyframeRecord& keyframe) {
    for (const FineCell& cell : keyframe.static_cells) {
      if (cell.ground == 0) continue;
      const std::uint32_t number = table_.find_or_insert(square(cell.position));
      if (number == height_m_.size()) height_m_.push_back(cell.position.z());
      height_m_[number] = std::max(height_m_[number], cell.position.z());
    }
  }
  [[nodiscard]] bool is_within(const Eigen::Vector3f& point, float height_m) const {
    const std::uint32_t number = table_.find(square(point));
    return number != VoxelTable::kNone && point.z() < height_m_[number] + height_m;
  }

 private:
  static VoxelKey square(const Eigen::Vector3f& p) {
    return pack({floor_to_int(p.x()), floor_to_int(p.y()), 0});
  }
  VoxelTable table_;
  std::vector<float> height_m_;
};

class Refinement {
 public:
  Refinement(const std::vector<PosedSession>& sessions, const RefinementConfig& config,
             unsigned threads)
      : sessions_(sessions),
        config_(config),
        threads_(threads),
        visibility_(EvidenceDefaults::kRangeMarginM, EvidenceDefaults::kRangeMarginRelative) {}

  std::vector<std::vector<RefinedKeyframe>> run() {
    std::vector<std::vector<RefinedKeyframe>> refined(sessions_.size());
    LoadedObservers loaded;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const std::size_t count = sessions_[s].session->keyframes.size();
      refined[s].resize(count);
      for (std::size_t first = 0; first < count;) {
        const std::vector<Observers> observers = next_batch({s, first}, count);
        load(observers, loaded);
        parallel_for(observers.size(), threads_, [&](std::size_t i) {
          refined[s][first + i] = refine({s, first + i}, observers[i], loaded);
        });
        first += observers.size();
      }
    }
    return refined;
  }

 private:
  /// The observers of one keyframe and of those that follow it, at least of one.
  [[nodiscard]] std::vector<Observers> next_batch(KeyframeId first, std::size_t count) const {
    std::vector<Observers> batch;
    std::set<KeyframeId> needed;
    const std::size_t most = std::min(kKeyframesPerBatch, count - first.keyframe);
    while (batch.size() < most) {
      Observers next = select_observers({first.session, first.keyframe + batch.size()});
      needed.insert(next.window.begin(), next.window.end());
      needed.insert(next.revisits.begin(), next.revisits.end());
      if (!batch.empty() && needed.size() > kObserversPerBatch) break;
      batch.push_back(std::move(next));
    }
    return batch;
  }

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

  /// Decodes the images of those observers that are not loaded, and finds the voxels they occupy;
  /// frees all others.
  void load(const std::vector<Observers>& all, LoadedObservers& loaded) const {
    LoadedObservers needed;
    const auto need = [&](const KeyframeId& keyframe) {
      const auto [place, is_new] = needed.emplace(keyframe, nullptr);
      if (!is_new) return;
      const auto found = loaded.find(keyframe);
      if (found != loaded.end()) place->second = std::move(found->second);
    };
    for (const Observers& observers : all) {
      for (const KeyframeId& keyframe : observers.window) need(keyframe);
      for (const KeyframeId& keyframe : observers.revisits) need(keyframe);
    }
    loaded = std::move(needed);
    std::vector<LoadedObservers::value_type*> missing;
    for (auto& entry : loaded) {
      if (entry.second == nullptr) missing.push_back(&entry);
    }
    parallel_for(missing.size(), threads_, [&](std::size_t i) {
      const KeyframeId of = missing[i]->first;
      const PosedSession& posed = sessions_[of.session];
      const auto keyframe = whole_keyframe(*posed.session, of.keyframe);
      missing[i]->second = std::make_unique<Observer>(Observer{
          KeyframeFreeSpace(*keyframe, WithoutImages::kUnknown),
          OccupiedBlocks(*keyframe, posed.T_map_keyframe[of.keyframe], config_.cell_size_m)});
    });
  }

  [[nodiscard]] RefinedKeyframe refine(KeyframeId of, const Observers& observers,
                                       const LoadedObservers& loaded) const {
    // Without images of its own a keyframe keeps its online labels.
    if (loaded.at(of)->free.empty()) return {};
    const auto keyframe = whole_keyframe(*sessions_[of.session].session, of.keyframe);

    const Eigen::Vector3d origin = sessions_[of.session].T_map_keyframe[of.keyframe].translation;
    PointEvidence points;
    CellEvidence cells = gather(*keyframe, of, origin, points);
    add_evidence(observers, of, points, origin, loaded, cells);
    const std::vector<std::uint8_t> dynamic = classify_cells(cells, config_.cell_size_m);
    RefinedKeyframe refined;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (dynamic[i] != cells.was_dynamic[i]) refined.changed.push_back(cells.number[i]);
    }
    refined.changed.shrink_to_fit();
    return refined;
  }

  /// The cells of a keyframe with the evidence of their online labels, and their positions relative
  /// to `origin`, map frame.
  [[nodiscard]] CellEvidence gather(const KeyframeRecord& keyframe, KeyframeId of,
                                    const Eigen::Vector3d& origin, PointEvidence& points) const {
    const PosedSession& posed = sessions_[of.session];
    const GroundHeights ground(keyframe);
    const std::int32_t prior = in_thousandths(EvidenceDefaults::kPriorLogOdds);
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
        const bool low = cell.ground != 0 ||
                         ground.is_within(cell.position, EvidenceDefaults::kConnectingHeightM);
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
                    const Eigen::Vector3d& origin, const LoadedObservers& loaded,
                    CellEvidence& cells) const {
    const OccupiedBlocks& own = loaded.at(of)->occupied;
    OccupationCounts by_window(own);
    OccupationCounts by_revisits(own);
    for (const KeyframeId& keyframe : observers.window) {
      observe(keyframe, origin, loaded, points);
      if (!(keyframe == of)) by_window.add(loaded.at(keyframe)->occupied);
    }
    const std::vector<std::int32_t> window = points.log_odds();
    points.clear_log_odds();
    for (const KeyframeId& keyframe : observers.revisits) {
      observe(keyframe, origin, loaded, points);
      by_revisits.add(loaded.at(keyframe)->occupied);
    }
    const std::int32_t most_by_revisits = in_thousandths(kMostByRevisits);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::int32_t times = by_window.at(cells.voxel[i]);
      const std::int32_t revisits =
          points.log_odds(i) - weights_.occupied * by_revisits.at(cells.voxel[i]);
      cells.occupied[i] = static_cast<std::uint8_t>(std::min<std::int32_t>(times, UINT8_MAX));
      // What another day saw must not make something dynamic that stood here all the time.
      cells.log_odds[i] += window[i] - weights_.occupied * times +
                           std::clamp(revisits, -most_by_revisits, most_by_revisits);
    }
  }

  void observe(KeyframeId observer, const Eigen::Vector3d& origin, const LoadedObservers& loaded,
               PointEvidence& points) const {
    Pose T_map_points;
    T_map_points.translation = origin;
    const Pose& T_map_keyframe = sessions_[observer.session].T_map_keyframe[observer.keyframe];
    loaded.at(observer)->free.observe(visibility_, weights_,
                                      T_map_keyframe.inverse() * T_map_points, points.points());
  }

  const std::vector<PosedSession>& sessions_;
  const RefinementConfig& config_;
  unsigned threads_;
  VisibilityTest visibility_;
  EvidenceWeights weights_;
};

}  // namespace

std::vector<std::vector<RefinedKeyframe>> refine(const std::vector<PosedSession>& sessions,
                                                 const RefinementConfig& config, unsigned threads) {
  if (config.window > 0) return Refinement(sessions, config, threads).run();
  std::vector<std::vector<RefinedKeyframe>> same;
  same.reserve(sessions.size());
  for (const PosedSession& posed : sessions) {
    same.emplace_back(posed.session->keyframes.size());
  }
  return same;
}

}  // namespace unimapper::merge
