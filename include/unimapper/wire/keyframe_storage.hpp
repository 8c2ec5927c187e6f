// Interface of what keeps the keyframes and sessions that a receiver has taken.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/delivery.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::wire {

/// A keyframe that arrived whole and sound.
struct ReceivedKeyframe {
  std::vector<std::uint8_t> bytes;  ///< as the robot encoded it
  KeyframeRecord record;            ///< what they say
};

/// One keyframe by its names on the wire.
struct KeyframeName {
  SessionId session;           ///< the session it belongs to
  std::uint32_t sequence = 0;  ///< of the keyframe within its session
  friend auto operator<=>(const KeyframeName&, const KeyframeName&) = default;
};

/// The summary of a keyframe that has not arrived whole.
struct ReceivedSummary {
  std::vector<std::uint8_t> bytes;  ///< as the robot encoded it
  KeyframeRecord record;            ///< what they say
};

/// What is known of a session beside its keyframes.
struct SessionSummary {
  SessionId id;                         ///< identity of the session
  std::optional<SessionInfo> info;      ///< its names, once they have arrived
  bool ended = false;                   ///< its end was announced
  std::uint64_t announced = 0;          ///< keyframes made, as far as known
  std::uint64_t dropped_by_sender = 0;  ///< keyframes made that the robot never sent
};

/// The summary of a keyframe that is not stored itself.
struct StoredSummary {
  std::uint32_t bytes = 0;  ///< bytes of the summary
  std::uint32_t crc32 = 0;  ///< checksum of the summary's bytes
};

/// A session as it is stored.
struct StoredSession {
  SessionSummary summary;                            ///< as of the last change that was stored
  StoredSequences keyframes;                         ///< keyframes that are stored
  std::map<std::uint32_t, StoredSummary> summaries;  ///< of keyframes not stored, by sequence
};

/// What is stored of one robot.
struct RobotUsage {
  std::uint32_t robot = 0;     ///< number of the robot
  std::uint64_t sessions = 0;  ///< with a keyframe
  std::uint64_t bytes = 0;     ///< of encoded keyframes and summaries
};

/// What has become durable.
struct Committed {
  std::vector<KeyframeName> keyframes;   ///< stored now
  std::vector<SessionSummary> sessions;  ///< whose summary is stored now
};

/// Where a receiver's keyframes go. What was taken is stored only once a commit says so, and only
/// then a robot is told, which forgets it. No function throws.
class KeyframeStorage {
 public:
  /// What became of a keyframe.
  enum class Taken : std::uint8_t {
    kStored,   ///< for good
    kWaiting,  ///< until a commit
    kNoRoom,   ///< not taken; it may be offered again
  };

  KeyframeStorage() = default;
  virtual ~KeyframeStorage() = default;
  KeyframeStorage(const KeyframeStorage&) = delete;
  KeyframeStorage& operator=(const KeyframeStorage&) = delete;

  /// Takes a keyframe that is neither stored nor waiting.
  virtual Taken keep(ReceivedKeyframe&& keyframe) = 0;
  /// Takes the summary of a keyframe of which there is nothing yet; the keyframe will replace it.
  /// Where there is no room it is dropped.
  virtual void keep(ReceivedSummary&& summary) = 0;
  /// Forgets the summary of a keyframe, stored or not.
  virtual void remove_summary(const KeyframeName& name) = 0;
  /// Takes what is known of a session that has keyframes here; the latest counts.
  virtual void keep(const SessionSummary& summary) = 0;
  /// Takes the health of a session that has keyframes here.
  virtual void keep(const HealthMessage& health) = 0;

  /// Stores what waits if it is due, and says what has been stored since the last call. `now_ns`:
  /// any steady clock, the same at every call.
  virtual Committed commit_due(std::int64_t now_ns) = 0;
  /// Stores everything that waits, due or not, and says what has been stored since the last call.
  /// `now_ns`: as in `commit_due`.
  virtual Committed commit_all(std::int64_t now_ns) = 0;

  /// A session as it is stored, empty if it is not; nothing if that cannot be read now.
  virtual std::optional<StoredSession> find(const SessionId& id) = 0;
  /// What every robot has stored.
  [[nodiscard]] virtual std::vector<RobotUsage> usage() const = 0;
  /// Whether keyframes can be stored at the moment, as far as known.
  [[nodiscard]] virtual bool accepts() const = 0;
  /// Whether what is stored survives the process, so that a receiver may forget it.
  [[nodiscard]] virtual bool is_durable() const = 0;
};

}  // namespace unimapper::wire
