// Stages of a merge, from loop search to the unified map (paper section VI).
#include "unimapper/merge/merger.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "central_score.hpp"
#include "changes.hpp"
#include "keyframe_clouds.hpp"
#include "loop_search.hpp"
#include "map_level.hpp"
#include "parallel.hpp"
#include "person_links.hpp"
#include "placement_check.hpp"
#include "radius_search.hpp"
#include "seen_extent.hpp"
#include "session_check.hpp"
#include "session_path.hpp"
#include "unified_map.hpp"
#include "unimapper/merge/alignment.hpp"
#include "verified_loops.hpp"

namespace unimapper::merge {
namespace {

class Merger {
 public:
  Merger(const std::vector<SessionData>& sessions, const MergeConfig& config,
         const std::function<void(const std::string&)>& progress, const UserStatements& statements,
         LoopOutcomes* outcomes = nullptr)
      : sessions_(sessions),
        config_(config),
        progress_(progress),
        statements_(statements),
        clouds_(sessions, config.registration, config.threads),
        known_(sessions, config, statements_, outcomes) {}

  MergeResult run() {
    find_poses();
    refine_labels();
    return finish();
  }

  /// Without labels, map and changes.
  MergeResult run_to_poses() {
    find_poses();
    return std::move(result_);
  }

  /// The rest of a merge whose poses and loops are known.
  MergeResult complete(MergeResult posed) {
    result_ = std::move(posed);
    refine_labels();
    return finish();
  }

 private:
  using Clock = std::chrono::steady_clock;

  void find_poses() {
    find_intra_session_loops();
    find_inter_session_loops();
    align();
    refine_poses();
    level_map();
    transform_sessions();
    record_loops();
  }

  MergeResult finish() {
    record_edges();
    build_map();
    find_changed_points();
    return std::move(result_);
  }

  void begin(const std::string& stage) {
    if (progress_) progress_(stage);
    started_ = Clock::now();
    stage_ = stage;
  }
  void end(const std::string& outcome = {}) {
    const std::chrono::duration<double> elapsed = Clock::now() - started_;
    result_.timing.push_back({stage_, elapsed.count()});
    if (progress_ && !outcome.empty()) progress_(outcome);
  }

  /// Verifies candidates; all of them are recorded, and those verified go to the pose graph.
  /// Returns the outcome in words.
  std::string verify(const std::vector<LoopCandidate>& candidates, const CorrectionLimit& limit) {
    return take(known_.verify(candidates, limit, clouds_));
  }

  std::string take(std::vector<LoopConstraint> loops) {
    std::size_t verified = 0;
    for (LoopConstraint& loop : loops) {
      if (loop.decision.accepted) {
        ++verified;
        recorded_as_.push_back(result_.loops.size());
        constraints_.push_back(loop);
      }
      result_.loops.push_back(std::move(loop));
    }
    return std::to_string(verified) + " of " + std::to_string(loops.size()) +
           " candidates verified";
  }

  [[nodiscard]] CorrectionLimit descriptor_limit() const {
    return {config_.loops.max_correction_m, config_.loops.max_correction_rad};
  }

  void find_intra_session_loops() {
    begin("intra-session loops");
    const auto candidates =
        find_intra_session_candidates(sessions_, config_.loops, config_.threads);
    const std::string outcome = verify(candidates, descriptor_limit());
    scores_ = central_scores(sessions_, result_.loops);
    end(outcome);
  }

  void find_inter_session_loops() {
    begin("inter-session loops");
    const auto candidates = find_inter_session_candidates(sessions_, config_.loops);
    const std::string outcome = verify(candidates, descriptor_limit());
    take(link_loops(statements_.links, known_, clouds_, config_));
    by_descriptor_ = result_.loops.size();
    end(outcome);
  }

