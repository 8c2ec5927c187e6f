#include "unimapper/merge/merger.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <stdexcept>
#include <utility>

#include "central_score.hpp"
#include "changes.hpp"
#include "keyframe_clouds.hpp"
#include "loop_search.hpp"
#include "loop_verifier.hpp"
#include "parallel.hpp"
#include "radius_search.hpp"
#include "unified_map.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {
namespace {

void check(const SessionData& session) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("session " + session.info.name + ": " + why);
  };
  // Names become file names.
  const std::string& name = session.info.name;
  if (name.empty() || name == "." || name == ".." || name.size() > 200 ||
      std::any_of(name.begin(), name.end(),
                  [](char c) { return c == '/' || (c >= 0 && c < 32); })) {
    throw std::invalid_argument("a session's name cannot be a file name");
  }
  if (session.keyframes.size() > 65534) refuse("more than 65534 keyframes");
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    const KeyframeRecord& keyframe = session.keyframes[k];
    const std::string which = "keyframe " + std::to_string(keyframe.sequence);
    if (!keyframe.T_odometry_keyframe.is_rigid()) refuse(which + " has no valid pose");
    if (k > 0 && keyframe.sequence <= session.keyframes[k - 1].sequence) {
      refuse(which + " is out of order");
    }
    if (keyframe.scans.empty() || keyframe.reference_scan >= keyframe.scans.size()) {
      refuse(which + " has no reference scan");
    }
    for (const auto& scan : keyframe.scans) {
      if (!scan.T_odometry_sensor.is_rigid()) refuse(which + " has a scan without a valid pose");
    }
  }
}

class Merger {
 public:
  Merger(const std::vector<SessionData>& sessions, const MergeConfig& config,
         const std::function<void(const std::string&)>& progress)
      : sessions_(sessions),
        config_(config),
        progress_(progress),
        clouds_(sessions, config.registration, config.threads) {}

  MergeResult run() {
    own_loops();
    loops_between();
    align();
    refine();
    place_sessions();
    refine_cells();
    record_loops();
    build_map();
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;

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

  /// Verifies proposals and remembers all of them; confirmed ones go to the pose graph.
  std::size_t take(const std::vector<LoopProposal>& proposals, const CorrectionLimit& limit) {
    std::vector<VerifiedLoop> verified = verify_loops(proposals, limit, clouds_, config_);
    std::size_t confirmed = 0;
    for (std::size_t i = 0; i < proposals.size(); ++i) {
      confirmed += verified[i].confirmed ? 1 : 0;
      if (verified[i].confirmed) {
        constraint_of_.push_back(constraints_.size());
        constraints_.push_back(verified[i].constraint);
      } else {
        constraint_of_.push_back(kRefused);
      }
      proposals_.push_back(proposals[i]);
      verified_.push_back(std::move(verified[i]));
    }
    return confirmed;
  }

  [[nodiscard]] CorrectionLimit descriptor_limit() const {
    return {config_.loops.max_correction_m, config_.loops.max_correction_rad};
  }

  void own_loops() {
    begin("loops within sessions");
    const auto proposals = propose_own_loops(sessions_, config_.loops, config_.threads);
    const std::size_t confirmed = take(proposals, descriptor_limit());
    scores_ = central_scores(sessions_, verified_);
    end(std::to_string(confirmed) + " of " + std::to_string(proposals.size()) + " confirmed");
  }

  void loops_between() {
    begin("loops between sessions");
    const auto proposals = propose_loops_between(sessions_, config_.loops);
    const std::size_t confirmed = take(proposals, descriptor_limit());
    by_descriptor_ = proposals_.size();
    end(std::to_string(confirmed) + " of " + std::to_string(proposals.size()) + " confirmed");
  }

  void align() {
    begin("alignment of maps");
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      AlignmentSession session;
      session.central_score = scores_[s];
      for (const auto& keyframe : sessions_[s].keyframes) {
        session.T_odometry_keyframe.push_back(keyframe.T_odometry_keyframe);
      }
      alignment_sessions_.push_back(std::move(session));
    }
    alignment_ = align_sessions(alignment_sessions_, constraints_, config_);
    std::size_t connected = 0;
    for (const bool c : alignment_.connected) connected += c ? 1 : 0;
    end(std::to_string(connected) + " of " + std::to_string(sessions_.size()) +
        " sessions connected");
  }

