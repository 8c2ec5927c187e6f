// Merges of sessions that grow, one after the other.
#pragma once

#include <memory>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Poses of sessions that grow, soon after each growth: a merge of the newest keyframes searches
/// for these alone, knows what was verified before, and verifies a bounded number of candidates;
/// the others wait for later merges. Rules of acceptance are those of `merge_poses`; a pair of
/// sessions whose placement waits for a check of sensor data is provisional until then.
/// Deterministic: the same growth in the same steps gives the same results. Not thread safe.
class GrowingMerge {
 public:
  /// `sessions` must outlive it. From merge to merge sessions may be added at the end, and their
  /// keyframes become more, whole, or others.
  GrowingMerge(const std::vector<SessionData>& sessions, const MergeConfig& config);
  ~GrowingMerge();

  /// As `merge_poses` of what is there, by the loops that are known so far and a few more. Throws
  /// as it does, and std::bad_alloc.
  [[nodiscard]] MergeResult merge_newest(const UserStatements& statements, LoopOutcomes* outcomes);
  /// As `merge_poses` of what is there, by all loops, as many as that takes; later merges know
  /// them. Throws as it does, and std::bad_alloc.
  [[nodiscard]] MergeResult merge_all(const UserStatements& statements, LoopOutcomes* outcomes);
  /// Whether `merge_newest` would verify or check more although nothing has grown.
  [[nodiscard]] bool has_more() const;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace unimapper::merge
