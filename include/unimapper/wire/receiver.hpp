// Assembly of sessions from messages that arrive in any order.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_storage.hpp"
#include "unimapper/wire/memory_storage.hpp"
#include "unimapper/wire/messages.hpp"
#include "unimapper/wire/reassembly.hpp"
#include "unimapper/wire/robot_quotas.hpp"

namespace unimapper::wire {

/// What became of the messages.
struct ReceiverCounters {
  std::uint64_t messages = 0;    ///< on the project's channels
  std::uint64_t overflowed = 0;  ///< dropped before, as they came faster than they were taken
  std::uint64_t foreign = 0;     ///< on other channels, ignored
  std::uint64_t malformed = 0;   ///< not decodable, or a piece with a wrong checksum
  std::uint64_t refused = 0;     ///< beyond a limit: sessions, keyframe size, memory
  /// A session that changes its name or sensor, or a keyframe with two different summaries.
  std::uint64_t contradictory = 0;
  std::uint64_t pieces_duplicate = 0;   ///< pieces that came before, or of a keyframe that is here
  std::uint64_t keyframes = 0;          ///< whole, sound and stored
  std::uint64_t summaries = 0;          ///< of keyframes that were not whole then
  std::uint64_t keyframes_damaged = 0;  ///< whole, but checksum or content is wrong
  std::uint64_t keyframes_abandoned = 0;  ///< incomplete, evicted at the memory limit
};

/// Whether an encoded keyframe that claims to be of this session may be taken, e.g. because it is
/// signed.
using KeyframeCheck = std::function<bool(const SessionId& session, Bytes keyframe)>;

/// How far one session is.
struct SessionProgress {
  SessionInfo info;    ///< identity and names of the session
  bool ended = false;  ///< its end was announced
  bool whole = false;  ///< ended, and every keyframe it sent is here
  /// Since when the session has at most said that it has ended: the time, as `Receiver::advance`
  /// was told it, of its last new keyframe, of its last message that it runs, or of its first that
  /// it has ended, whichever was last.
  std::int64_t quiet_since_ns = 0;
  std::uint64_t announced = 0;          ///< keyframes made, as far as known
  std::uint64_t dropped = 0;            ///< keyframes that the robot dropped, as it said last
  std::uint64_t received = 0;           ///< keyframes stored
  std::uint64_t waiting = 0;            ///< keyframes here, but not yet stored
  std::uint64_t summaries = 0;          ///< other keyframes of which the summary is here
  std::uint64_t damaged = 0;            ///< keyframes that arrived damaged only
  std::uint64_t refused = 0;            ///< keyframes or pieces beyond a quota or without room
  std::optional<HealthMessage> health;  ///< the latest, if any
  std::optional<ClockOffset> clock;     ///< of the robot's clock, as it said last
  std::uint64_t bytes_per_second = 0;   ///< at which it sends, as it said last
};

/// Takes the messages of any number of sessions in any order. Whatever it is fed, it keeps
/// within its limits, never throws, and counts what it could not use. When a session more than
/// `max_sessions` appears, the one without a keyframe that has been silent longest gives way; where
/// what is stored is durable, one with keyframes may, and is found again when it is heard. An end
/// that was announced is taken back by two messages that say the session is running. Not thread
/// safe.
class Receiver {
 public:
  /// A receiver that keeps keyframes in memory, for `take_sessions`.
  explicit Receiver(const ReceiverLimits& limits = {});
  /// A receiver whose keyframes go to `storage`, which outlives it and which nobody else feeds.
  Receiver(const ReceiverLimits& limits, KeyframeStorage& storage);

  /// Tells the time by any steady clock, several times a second: rates are measured by it, and what
  /// waits is stored. A receiver that keeps keyframes in memory needs it for rates only.
  void advance(std::int64_t now_ns);
  /// Stores everything that waits.
  void store_all();

  /// From now on, keyframes are taken only if `check` says so; others count as damaged.
  void set_check(KeyframeCheck check) { check_ = std::move(check); }

  /// Takes one message. A piece must be a possible one (`is_possible`).
  void receive(const SessionMessage& message);
  /// One piece of a keyframe.
  void receive(ChunkMessage&& piece);
  /// Health of a session; the latest is kept.
  void receive(HealthMessage&& message);
  /// A probe; with its arrival it is answered by `take_receipts`.
  void receive(const ProbeMessage& message, const std::optional<ProbeArrival>& arrival = {});
  /// Tells of a message that could not be decoded, or of one that is not the project's.
  void count_malformed();
  /// Counts a message that is not the project's.
  void count_foreign() { ++counters_.foreign; }

