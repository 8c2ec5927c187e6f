// Localisation of robots in a stored map while their keyframes arrive in the store.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "ports/store/session_follower.hpp"
#include "src/apps/map/stored_map.hpp"
#include "unimapper/merge/localisation.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

/// What robots are localised in, and who is told.
struct LiveLocalisationOptions {
  std::filesystem::path store;  ///< folder of the store
  /// Sessions that are localised at once; each takes the memory of the map and of 400 keyframes.
  std::size_t max_sessions = 4;
  /// Reads the map, again for every session. Throws std::exception with a sentence for the user.
  std::function<StoredMap()> read_map;
  /// Told every answer about a session.
  std::function<void(const wire::MapPoseMessage&)> answered;
  /// Told that there will be no further one.
  std::function<void(const SessionId&)> forgotten;
  /// Told in words what a person should know.
  std::function<void(const std::string&)> report;
};

/// What became of keyframes.
struct LiveLocalisationCounters {
  std::uint64_t keyframes = 0;         ///< that were answered
  std::uint64_t late = 0;              ///< stored after a later one was answered; left out
  std::uint64_t unusable = 0;          ///< damaged, or no next keyframe of their session; left out
  std::uint64_t sessions_refused = 0;  ///< beyond the bound
};

/// Follows the sessions that bring new keyframes into a store and localises each in the map, in
/// order of sequence; those that arrive after a later one are left out. A session that was going on
/// before is taken up at its next keyframe, with the 400 stored last, of which nothing is said
/// until all are through. Its place is forgotten after its end, after ten minutes without a
/// keyframe, and after thirty seconds where another session needs the room. What is damaged is told
/// and left out. Not thread safe.
class LiveLocalisation {
 public:
  /// The clock of the times handed in.
  using Clock = std::chrono::steady_clock;

  /// Takes note of what is stored already. Throws store::StoreError.
  explicit LiveLocalisation(LiveLocalisationOptions options);

  /// Localises by at most four new keyframes of each session; true if more wait. The first call
  /// reads the map. Throws store::StoreError; the next call goes on.
  bool advance(Clock::time_point now);

  /// Totals so far.
  [[nodiscard]] const LiveLocalisationCounters& counters() const { return counters_; }

 private:
  /// A session that is localised.
  struct Followed {
    SessionId id;
    std::string name;
    merge::Localiser localiser;
    std::int64_t epoch = 0;             ///< of the map
    std::int64_t next = 0;              ///< sequence from which on keyframes are new
    std::int64_t told_from = 0;         ///< sequence from which on answers are told
    std::uint64_t before = 0;           ///< keyframes stored before the first one taken
    std::uint64_t taken = 0;            ///< keyframes since
    bool ended = false;                 ///< at the last look
    bool is_broken = false;             ///< an answer failed halfway
    Clock::time_point last_keyframe{};  ///< when a keyframe was taken last
    merge::LocalisationState state = merge::LocalisationState::kNotYet;  ///< told last
  };

  void look_for_map(Clock::time_point now);
  bool take_all(Clock::time_point now);
  /// The session if it is followed; null if it brings nothing new, or there is no map or no room.
  Followed* followed(const store::SessionExtent& session, Clock::time_point now);
  void start(const store::SessionExtent& session, bool is_fresh, Clock::time_point now);
  bool make_room(Clock::time_point now);
  bool take_some(const store::SessionExtent& session, Followed& followed, Clock::time_point now);
  void take(const store::StoredKeyframe& keyframe, Followed& followed);
  void leave_out(std::uint32_t sequence, const Followed& followed, const std::string& reason);
  void tell_state(const wire::MapPoseMessage& message, double path_m, Followed& followed);
  void forget_over(Clock::time_point now);
  void forget(std::map<std::int64_t, Followed>::iterator session);

  LiveLocalisationOptions options_;
  store::SessionFollower store_;
  std::optional<StoredMap> map_;                ///< for the next session
  std::optional<Clock::time_point> next_look_;  ///< for a map, where there was none
  std::string trouble_;                         ///< with the map, as it was told last
  std::map<std::int64_t, Followed> live_;       ///< by row
  std::map<std::int64_t, std::int64_t>
      seen_;  ///< of other sessions by row, highest sequence so far
  bool has_more_ = true;
  LiveLocalisationCounters counters_;
};

}  // namespace unimapper::apps
