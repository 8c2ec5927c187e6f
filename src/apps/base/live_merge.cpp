#include "src/apps/base/live_merge.hpp"

#include <algorithm>
#include <utility>

#include "src/apps/base/due_map_poses.hpp"
#include "src/apps/base/map_pose_message.hpp"
#include "src/merge/localisation/newest_map_poses.hpp"

namespace unimapper::apps {

namespace {

constexpr std::chrono::milliseconds kPause{500};
constexpr std::chrono::seconds kAfterFailure{10};

std::size_t connected_sessions(const merge::MergeResult& result) {
  return static_cast<std::size_t>(
      std::count_if(result.sessions.begin(), result.sessions.end(),
                    [](const merge::MergedSession& s) { return merge::is_in_map(s.status); }));
}

}  // namespace

LiveMerge::LiveMerge(LiveMergeOptions options, const store::StoreLock& held)
    : options_(std::move(options)), writer_(options_.store, held), follower_(options_.store) {
  look(Clock::time_point{});
  for (auto& [row, session] : sessions_) session.is_live = false;
  has_history_ = !sessions_.empty();
}

void LiveMerge::advance(const std::function<Clock::time_point()>& now) {
  const Clock::time_point start = now();
  has_changed_ = follower_.has_changed() || has_changed_;
  if (has_changed_) look(start);
  has_changed_ = false;
  forget_over(start);
  if (!has_waiting()) merged_up_to_ = start;
  if (start >= next_ && (has_waiting() || has_more_)) merge(start, now);
}

void LiveMerge::finish(const std::function<Clock::time_point()>& now) {
  next_ = {};
  const Clock::time_point start = now();
  if (follower_.has_changed()) look(start);
  if (has_waiting()) merge(start, now);
  if (epoch_ != 0) merge_all(now);
}

void LiveMerge::look(Clock::time_point now) {
  for (const store::SessionExtent& extent : follower_.sessions()) {
    Growth& session = sessions_[extent.row];
    session.id = extent.id;
    session.ended = extent.ended;
    if (session.keyframes == extent.keyframes) continue;
    session.keyframes = extent.keyframes;
    session.is_live = true;
    session.grown = now;
  }
}

bool LiveMerge::has_waiting() const {
  return std::any_of(sessions_.begin(), sessions_.end(), [](const auto& session) {
    return session.second.keyframes != session.second.merged;
  });
}

void LiveMerge::merge(Clock::time_point start, const std::function<Clock::time_point()>& now) {
  const bool has_grown = has_waiting();
  next_ = start + kAfterFailure;
  const store::ProjectState state = writer_.current();
  if (!state.sessions.empty()) {
    const ProjectResult merge = merge_growth(state);
    if (!take({merge, held_->sessions(), held_->rows()}, state.epoch.number)) {
      next_ = now() + kPause;
      return;
    }
    counters_.growths += has_grown ? 1 : 0;
    has_more_ = growing_->has_more();
  }
  // Also those of removed sessions. What has arrived meanwhile is merged once more.
  for (auto& [row, session] : sessions_) session.merged = session.keyframes;
  const Clock::time_point end = now();
  counters_.longest_merge = std::max(counters_.longest_merge, end - start);
  if (has_grown) {
    counters_.longest_effect = std::max(counters_.longest_effect, end - merged_up_to_);
  }
  merged_up_to_ = start;
  next_ = end + kPause;
}

/// What the store held before the base began is merged with all loops; so is what takes the place
/// of sessions that are gone.
ProjectResult LiveMerge::merge_growth(const store::ProjectState& state) {
  if (held_ != nullptr && !held_->are_in(state.sessions)) {
    growing_.reset();
    held_.reset();
  }
  bool is_first = false;
  if (held_ == nullptr) {
    is_first = has_history_;
    held_ = std::make_unique<HeldSessions>(options_.store, options_.config.kept_bytes());
    growing_ = std::make_unique<merge::GrowingMerge>(held_->sessions(), options_.config);
  }
  held_->refresh(state.sessions);
  const KeyframeRows rows(held_->rows(), held_->sessions());
  return merge_held(writer_, state, rows, options_.config, central_,
                    [&](const merge::UserStatements& said, merge::LoopOutcomes& outcomes) {
                      return is_first ? growing_->merge_all(said, &outcomes)
                                      : growing_->merge_newest(said, &outcomes);
                    });
}

void LiveMerge::merge_all(const std::function<Clock::time_point()>& now) {
  growing_.reset();
  held_.reset();
  const Clock::time_point start = now();
  const store::ProjectState state = writer_.current();
  if (state.sessions.empty()) return;
  const ProjectMerge merge =
      merge_stored(writer_, options_.store, state, options_.config, {}, central_);
  if (!take({merge, merge.sessions, merge.rows}, state.epoch.number)) {
    return options_.report("the map has changed meanwhile; `unimapper map merge` merges it anew");
  }
  counters_.complete = now() - start;
  options_.report("everything anew: " + merge.verified);
}

bool LiveMerge::take(const Merged& merge, std::int64_t merged_epoch) {
  if (!keep(merge.project, merged_epoch)) return false;
  fix_frame(merge);
  tell(merge);
  report_states(merge);
  ++counters_.merges;
  return true;
}

/// What a person has said is an epoch of its own, and stays; what was said during the merge takes
/// part in the next one.
bool LiveMerge::keep(const ProjectResult& merge, std::int64_t merged_epoch) {
  if (writer_.current().epoch.number != merged_epoch) return false;
  const bool is_own = epoch_ != 0 && epoch_ == merged_epoch;
  const auto change = [&](store::ProjectState& next) -> std::optional<std::string> {
    if (!is_own && next.epoch.parent != merged_epoch) return std::nullopt;
    next.epoch.result = writer_.keep(merge.stored);
    return merge.outcome;
  };
  const std::optional<store::Epoch> epoch =
      is_own ? writer_.replace(epoch_, change) : writer_.commit("base --merge", change);
  if (epoch) epoch_ = epoch->number;
  return epoch.has_value();
}

void LiveMerge::fix_frame(const Merged& merge) {
  const merge::MergeResult& result = merge.project.result;
  if (connected_sessions(result) >= 2) central_ = merge.rows[result.central_session];
}

void LiveMerge::tell(const Merged& merge) {
  const std::vector<merge::MapPose> newest =
      merge::newest_map_poses(merge.sessions, merge.project.result, options_.config.odometry);
  for (std::size_t s = 0; s < merge.sessions.size(); ++s) {
    const auto growth = sessions_.find(merge.rows[s]);
    if (growth == sessions_.end() || !growth->second.is_live) continue;
    const KeyframeRecord& keyframe = merge.sessions[s].keyframes.back();
    options_.answered(map_pose_message(newest[s], epoch_, growth->second.id, keyframe.sequence,
                                       keyframe.scans[keyframe.reference_scan].stamp_ns));
  }
}

/// Where a session's state or the reason for it has changed.
void LiveMerge::report_states(const Merged& merge) {
  std::string states;
  for (std::size_t s = 0; s < merge.sessions.size(); ++s) {
    const merge::MergedSession& merged = merge.project.result.sessions[s];
    states += merge.sessions[s].info.name + merge::status_name(merged.status) + merged.reason;
  }
  if (states != states_) {
    options_.report("epoch " + std::to_string(epoch_) + ": " + merge.project.outcome);
  }
  states_ = std::move(states);
}

void LiveMerge::forget_over(Clock::time_point now) {
  for (auto& [row, session] : sessions_) {
    if (!session.is_live || session.keyframes != session.merged) continue;
    const auto quiet = now - session.grown;
    if (quiet <
        (session.ended ? Clock::duration(kToldAfterEnd) : Clock::duration(kToldWithoutKeyframe))) {
      continue;
    }
    session.is_live = false;
    options_.forgotten(session.id);
  }
}

}  // namespace unimapper::apps
