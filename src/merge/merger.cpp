// Stages of a merge, from loop search to poses, and the whole of it (paper section VI).
#include "unimapper/merge/merger.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "src/merge/graph/map_level.hpp"
#include "src/merge/graph/position_sigma.hpp"
#include "src/merge/graph/site_origin.hpp"
#include "src/merge/loops/loop_acceptance.hpp"
#include "src/merge/loops/loop_source.hpp"
#include "src/merge/loops/radius_search.hpp"
#include "src/merge/loops/searched_loops.hpp"
#include "src/merge/map_stages.hpp"
#include "src/merge/registration/weak_axis.hpp"
#include "src/merge/sessions/central_score.hpp"
#include "src/merge/sessions/odometry_step.hpp"
#include "src/merge/sessions/seen_extent.hpp"
#include "src/merge/sessions/session_check.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {
namespace {

/// The heading counts as known from positions up to this standard deviation, radians.
constexpr double kKnownHeadingSigmaRad = 0.1;

/// Of a loop with a free axis, which one of the match keyframe's it is most along.
std::string unconstrained_along(const LoopConstraint& loop) {
  const auto axis = free_axis(loop.information);
  if (!axis) return {};
  Eigen::Index most = 0;
  axis->cwiseAbs().maxCoeff(&most);
  return std::string(", unconstrained along ") + "xyz"[most];
}

/// Loops, poses and what was decided on each.
class PoseMerge {
 public:
  PoseMerge(const std::vector<SessionData>& sessions, const MergeConfig& config,
            const std::function<void(const std::string&)>& progress,
            const UserStatements& statements, LoopSource& loops)
      : sessions_(sessions),
        config_(config),
        statements_(statements),
        loops_(loops),
        stages_(progress, result_.timing) {
    for (const SessionData& session : sessions) {
      against_odometry_.push_back(reason_against_odometry(session));
    }
  }

  MergeResult find_poses() {
    find_intra_session_loops();
    find_inter_session_loops();
    align();
    refine_poses();
    level_map();
    transform_sessions();
    record_loops();
    tell_unsure_positions();
    return std::move(result_);
  }

 private:
  /// All loops are recorded, and those verified go to the pose graph. Returns the outcome in words.
  std::string take(std::vector<LoopConstraint> loops) {
    std::size_t verified = 0;
    for (LoopConstraint& loop : loops) {
      if (loop.decision.accepted && !is_placed_by(loop)) loop.decision = {false, kImpossibleStep};
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

  /// A session whose odometry steps as no robot does has no place as a whole, unless a person gives
  /// it one.
  [[nodiscard]] bool is_placed_by(const LoopConstraint& loop) const {
    return loop.is_intra_session() || loop.by_person ||
           (against_odometry_[loop.query.session].empty() &&
            against_odometry_[loop.match.session].empty());
  }

  void find_intra_session_loops() {
    stages_.begin("intra-session loops");
    const std::string outcome = take(loops_.within_sessions());
    scores_ = central_scores(sessions_, result_.loops);
    stages_.end(outcome);
  }

  void find_inter_session_loops() {
    stages_.begin("inter-session loops");
    const std::string outcome = take(loops_.between_sessions());
    take(loops_.links());
    by_descriptor_ = result_.loops.size();
    stages_.end(outcome);
  }

  void align() {
    stages_.begin("alignment of sessions");
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      AlignmentSession session;
      session.central_score = scores_[s];
      session.extent_m = seen_extent_m(sessions_[s]);
      session.central_priority = central_priority(static_cast<std::uint32_t>(s));
      origins_.push_back(odometry_origin(sessions_[s]));
      for (const auto& keyframe : sessions_[s].keyframes) {
        session.T_odometry_keyframe.push_back(keyframe.T_odometry_keyframe);
        session.T_odometry_keyframe.back().translation -= origins_.back();
        session.slips.push_back(keyframe.slip);
      }
      alignment_sessions_.push_back(std::move(session));
    }
    add_positions();
    alignment_ =
        align_sessions(alignment_sessions_, constraints_, config_,
                       [&](const Placement& placement) { return loops_.evaluate(placement); });
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!against_odometry_[s].empty()) alignment_.reason[s] = against_odometry_[s];
    }
    for (const std::uint32_t s : statements_.apart) {
      if (!alignment_.connected[s]) alignment_.reason[s] = kApartByPerson;
    }
    const auto connected =
        std::count(alignment_.connected.begin(), alignment_.connected.end(), true);
    stages_.end(std::to_string(connected) + " of " + std::to_string(sessions_.size()) +
                " sessions connected");
  }

