// Merges of sessions that grow, one after the other.
#include "growing_merge.hpp"

#include "src/merge/loops/growing_loops.hpp"
#include "src/merge/sessions/session_check.hpp"

namespace unimapper::merge {

class GrowingMerge::State {
 public:
  State(const std::vector<SessionData>& sessions, const MergeConfig& config)
      : sessions_(sessions), config_(config), loops_(sessions_, config_) {}

  MergeResult merge(bool all, const UserStatements& statements, LoopOutcomes* outcomes) {
    check_sessions(sessions_);
    check_statements(statements, sessions_);
    loops_.take_growth(!all);
    const std::unique_ptr<LoopSource> source =
        all ? loops_.all(statements, outcomes)
            : loops_.within(GrowthBudget{}, statements, outcomes);
    return merge_poses_of(sessions_, config_, {}, statements, *source);
  }
  [[nodiscard]] bool has_more() const { return loops_.has_more(); }

 private:
  const std::vector<SessionData>& sessions_;
  const MergeConfig config_;
  GrowingLoops loops_;
};

GrowingMerge::GrowingMerge(const std::vector<SessionData>& sessions, const MergeConfig& config)
    : state_(std::make_unique<State>(sessions, config)) {}

GrowingMerge::~GrowingMerge() = default;

MergeResult GrowingMerge::merge_newest(const UserStatements& statements, LoopOutcomes* outcomes) {
  return state_->merge(false, statements, outcomes);
}

MergeResult GrowingMerge::merge_all(const UserStatements& statements, LoopOutcomes* outcomes) {
  return state_->merge(true, statements, outcomes);
}

bool GrowingMerge::has_more() const { return state_->has_more(); }

}  // namespace unimapper::merge