  /// Totals over all sessions.
  [[nodiscard]] ReceiverCounters counters() const;
  /// All sessions, by id.
  [[nodiscard]] std::vector<SessionProgress> progress() const;

  /// What is stored of the sessions that were heard since the last call: to be sent to the robots.
  std::vector<StoredMessage> take_stored();

  /// Answers to the probes that have arrived since the last call. `base` is a random number of this
  /// start; `window_bytes`, what there is room for now, is divided among the robots that were heard
  /// in the last three seconds. `now_ns` is of the clock of `ProbeArrival::steady_ns`.
  std::vector<ReceiptMessage> take_receipts(std::uint64_t base, std::uint64_t window_bytes,
                                            std::int64_t now_ns);

  /// Hands over the sessions, sorted by name and id, names made unique; the receiver holds
  /// none afterwards, but goes on counting. A session whose messages never came is named after its
  /// numbers. Keyframes that went to a storage of the caller's are not among them.
  std::vector<SessionData> take_sessions();

 private:
  struct Session {
    std::optional<SessionInfo> info;
    bool ended = false;
    std::uint32_t signs_of_life = 0;  ///< messages after the end that say otherwise
    std::int64_t quiet_since_ns = 0;
    std::uint64_t last_heard = 0;
    bool answered = false;  ///< since it was last heard
    std::uint64_t announced = 0;
    std::uint64_t highest_seen = 0;  ///< what pieces say of `announced`
    std::uint64_t dropped_by_sender = 0;
    StoredSequences stored;
    std::set<std::uint32_t> waiting;  ///< taken by the storage, but not yet stored
    std::set<std::uint32_t> damaged;
    /// Of keyframes that have not arrived whole.
    struct Summary {
      StoredSummary stored;          ///< what the storage was handed
      bool is_contradicted = false;  ///< by another one: neither counts
    };
    std::map<std::uint32_t, Summary> summaries;
    std::optional<HealthMessage> health;
    bool is_changed = false;       ///< since the storage was told
    bool end_is_stored = false;    ///< the storage has the session's end
    bool is_beyond_quota = false;  ///< for good
    std::uint64_t refused = 0;

    /// A probe without an answer.
    struct Probe {
      std::uint32_t number = 0;  ///< of the probe
      ProbeArrival arrival;      ///< of the probe
      std::uint64_t pieces = 0;  ///< that had arrived before it
    };
    std::uint64_t pieces = 0;  ///< that arrived, repeated ones too
    std::vector<Probe> probes;
    std::optional<std::int64_t> last_probe_ns;
    std::uint64_t bytes_per_second = 0;
    std::optional<ClockOffset> clock;

    [[nodiscard]] bool has_keyframes() const { return stored.count() > 0 || !waiting.empty(); }
    /// Whether the storage knows it.
    [[nodiscard]] bool is_kept() const { return has_keyframes() || !summaries.empty(); }
  };

  /// The session, made or found in the storage if there is room for one more or another gives way;
  /// null otherwise.
  Session* session(const SessionId& id);
  bool forget_session();
  void take_payload(Session& state, const KeyframeName& name, std::vector<std::uint8_t> payload);
  void take_summary(Session& state, const KeyframeName& name, std::vector<std::uint8_t> bytes);
  void forget_summary(Session& state, const KeyframeName& name);
  [[nodiscard]] bool is_within_quota(Session& state, std::uint32_t robot, std::uint64_t bytes);
  void keep(Session& state, ReceivedKeyframe&& keyframe);
  void take(const Committed& committed);
  void mark_damaged(Session& state, std::uint32_t sequence);
  void count_refused(Session& state);

  ReceiverLimits limits_;
  std::unique_ptr<MemoryStorage> memory_;  ///< unless the storage is the caller's
  KeyframeStorage* storage_;
  RobotQuotas quotas_;
  KeyframeCheck check_;
  Reassembly reassembly_;
  ReceiverCounters counters_;
  std::map<SessionId, Session> sessions_;
  std::uint64_t clock_ = 0;
  std::int64_t now_ns_ = 0;
};

/// Name of a session whose messages never came: its numbers.
std::string name_of(const SessionId& id);

/// Sorts by name and id and appends "-2", "-3", ... to names that occur again.
void sort_and_name(std::vector<SessionData>& sessions);

}  // namespace unimapper::wire