  /// Positions relative to an origin near them, and up in the frames of all sessions: known
  /// positions are compared with heights. Without positions nobody asks for up.
  void add_positions() {
    if (statements_.positions.empty()) return;
    origin_ = site_origin(statements_.positions);
    for (KnownPosition position : statements_.positions) {
      position.position -= origin_;
      alignment_sessions_[position.keyframe.session].positions.push_back(position);
    }
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      std::vector<UpObservation> observations;
      for (const KeyframeRecord& keyframe : sessions_[s].keyframes) {
        observations.push_back({keyframe.T_odometry_keyframe.rotation.col(2), keyframe.up});
      }
      alignment_sessions_[s].up = levelling_rotation(observations).transpose().col(2);
    }
  }

  /// Sessions kept apart come last: nothing could be merged with them.
  [[nodiscard]] int central_priority(std::uint32_t session) const {
    if (statements_.keep_apart(session) || !against_odometry_[session].empty()) return -1;
    return statements_.reference == session ? 1 : 0;
  }

  void refine_poses() {
    stages_.begin("radius loops and refinement of poses");
    std::vector<LoopConstraint> known;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      if (alignment_.decisions[i].accepted) known.push_back(constraints_[i]);
    }
    const auto candidates = find_radius_candidates(sessions_, alignment_, known, config_);
    const std::string outcome = take(loops_.near_each_other(candidates));
    alignment_ = refine_alignment(alignment_, alignment_sessions_, constraints_, config_);
    stages_.end(outcome);
  }

  /// Moves the map so that its frame is the site frame about the origin.
  void move_to_site() {
    const Pose T_site_map = alignment_.T_map_site->inverse();
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      alignment_.T_map_session[s] = T_site_map * alignment_.T_map_session[s];
    }
    Georeference georeference;
    georeference.origin = origin_;
    georeference.is_horizontal =
        std::any_of(alignment_.positions.begin(), alignment_.positions.end(),
                    [](const PositionOutcome& p) { return p.used && p.given.is_horizontal(); });
    if (!georeference.is_horizontal) georeference.origin.head<2>().setZero();
    const double heading_sigma_rad = 1.0 / std::sqrt(alignment_.heading_information);
    if (heading_sigma_rad <= kKnownHeadingSigmaRad) {
      georeference.heading_sigma_rad = heading_sigma_rad;
    }
    result_.georeference = georeference;
  }

  /// Turns the map about the central session's first pose so that it is level: so far its frame is
  /// that session's odometry frame, about an origin near it.
  void level_map() {
    if (alignment_.T_map_site) return move_to_site();
    if (sessions_.empty()) return;
    std::vector<UpObservation> observations;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      const Pose& T_map_session = alignment_.T_map_session[s];
      for (std::size_t k = 0; k < sessions_[s].keyframes.size(); ++k) {
        const Pose T_map_keyframe = T_map_session * alignment_.T_session_keyframe[s][k];
        observations.push_back({T_map_keyframe.rotation.col(2), sessions_[s].keyframes[k].up});
      }
    }
    const Eigen::Vector3d at =
        first_position(sessions_[alignment_.central]) - origins_[alignment_.central];
    const Eigen::Matrix3d turn = levelling_rotation(observations);
    const Pose T_level_map(turn, at - turn * at);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      alignment_.T_map_session[s] = T_level_map * alignment_.T_map_session[s];
    }
  }

  [[nodiscard]] static Pose moved_by(const Eigen::Vector3d& way) {
    return {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), way};
  }

  /// Back from the origins near the sessions' first poses.
  void transform_sessions() {
    result_.pairs = alignment_.pairs;
    for (PairOutcome& pair : result_.pairs) {
      Pose& T_match_query = pair.T_match_session_query_session;
      T_match_query =
          moved_by(origins_[pair.match]) * T_match_query * moved_by(-origins_[pair.query]);
    }
    result_.positions = alignment_.positions;
    for (PositionOutcome& position : result_.positions) position.given.position += origin_;
    result_.central_session = alignment_.central;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      MergedSession merged;
      merged.reason = alignment_.reason[s];
      merged.drift_scale = alignment_.drift_scale[s];
      if (alignment_.connected[s]) {
        merged.status = s == alignment_.central ? SessionStatus::kCentral : SessionStatus::kMerged;
        merged.T_map_session = alignment_.T_map_session[s];
      } else if (is_provisional(s)) {
        merged.status = SessionStatus::kProvisional;
      }
      const Pose T_map_near = merged.T_map_session;
      merged.T_map_session = T_map_near * moved_by(-origins_[s]);
      for (const Pose& pose : alignment_.T_session_keyframe[s]) {
        merged.T_map_keyframe.push_back(T_map_near * pose);
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
      decision.reason += unconstrained_along(result_.loops[recorded]);
    }
  }

  /// How many times as far as assumed a session's odometry drifts, by its own loops that were
  /// verified and refused.
  [[nodiscard]] double drift_told(std::size_t session) const {
    std::vector<LoopConstraint> refused;
    std::size_t accepted = 0;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      const LoopConstraint& loop = constraints_[i];
      if (!loop.is_intra_session() || loop.query.session != session) continue;
      if (alignment_.decisions[i].accepted) {
        ++accepted;
      } else {
        refused.push_back(loop);
      }
    }
    const AlignmentSession& of = alignment_sessions_[session];
    return drift_by_refused(refused, accepted, {of.T_odometry_keyframe, config_.odometry, of.slips},
                            scaled_to_extent(config_.acceptance, of.extent_m));
  }

  [[nodiscard]] bool has_positions(std::size_t session) const {
    return std::any_of(result_.positions.begin(), result_.positions.end(), [&](const auto& p) {
      return p.used && p.given.is_horizontal() && p.given.keyframe.session == session;
    });
  }

  /// Sessions with known positions are as sure as these.
  void tell_unsure_positions() {
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      double& scale = result_.sessions[s].drift_scale;
      scale = std::max(scale, drift_told(s));
    }
    const auto sigmas_m = position_sigmas_m(sessions_, result_, config_.odometry);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      std::string& reason = result_.sessions[s].reason;
      if (reason.empty() && !has_positions(s)) reason = unsure_text(sessions_[s], sigmas_m[s]);
    }
  }

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  const UserStatements& statements_;
  LoopSource& loops_;
  MergeResult result_;
  StageTimes stages_;

  // Loops that registration verified, and where each stands in `result_.loops`.
  std::vector<LoopConstraint> constraints_;
  std::vector<std::size_t> recorded_as_;
  std::size_t by_descriptor_ = 0;  // the first so many of `result_.loops` came from descriptors

  std::vector<double> scores_;
  std::vector<std::string> against_odometry_;  ///< by session; mostly empty
  std::vector<AlignmentSession> alignment_sessions_;
  Alignment alignment_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the map frame, in the site frame
  std::vector<Eigen::Vector3d> origins_;  // by session, of the poses here, in its odometry frame
};