  void align() {
    begin("alignment of sessions");
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      AlignmentSession session;
      session.central_score = scores_[s];
      session.extent_m = seen_extent_m(sessions_[s]);
      session.central_priority = central_priority(static_cast<std::uint32_t>(s));
      for (const auto& keyframe : sessions_[s].keyframes) {
        session.T_odometry_keyframe.push_back(keyframe.T_odometry_keyframe);
      }
      alignment_sessions_.push_back(std::move(session));
    }
    PlacementEvaluator evaluator(sessions_, clouds_, config_);
    alignment_ =
        align_sessions(alignment_sessions_, constraints_, config_,
                       [&](const Placement& placement) { return evaluator.evaluate(placement); });
    for (const std::uint32_t s : statements_.apart) {
      if (!alignment_.connected[s]) alignment_.reason[s] = kApartByPerson;
    }
    const auto connected =
        std::count(alignment_.connected.begin(), alignment_.connected.end(), true);
    end(std::to_string(connected) + " of " + std::to_string(sessions_.size()) +
        " sessions connected");
  }

  /// Sessions kept apart come last: nothing could be merged with them.
  [[nodiscard]] int central_priority(std::uint32_t session) const {
    if (statements_.keep_apart(session)) return -1;
    return statements_.reference == session ? 1 : 0;
  }

  void refine_poses() {
    begin("radius loops and refinement of poses");
    std::vector<LoopConstraint> known;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      if (alignment_.decisions[i].accepted) known.push_back(constraints_[i]);
    }
    const auto candidates = find_radius_candidates(sessions_, alignment_, known, config_);
    const std::string outcome =
        verify(candidates, {config_.radius.max_correction_m, config_.radius.max_correction_rad});
    alignment_ = refine_alignment(alignment_, alignment_sessions_, constraints_, config_);
    end(outcome);
  }

