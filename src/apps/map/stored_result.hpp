// Results of merges as a store keeps them, and back.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "ports/store/project.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Rows and numbers in the store of the sessions and keyframes of a merge, and back.
class KeyframeRows {
 public:
  /// `rows`: of the sessions in the store; these must outlive it.
  KeyframeRows(std::vector<std::int64_t> rows, const std::vector<SessionData>& sessions)
      : sessions_(sessions), rows_(std::move(rows)) {}
  /// The rows of `inputs`, whose data are `sessions` now; these must outlive it.
  KeyframeRows(const std::vector<InputSession>& inputs, const std::vector<SessionData>& sessions);

  [[nodiscard]] const std::vector<SessionData>& sessions() const { return sessions_; }
  [[nodiscard]] std::int64_t session(std::size_t index) const { return rows_[index]; }
  [[nodiscard]] store::KeyframeRow row(KeyframeId k) const {
    return {rows_[k.session], sessions_[k.session].keyframes[k.keyframe].sequence};
  }
  [[nodiscard]] std::optional<std::uint32_t> index(std::int64_t session) const;
  [[nodiscard]] std::optional<KeyframeId> find(const store::KeyframeRow& keyframe) const;

 private:
  const std::vector<SessionData>& sessions_;
  std::vector<std::int64_t> rows_;
};

/// A loop of a merge as the store has it.
store::LoopResult to_stored(const merge::LoopConstraint& loop, const KeyframeRows& rows);
/// A loop of the store between two keyframes of a merge.
merge::LoopConstraint from_stored(const store::LoopResult& stored, KeyframeId query,
                                  KeyframeId match);

/// What the store keeps of a merge.
store::MapResult to_stored(const merge::MergeResult& result, const KeyframeRows& rows,
                           const merge::MergeConfig& config);
/// The sessions, poses, loops and pairs of a stored result, for `merge::complete_merge`. Throws
/// std::runtime_error where the store lacks what the result names.
merge::MergeResult posed_result(const store::MapResult& stored, const KeyframeRows& rows);

}  // namespace unimapper::apps
