// Source of the loops of a merge
#pragma once

#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::merge {

/// Loops and evidence of one merge, which asks in the order of these functions. What is returned
/// was considered; what registration verified has an accepted decision.
class LoopSource {
 public:
  LoopSource() = default;
  virtual ~LoopSource() = default;
  LoopSource(const LoopSource&) = delete;
  LoopSource& operator=(const LoopSource&) = delete;

  /// Found by descriptor within each session.
  virtual std::vector<LoopConstraint> within_sessions() = 0;
  /// Found by descriptor between sessions.
  virtual std::vector<LoopConstraint> between_sessions() = 0;
  /// That people said.
  virtual std::vector<LoopConstraint> links() = 0;
  /// As `PlacementCheck`.
  virtual PlacementEvidence evaluate(const Placement& placement) = 0;
  /// Of candidates that the map's poses propose.
  virtual std::vector<LoopConstraint> near_each_other(
      const std::vector<LoopCandidate>& candidates) = 0;
};

/// `merge_poses` with loops of a source.
MergeResult merge_poses_of(const std::vector<SessionData>& sessions, const MergeConfig& config,
                           const std::function<void(const std::string&)>& progress,
                           const UserStatements& statements, LoopSource& loops);

}  // namespace unimapper::merge