  /// Turns the map so that it is level: so far its frame is the central session's odometry frame.
  void level_map() {
    std::vector<UpObservation> observations;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      const Pose& T_map_session = alignment_.T_map_session[s];
      for (std::size_t k = 0; k < sessions_[s].keyframes.size(); ++k) {
        const Pose T_map_keyframe = T_map_session * alignment_.T_session_keyframe[s][k];
        observations.push_back({T_map_keyframe.rotation.col(2), sessions_[s].keyframes[k].up});
      }
    }
    const Pose T_level_map(levelling_rotation(observations), Eigen::Vector3d::Zero());
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      alignment_.T_map_session[s] = T_level_map * alignment_.T_map_session[s];
    }
  }

  void transform_sessions() {
    result_.pairs = alignment_.pairs;
    result_.central_session = alignment_.central;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      MergedSession merged;
      merged.reason = alignment_.reason[s];
      if (alignment_.connected[s]) {
        merged.status = s == alignment_.central ? SessionStatus::kCentral : SessionStatus::kMerged;
        merged.T_map_session = alignment_.T_map_session[s];
      } else if (is_provisional(s)) {
        merged.status = SessionStatus::kProvisional;
      }
      for (const Pose& pose : alignment_.T_session_keyframe[s]) {
        merged.T_map_keyframe.push_back(merged.T_map_session * pose);
      }
      result_.sessions.push_back(std::move(merged));
    }
  }

  /// A session that waits for what would confirm its place.
  [[nodiscard]] bool is_provisional(std::size_t session) const {
    return std::any_of(alignment_.pairs.begin(), alignment_.pairs.end(), [&](const auto& pair) {
      return pair.state == PairState::kProvisional &&
             (pair.query == session || pair.match == session);
    });
  }

  /// After alignment, because keyframes of other sessions contribute.
  void refine_labels() {
    begin("refinement of labels");
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
    end();
  }

  void record_loops() {
    for (std::size_t i = by_descriptor_; i < result_.loops.size(); ++i) {
      result_.loops[i].confidence = static_cast<float>(result_.loops[i].overlap);
    }
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      const std::size_t recorded = recorded_as_[i];
      LoopDecision& decision = result_.loops[recorded].decision;
      decision = alignment_.decisions[i];
      if (!decision.accepted) continue;
      const bool by_person = result_.loops[recorded].by_person;
      const char* by_search = recorded < by_descriptor_ ? "descriptor" : "radius";
      decision.reason = by_person ? kLinkedByPerson : by_search;
    }
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
    std::vector<Pose> odometry;
    for (const KeyframeRecord& keyframe : sessions_[session].keyframes) {
      odometry.push_back(keyframe.T_odometry_keyframe);
    }
    const SessionPath path(odometry, config_.odometry);
    for (std::size_t k = 1; k < odometry.size(); ++k) {
      LoopConstraint edge;
      edge.match = {session, k - 1};
      edge.query = {session, k};
      edge.T_match_query = odometry[k - 1].inverse() * odometry[k];
      edge.information = path.information(k - 1, k);
      edge.overlap = 1.0;
      result_.graph_edges.push_back(edge);
    }
  }

  void build_map() {
    begin("unified map");
    voxels_.resize(sessions_.size());
    std::vector<SessionVoxels> removed(sessions_.size());
    parallel_for(sessions_.size(), config_.threads, [&](std::size_t s) {
      if (!is_connected(s)) return;
      const MergedSession& merged = result_.sessions[s];
      voxels_[s] = voxelise(sessions_[s], merged, config_.map.voxel_size_m, CellKind::kStatic);
      removed[s] = voxelise(sessions_[s], merged, config_.map.voxel_size_m, CellKind::kDynamic);
    });
    for (const SessionVoxels& of_session : removed) {
      for (std::uint32_t i = 0; i < of_session.voxels.size(); ++i) {
        result_.dynamic_points.push_back(of_session.position(i));
      }
    }
    result_.map = unite(connected_voxels());
    end(std::to_string(result_.map.size()) + " points");
  }

  void find_changed_points() {
    begin("changes between sessions");
    result_.changes = find_changes(sessions_, result_.sessions, connected_voxels(), config_);
    end(std::to_string(result_.changes.size()) + " points");
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
  const std::function<void(const std::string&)>& progress_;
  const UserStatements& statements_;
  KeyframeClouds clouds_;
  KnownLoops known_;
  MergeResult result_;
  Clock::time_point started_;
  std::string stage_;

  // Loops that registration verified, and where each stands in `result_.loops`.
  std::vector<LoopConstraint> constraints_;
  std::vector<std::size_t> recorded_as_;
  std::size_t by_descriptor_ = 0;  // the first so many of `result_.loops` came from descriptors

  std::vector<double> scores_;
  std::vector<AlignmentSession> alignment_sessions_;
  Alignment alignment_;
  std::vector<SessionVoxels> voxels_;
};

void check_input(const std::vector<SessionData>& sessions, const MergeConfig& config) {
  if (const Error wrong = config.validate(); wrong.code != ErrorCode::kOk) {
    throw std::invalid_argument(wrong.message);
  }
  check_sessions(sessions);
}

}  // namespace

MergeResult merge_sessions(const std::vector<SessionData>& sessions, const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress,
                           const UserStatements& statements, LoopOutcomes* outcomes) {
  check_input(sessions, config);
  check_statements(statements, sessions);
  return Merger(sessions, config, progress, statements, outcomes).run();
}

MergeResult merge_poses(const std::vector<SessionData>& sessions, const MergeConfig& config,
                        const std::function<void(const std::string&)>& progress,
                        const UserStatements& statements, LoopOutcomes* outcomes) {
  check_input(sessions, config);
  check_statements(statements, sessions);
  return Merger(sessions, config, progress, statements, outcomes).run_to_poses();
}

MergeResult complete_merge(const std::vector<SessionData>& sessions, MergeResult posed,
                           const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress) {
  check_input(sessions, config);
  bool fits = posed.sessions.size() == sessions.size();
  for (std::size_t s = 0; fits && s < sessions.size(); ++s) {
    fits = posed.sessions[s].T_map_keyframe.size() == sessions[s].keyframes.size();
  }
  if (!fits) throw std::invalid_argument("the poses are of other sessions");
  const UserStatements none;
  return Merger(sessions, config, progress, none).complete(std::move(posed));
}

}  // namespace unimapper::merge
