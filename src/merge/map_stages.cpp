// Labels, map and changes of a merge whose poses are known.
#include "src/merge/map_stages.hpp"

#include <iomanip>
#include <memory>
#include <sstream>
#include <utility>

#include "src/merge/graph/position_sigma.hpp"
#include "src/merge/map/changes.hpp"
#include "src/merge/map/intensity_scale.hpp"
#include "src/merge/map/unified_map.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/refinement.hpp"

namespace unimapper::merge {
namespace {

class MapStages {
 public:
  MapStages(const std::vector<SessionData>& sessions, MergeResult posed, const MergeConfig& config,
            const std::function<void(const std::string&)>& progress,
            const std::filesystem::path& scratch)
      : sessions_(sessions),
        config_(config),
        result_(std::move(posed)),
        stages_(progress, result_.timing) {
    if (!scratch.empty()) scratch_ = std::make_shared<ScratchFile>(scratch);
  }

  MergeResult run() {
    refine_labels();
    record_edges();
    find_uncertainty();
    build_map();
    find_changed_points();
    return std::move(result_);
  }

 private:
  /// After alignment, because keyframes of other sessions contribute.
  void refine_labels() {
    stages_.begin("refinement of labels");
    std::vector<PosedSession> posed;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const MergedSession& merged = result_.sessions[s];
      const bool alone = !is_in_map(merged.status);
      posed.push_back({&sessions_[s], merged.T_map_keyframe, alone ? s + 1 : 0});
    }
    auto refined = merge::refine(posed, config_.refinement, config_.threads);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      result_.sessions[s].refined = std::move(refined[s]);
    }
    stages_.end();
  }

  /// The accepted loops, then odometry.
  void record_edges() {
    for (const LoopConstraint& loop : result_.loops) {
      if (!loop.decision.accepted) continue;
      result_.graph_edges.push_back(loop);
      result_.graph_edges.back().decision.reason.clear();
    }
    for (std::size_t s = 0; s < sessions_.size(); ++s) record_odometry(s);
  }

  void record_odometry(std::size_t session) {
    const SessionPath path = odometry_of(sessions_[session], config_.odometry);
    for (std::size_t k = 1; k < path.size(); ++k) {
      LoopConstraint edge;
      edge.match = {session, k - 1};
      edge.query = {session, k};
      edge.T_match_query = path[k - 1].inverse() * path[k];
      edge.information = path.information(k - 1, k);
      edge.overlap = 1.0;
      result_.graph_edges.push_back(edge);
    }
  }

  void build_map() {
    stages_.begin("unified map");
    voxels_.resize(sessions_.size());
    result_.dynamic_points = ExternalVector<Eigen::Vector3f>(scratch_);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!is_connected(s)) continue;
      LabelledVoxels voxels = voxelise(sessions_[s], result_.sessions[s], config_.map.voxel_size_m,
                                       config_.threads, scratch_);
      voxels.dynamic.visit([&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
        result_.dynamic_points.push_back(voxel.position(key, config_.map.voxel_size_m));
      });
      voxels_[s] = std::move(voxels.fixed);
    }
    const std::vector<float> factors = intensity_factors(connected_voxels());
    result_.map = unite(connected_voxels(), scratch_, factors);
    stages_.end(std::to_string(result_.map.size()) + " points" + text_of(factors));
  }

  /// Names the sessions whose intensities are of another scale.
  [[nodiscard]] std::string text_of(const std::vector<float>& intensity_factors) const {
    std::string text;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (intensity_factors[s] == 1.0F) continue;
      std::ostringstream factor;
      factor << std::setprecision(2) << intensity_factors[s];
      text += "; intensities of " + sessions_[s].info.name + " times " + factor.str() +
              ", to the scale of the others";
    }
    return text;
  }

  void find_uncertainty() {
    std::vector<std::vector<double>> sigmas_m =
        position_sigmas_m(sessions_, result_, config_.odometry);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      result_.sessions[s].position_sigma_m = std::move(sigmas_m[s]);
    }
  }

  void find_changed_points() {
    stages_.begin("changes between sessions");
    Changes changes = find_changes(sessions_, result_.sessions, connected_voxels(), config_);
    result_.changes = std::move(changes.points);
    result_.changed_objects = std::move(changes.objects);
    stages_.end(std::to_string(result_.changed_objects.size()) + " objects, " +
                std::to_string(result_.changes.size()) + " points");
  }

  [[nodiscard]] bool is_connected(std::size_t session) const {
    return is_in_map(result_.sessions[session].status);
  }

  /// Voxels by session; null for sessions that are not connected.
  [[nodiscard]] std::vector<const SessionVoxels*> connected_voxels() const {
    std::vector<const SessionVoxels*> connected(sessions_.size(), nullptr);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (is_connected(s)) connected[s] = &voxels_[s];
    }
    return connected;
  }

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  MergeResult result_;
  StageTimes stages_;
  std::shared_ptr<ScratchFile> scratch_;  ///< null: voxels and map stay in memory
  std::vector<SessionVoxels> voxels_;
};

}  // namespace

MergeResult finish_map(const std::vector<SessionData>& sessions, MergeResult posed,
                       const MergeConfig& config,
                       const std::function<void(const std::string&)>& progress,
                       const std::filesystem::path& scratch) {
  return MapStages(sessions, std::move(posed), config, progress, scratch).run();
}

}  // namespace unimapper::merge