  void refine() {
    begin("refinement of poses");
    std::vector<LoopConstraint> known;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      if (alignment_.verdicts[i].accepted) known.push_back(constraints_[i]);
    }
    const auto proposals = propose_radius_loops(sessions_, alignment_, known, config_);
    const std::size_t confirmed =
        take(proposals, {config_.radius.max_correction_m, config_.radius.max_correction_rad});
    alignment_ = refine_alignment(alignment_, alignment_sessions_, constraints_, config_);
    end(std::to_string(confirmed) + " of " + std::to_string(proposals.size()) +
        " near pairs confirmed");
  }

  void place_sessions() {
    result_.central_session = alignment_.central;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      MergedSession merged;
      merged.reason = alignment_.reason[s];
      if (alignment_.connected[s]) {
        merged.status = s == alignment_.central ? SessionStatus::kCentral : SessionStatus::kMerged;
        merged.T_map_session = alignment_.T_map_session[s];
      }
      for (const Pose& pose : alignment_.T_session_keyframe[s]) {
        merged.T_map_keyframe.push_back(merged.T_map_session * pose);
      }
      result_.sessions.push_back(std::move(merged));
    }
  }

  /// Refinement happens after alignment: loops must not wait for it, and other visits help.
  void refine_cells() {
    begin("refinement of what is static");
    std::vector<PlacedSession> placed;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const MergedSession& merged = result_.sessions[s];
      const bool alone = merged.status == SessionStatus::kUnconnected;
      placed.push_back({&sessions_[s], merged.T_map_keyframe, alone ? s + 1 : 0});
    }
    auto refined = merge::refine(placed, config_.refinement, config_.threads);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      result_.sessions[s].refined = std::move(refined[s]);
    }
    end();
  }

  void record_loops() {
    for (std::size_t i = 0; i < proposals_.size(); ++i) {
      const bool by_descriptor = i < by_descriptor_;
      const LoopConstraint& constraint = verified_[i].constraint;
      LoopRecord record;
      record.query_session = constraint.query.session;
      record.query_keyframe = constraint.query.keyframe;
      record.match_session = constraint.match.session;
      record.match_keyframe = constraint.match.keyframe;
      record.confidence =
          static_cast<float>(by_descriptor ? proposals_[i].confidence : constraint.overlap);
      record.T_match_query_keyframe = constraint.T_match_query;
      record.reason = verified_[i].reason;
      if (constraint_of_[i] != kRefused) {
        const LoopVerdict& verdict = alignment_.verdicts[constraint_of_[i]];
        record.accepted = verdict.accepted;
        record.reason = verdict.accepted ? by_descriptor ? "descriptor" : "radius" : verdict.reason;
        if (verdict.accepted) result_.graph_edges.push_back(constraint);
      }
      result_.loops.push_back(std::move(record));
    }
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      const auto& odometry = alignment_sessions_[s].T_odometry_keyframe;
      const SessionPath path(odometry, config_.odometry);
      for (std::size_t k = 1; k < odometry.size(); ++k) {
        LoopConstraint edge;
        edge.match = {s, k - 1};
        edge.query = {s, k};
        edge.T_match_query = odometry[k - 1].inverse() * odometry[k];
        edge.information = path.information(k - 1, k);
        edge.overlap = 1.0;
        result_.graph_edges.push_back(edge);
      }
    }
  }

  void build_map() {
    begin("unified map");
    std::vector<SessionVoxels> voxels(sessions_.size());
    std::vector<SessionVoxels> removed(sessions_.size());
    std::vector<const SessionVoxels*> part(sessions_.size(), nullptr);
    parallel_for(sessions_.size(), config_.threads, [&](std::size_t s) {
      if (!alignment_.connected[s]) return;
      const MergedSession& merged = result_.sessions[s];
      voxels[s] = voxelise(sessions_[s], merged, config_.map.voxel_size_m, CellKind::kStatic);
      removed[s] = voxelise(sessions_[s], merged, config_.map.voxel_size_m, CellKind::kDynamic);
    });
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (!alignment_.connected[s]) continue;
      part[s] = &voxels[s];
      for (std::uint32_t i = 0; i < removed[s].voxels.size(); ++i) {
        result_.dynamic_points.push_back(removed[s].position(i));
      }
    }
    result_.map = unite(part);
    end(std::to_string(result_.map.size()) + " points");
    begin("changes between sessions");
    result_.changes = find_changes(sessions_, result_.sessions, part, config_);
    end(std::to_string(result_.changes.size()) + " points");
  }

  static constexpr std::size_t kRefused = static_cast<std::size_t>(-1);

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  const std::function<void(const std::string&)>& progress_;
  KeyframeClouds clouds_;
  MergeResult result_;
  Clock::time_point started_;
  std::string stage_;

  // Every proposal, what alignment made of it, and where it stands among the constraints.
  std::vector<LoopProposal> proposals_;
  std::vector<VerifiedLoop> verified_;
  std::vector<std::size_t> constraint_of_;
  std::vector<LoopConstraint> constraints_;
  std::size_t by_descriptor_ = 0;  // the first so many proposals came from descriptors

  std::vector<double> scores_;
  std::vector<AlignmentSession> alignment_sessions_;
  Alignment alignment_;
};

}  // namespace

MergeResult merge_sessions(const std::vector<SessionData>& sessions, const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress) {
  if (const std::string wrong = config.validate(); !wrong.empty()) {
    throw std::invalid_argument(wrong);
  }
  if (sessions.size() > 65534) throw std::invalid_argument("more than 65534 sessions");
  std::set<std::string> names;
  for (const auto& session : sessions) {
    check(session);
    if (!names.insert(session.info.name).second) {
      throw std::invalid_argument("two sessions are named " + session.info.name);
    }
  }
  return Merger(sessions, config, progress).run();
}

}  // namespace unimapper::merge
