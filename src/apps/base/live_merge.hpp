// Merge of the sessions in a store while they grow.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ports/store/project_writer.hpp"
#include "ports/store/session_follower.hpp"
#include "src/apps/map/held_sessions.hpp"
#include "src/apps/map/project_merge.hpp"
#include "src/merge/growing_merge.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

/// What is merged, and who is told.
struct LiveMergeOptions {
  std::filesystem::path store;  ///< folder of the store
  merge::MergeConfig config;    ///< of every merge
  /// Told where each session that goes on is in the map, after every merge.
  std::function<void(const wire::MapPoseMessage&)> answered;
  /// Told that there will be no further one.
  std::function<void(const SessionId&)> forgotten;
  /// Told in words what a person should know.
  std::function<void(const std::string&)> report;
};

/// What became of merges.
struct LiveMergeCounters {
  std::uint64_t merges = 0;  ///< that ended with an epoch
  /// Merges because of keyframes, not because of what merges before had left.
  std::uint64_t growths = 0;
  std::chrono::steady_clock::duration longest_merge{0};  ///< longest time that one merge took
  /// From the arrival of a keyframe in the store to the end of the merge that it takes part in, at
  /// most.
  std::chrono::steady_clock::duration longest_effect{0};
  std::chrono::steady_clock::duration complete{0};  ///< the merge of all in the end
};

/// Merges all sessions of a project whenever keyframes have arrived, by a bounded number of new
/// loops each time (`merge::GrowingMerge`); what is left is merged while nothing arrives. The
/// sessions stay in memory, without cells; what the store held before is merged with all loops
/// first. The results of one base are one epoch, which each merge replaces; the first
/// of them follows on the latest epoch. Once two sessions are connected the central session stays,
/// and with it the map's frame, unless people say otherwise. Not thread safe.
class LiveMerge {
 public:
  /// The clock of all times.
  using Clock = std::chrono::steady_clock;

  /// `held`: the store's lock. Throws store::StoreError.
  LiveMerge(LiveMergeOptions options, const store::StoreLock& held);

  /// Merges if keyframes have arrived since the merge before, or it has left something, half a
  /// second after its end at the earliest. Throws std::exception; what is stored stays whole, and
  /// ten seconds later the next call merges again.
  void advance(const std::function<Clock::time_point()>& now = &Clock::now);
  /// Merges what has arrived since the merge before, at once, then everything anew with all loops:
  /// as `merge_stored` with the frame that the map has.
  void finish(const std::function<Clock::time_point()>& now = &Clock::now);

  /// Totals so far.
  [[nodiscard]] const LiveMergeCounters& counters() const { return counters_; }

 private:
  /// A session of the store.
  struct Growth {
    SessionId id;
    std::uint64_t keyframes = 0;  ///< at the last look
    std::uint64_t merged = 0;     ///< keyframes that are merged
    bool ended = false;           ///< at the last look
    bool is_live = false;         ///< it has grown since the base began, and is told of
    Clock::time_point grown{};    ///< when it was seen to have grown last
  };

  void look(Clock::time_point now);
  [[nodiscard]] bool has_waiting() const;
  void merge(Clock::time_point start, const std::function<Clock::time_point()>& now);
  /// A merge with its sessions and their rows.
  struct Merged {
    const ProjectResult& project;
    const std::vector<SessionData>& sessions;
    const std::vector<std::int64_t>& rows;
  };
  [[nodiscard]] ProjectResult merge_growth(const store::ProjectState& state);
  void merge_all(const std::function<Clock::time_point()>& now);
  bool take(const Merged& merge, std::int64_t merged_epoch);
  bool keep(const ProjectResult& merge, std::int64_t merged_epoch);
  void fix_frame(const Merged& merge);
  void tell(const Merged& merge);
  void report_states(const Merged& merge);
  void forget_over(Clock::time_point now);

  LiveMergeOptions options_;
  store::ProjectWriter writer_;
  store::SessionFollower follower_;
  std::unique_ptr<HeldSessions> held_;            ///< null: nothing is merged yet
  std::unique_ptr<merge::GrowingMerge> growing_;  ///< merge of the held sessions
  bool has_more_ = false;                         ///< the latest merge has left something
  bool has_history_ = false;                      ///< the store held sessions when the base began
  bool has_changed_ = false;                      ///< the store, since the last look that succeeded
  std::map<std::int64_t, Growth> sessions_;       ///< by row
  std::int64_t epoch_ = 0;                        ///< of this base; 0: none yet
  std::optional<std::int64_t> central_;           ///< row of the session whose frame stays
  std::string states_;                            ///< of the sessions, as they were told last
  Clock::time_point next_{};                      ///< not before
  Clock::time_point merged_up_to_{};  ///< what had arrived by then takes no further merge
  LiveMergeCounters counters_;
};

}  // namespace unimapper::apps
