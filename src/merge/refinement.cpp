#include "unimapper/merge/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "occupied_places.hpp"
#include "parallel.hpp"
#include "settling.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "witness.hpp"

namespace unimapper::merge {
namespace {

/// Decoded images take memory: so many keyframes are judged before they are given back.
constexpr std::size_t kKeyframesAtOnce = 64;

using Witnesses = std::map<KeyframeId, std::unique_ptr<Witness>>;

/// Who judges a keyframe: its own time, and other visits.
struct Panel {
  std::vector<KeyframeId> window;
  std::vector<KeyframeId> revisits;

  [[nodiscard]] bool visits(KeyframeId keyframe) const {
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

/// What the robot decided.
RefinedKeyframe unrefined(const KeyframeRecord& keyframe) {
  RefinedKeyframe same;
  same.dynamic.assign(keyframe.static_cells.size(), 0);
  same.dynamic.resize(same.dynamic.size() + keyframe.dynamic_cells.size(), 1);
  return same;
}

class Refinement {
 public:
  Refinement(const std::vector<PlacedSession>& sessions, const RefinementConfig& config,
             unsigned threads)
      : sessions_(sessions), config_(config), threads_(threads), occupied_(sessions.size()) {
    parallel_for(sessions.size(), threads, [&](std::size_t s) {
      occupied_[s] = std::make_unique<OccupiedPlaces>(sessions[s]);
    });
  }

  std::vector<std::vector<RefinedKeyframe>> run() {
    std::vector<std::vector<RefinedKeyframe>> refined(sessions_.size());
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const std::size_t count = sessions_[s].session->keyframes.size();
      refined[s].resize(count);
      for (std::size_t first = 0; first < count; first += kKeyframesAtOnce) {
        const std::size_t size = std::min(kKeyframesAtOnce, count - first);
        std::vector<Panel> panels;
        for (std::size_t i = 0; i < size; ++i) panels.push_back(panel_of({s, first + i}));
        const Witnesses witnesses = summon(panels);
        parallel_for(size, threads_, [&](std::size_t i) {
          refined[s][first + i] = judge({s, first + i}, panels[i], witnesses);
        });
      }
    }
    return refined;
  }

 private:
  [[nodiscard]] Panel panel_of(KeyframeId of) const {
    Panel panel;
    const std::size_t count = sessions_[of.session].session->keyframes.size();
    const std::size_t first = of.keyframe - std::min<std::size_t>(of.keyframe, config_.window);
    const std::size_t end = std::min<std::size_t>(count, of.keyframe + config_.window + 1);
    for (std::size_t k = first; k < end; ++k) panel.window.push_back({of.session, k});

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
    for (const auto& [distance, keyframe] : near) panel.revisits.push_back(keyframe);
    std::sort(panel.revisits.begin(), panel.revisits.end());
    return panel;
  }

  [[nodiscard]] Witnesses summon(const std::vector<Panel>& panels) const {
    Witnesses witnesses;
    for (const Panel& panel : panels) {
      for (const KeyframeId& keyframe : panel.window) witnesses.emplace(keyframe, nullptr);
      for (const KeyframeId& keyframe : panel.revisits) witnesses.emplace(keyframe, nullptr);
    }
    std::vector<Witnesses::value_type*> entries;
    for (auto& entry : witnesses) entries.push_back(&entry);
    parallel_for(entries.size(), threads_, [&](std::size_t i) {
      const KeyframeId keyframe = entries[i]->first;
      entries[i]->second =
          std::make_unique<Witness>(sessions_[keyframe.session], keyframe.keyframe);
    });
    return witnesses;
  }

  [[nodiscard]] RefinedKeyframe judge(KeyframeId of, const Panel& panel,
                                      const Witnesses& witnesses) const {
    const KeyframeRecord& keyframe = sessions_[of.session].session->keyframes[of.keyframe];
    RefinedKeyframe refined = unrefined(keyframe);
    // A robot that does not say what it saw through is believed.
    if (!witnesses.at(of)->has_seen()) return refined;

    std::vector<Eigen::Vector3f> points;
    const Eigen::Vector3d origin = sessions_[of.session].T_map_keyframe[of.keyframe].translation;
    JudgedCells cells = gather(of, origin, points);
    add_evidence(panel, of, points, origin, witnesses, cells);
    const std::vector<std::uint8_t> dynamic = settle(cells, config_);
    for (std::size_t i = 0; i < cells.size(); ++i) refined.dynamic[cells.number[i]] = dynamic[i];
    return refined;
  }

  /// The cells of a keyframe, each with the robot's own verdict, and where they are.
  [[nodiscard]] JudgedCells gather(KeyframeId of, const Eigen::Vector3d& origin,
                                   std::vector<Eigen::Vector3f>& points) const {
    const PlacedSession& placed = sessions_[of.session];
    const KeyframeRecord& keyframe = placed.session->keyframes[of.keyframe];
    const GroundHeights ground(keyframe);
    JudgedCells cells;
    std::uint32_t number = 0;
    for (const auto* list : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
      const bool was_dynamic = list == &keyframe.dynamic_cells;
      for (const FineCell& cell : *list) {
        const Eigen::Vector3d p = placed.T_map_keyframe[of.keyframe] * cell.position.cast<double>();
        const auto place = place_of(p);
        const std::uint32_t own = number++;
        if (!place) continue;
        cells.number.push_back(own);
        cells.place.push_back(*place);
        cells.ground.push_back(cell.ground);
        const bool low =
            cell.ground != 0 || ground.is_within(cell.position, config_.connecting_height_m);
        cells.low.push_back(low ? 1 : 0);
        cells.log_odds.push_back(was_dynamic ? config_.prior_log_odds : 0.0F);
        points.push_back((p - origin).cast<float>());
      }
    }
    return cells;
  }

  void add_evidence(const Panel& panel, KeyframeId of, const std::vector<Eigen::Vector3f>& points,
                    const Eigen::Vector3d& origin, const Witnesses& witnesses,
                    JudgedCells& cells) const {
    for (const KeyframeId& keyframe : panel.window) {
      witnesses.at(keyframe)->judge(points, origin, config_, cells.log_odds);
    }
    std::vector<float> visits(points.size(), 0.0F);
    for (const KeyframeId& keyframe : panel.revisits) {
      witnesses.at(keyframe)->judge(points, origin, config_, visits);
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      count_meetings(panel, of, cells.place[i], cells.log_odds[i], visits[i]);
      // What another day saw must not make something dynamic that stood here all the time.
      cells.log_odds[i] +=
          std::clamp(visits[i], -config_.most_by_revisits, config_.most_by_revisits);
    }
  }

  /// Subtracts from the evidence for every other keyframe that met something in a place.
  void count_meetings(const Panel& panel, KeyframeId of, VoxelKey place, float& window,
                      float& visits) const {
    const std::size_t first = panel.window.front().keyframe;
    const std::size_t last = panel.window.back().keyframe;
    for (const std::uint32_t k : occupied_[of.session]->keyframes_at(place)) {
      if (k == of.keyframe) continue;
      if (k >= first && k <= last) {
        window -= config_.log_odds_occupied;
      } else if (panel.visits({of.session, k})) {
        visits -= config_.log_odds_occupied;
      }
    }
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (s == of.session || sessions_[s].map != sessions_[of.session].map) continue;
      for (const std::uint32_t k : occupied_[s]->keyframes_at(place)) {
        if (panel.visits({s, k})) visits -= config_.log_odds_occupied;
      }
    }
  }

  const std::vector<PlacedSession>& sessions_;
  const RefinementConfig& config_;
  unsigned threads_;
  std::vector<std::unique_ptr<OccupiedPlaces>> occupied_;
};

}  // namespace

std::vector<std::vector<RefinedKeyframe>> refine(const std::vector<PlacedSession>& sessions,
                                                 const RefinementConfig& config, unsigned threads) {
  if (config.window > 0) return Refinement(sessions, config, threads).run();
  std::vector<std::vector<RefinedKeyframe>> same;
  for (const PlacedSession& placed : sessions) {
    same.emplace_back();
    for (const KeyframeRecord& keyframe : placed.session->keyframes) {
      same.back().push_back(unrefined(keyframe));
    }
  }
  return same;
}

}  // namespace unimapper::merge
