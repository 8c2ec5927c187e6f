// Assembly of sessions from messages that arrive in any order.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/messages.hpp"
#include "unimapper/wire/reassembly.hpp"

namespace unimapper::wire {

/// What became of the messages.
struct ReceiverCounters {
  std::uint64_t messages = 0;             ///< on the project's channels
  std::uint64_t foreign = 0;              ///< on other channels, ignored
  std::uint64_t malformed = 0;            ///< not decodable, or a piece with a wrong checksum
  std::uint64_t refused = 0;              ///< beyond a limit: sessions, keyframe size, memory
  std::uint64_t contradictory = 0;        ///< a session that changes its name or sensor
  std::uint64_t pieces_duplicate = 0;     ///< the same piece again, or of a keyframe that is here
  std::uint64_t keyframes = 0;            ///< whole and sound
  std::uint64_t keyframes_damaged = 0;    ///< whole, but checksum or content is wrong
  std::uint64_t keyframes_abandoned = 0;  ///< incomplete, evicted at the memory limit
};

/// How far one session is.
struct SessionProgress {
  SessionInfo info;                     ///< identity and names of the session
  bool ended = false;                   ///< its end was announced
  bool whole = false;                   ///< ended, and every keyframe it sent is here
  std::uint64_t announced = 0;          ///< keyframes made, as far as known
  std::uint64_t received = 0;           ///< keyframes here
  std::optional<HealthMessage> health;  ///< the latest, if any
};

/// Takes the messages of any number of sessions in any order. Whatever it is fed, it keeps
/// within its limits, never throws, and counts what it could not use. When a session more than
/// `max_sessions` appears, the one without a keyframe that has been silent longest gives way. An
/// end that was announced is taken back by two messages that say the session is running. Not
/// thread safe.
class Receiver {
 public:
  explicit Receiver(const ReceiverLimits& limits = {});

  /// Takes one message. A piece must be a possible one (`is_possible`).
  void receive(const SessionMessage& message);
  /// One piece of a keyframe.
  void receive(ChunkMessage&& piece);
  /// Health of a session; the latest is kept.
  void receive(HealthMessage&& message);
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

  /// Hands over the sessions, sorted by name and id, names made unique; the receiver holds
  /// none afterwards, but goes on counting. A session whose messages never came is named after its
  /// numbers.
  std::vector<SessionData> take_sessions();

 private:
  struct Session {
    std::optional<SessionInfo> info;
    bool ended = false;
    std::uint32_t signs_of_life = 0;  ///< messages after the end that say otherwise
    std::uint64_t last_heard = 0;
    bool answered = false;  ///< since it was last heard
    std::uint64_t announced = 0;
    std::uint64_t highest_seen = 0;  ///< what pieces say of `announced`
    std::uint64_t dropped_by_sender = 0;
    std::map<std::uint32_t, KeyframeRecord> keyframes;
    StoredSequences stored;
    std::set<std::uint32_t> damaged;
    std::optional<HealthMessage> health;
  };

  /// The session, made if there is room for one more or a session without a keyframe to give way;
  /// null otherwise.
  Session* session(const SessionId& id);
  bool forget_empty_session();
  void keep(Session& state, KeyframeRecord&& record);
  void mark_damaged(Session& state, std::uint32_t sequence);

  ReceiverLimits limits_;
  Reassembly reassembly_;
  ReceiverCounters counters_;
  std::map<SessionId, Session> sessions_;
  std::uint64_t stored_bytes_ = 0;
  std::uint64_t clock_ = 0;
};

/// Sorts by name and id and appends "-2", "-3", ... to names that occur again.
void sort_and_name(std::vector<SessionData>& sessions);

}  // namespace unimapper::wire