/// Loops of a merge that is made once, with what they need.
struct Searched {
  Searched(const std::vector<SessionData>& sessions, const MergeConfig& config,
           const UserStatements& statements, LoopOutcomes* outcomes)
      : clouds(sessions, config.registration, config.threads, config.kept_bytes()),
        fingerprints(sessions, config),
        loops(sessions, config, statements, clouds, fingerprints, outcomes) {}
  KeyframeClouds clouds;
  LoopFingerprints fingerprints;
  SearchedLoops loops;
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
                           const UserStatements& statements, LoopOutcomes* outcomes,
                           const std::filesystem::path& scratch) {
  check_input(sessions, config);
  check_statements(statements, sessions);
  auto searched = std::make_unique<Searched>(sessions, config, statements, outcomes);
  MergeResult posed =
      PoseMerge(sessions, config, progress, statements, searched->loops).find_poses();
  searched.reset();  // nobody asks for loops any more, and their clouds are large
  return finish_map(sessions, std::move(posed), config, progress, scratch);
}

MergeResult merge_poses(const std::vector<SessionData>& sessions, const MergeConfig& config,
                        const std::function<void(const std::string&)>& progress,
                        const UserStatements& statements, LoopOutcomes* outcomes) {
  Searched searched(sessions, config, statements, outcomes);
  return merge_poses_of(sessions, config, progress, statements, searched.loops);
}

MergeResult merge_poses_of(const std::vector<SessionData>& sessions, const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress,
                           const UserStatements& statements, LoopSource& loops) {
  check_input(sessions, config);
  check_statements(statements, sessions);
  return PoseMerge(sessions, config, progress, statements, loops).find_poses();
}

std::string drift_text(const std::vector<SessionData>& sessions, const MergeResult& result) {
  std::string text;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const double scale = result.sessions[s].drift_scale;
    if (scale <= 1.0) continue;
    char times[64];
    std::snprintf(times, sizeof times, " drifts %.1f times as far as assumed", scale);
    text += "; odometry of " + sessions[s].info.name + times;
  }
  return text;
}

MergeResult complete_merge(const std::vector<SessionData>& sessions, MergeResult posed,
                           const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress,
                           const std::filesystem::path& scratch) {
  check_input(sessions, config);
  bool fits = posed.sessions.size() == sessions.size();
  for (std::size_t s = 0; fits && s < sessions.size(); ++s) {
    fits = posed.sessions[s].T_map_keyframe.size() == sessions[s].keyframes.size();
  }
  if (!fits) throw std::invalid_argument("the poses are of other sessions");
  return finish_map(sessions, std::move(posed), config, progress, scratch);
}

}  // namespace unimapper::merge
