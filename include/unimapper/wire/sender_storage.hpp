// Interface of what keeps a sender's keyframes beyond its memory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/pieces.hpp"

namespace unimapper::wire {

/// A keyframe that nobody has acknowledged.
struct WaitingKeyframe {
  std::uint32_t sequence = 0;  ///< running number in its session
  std::uint32_t bytes = 0;     ///< of the encoded keyframe
};

/// A session of an earlier start, as a sender's storage has it.
struct EarlierSession {
  SessionInfo info;                      ///< identity and names
  std::vector<WaitingKeyframe> waiting;  ///< ascending
  std::uint64_t keyframes = 0;           ///< made, as far as known
  std::uint64_t acknowledged = 0;        ///< keyframes stored at a base
  std::int64_t newest_stamp_ns = 0;      ///< of its last keyframe
  bool ended = false;                    ///< a base has confirmed its end
};

/// Where a sender puts the keyframes it publishes, and finds again those that no longer fit into
/// its memory. All functions may be called from several threads; none throws because of the disk.
class SenderStorage {
 public:
  SenderStorage() = default;
  virtual ~SenderStorage() = default;
  SenderStorage(const SenderStorage&) = delete;
  SenderStorage& operator=(const SenderStorage&) = delete;

  /// Takes a keyframe of the session `info`. Waits for no disk.
  virtual void add(const SessionInfo& info, const EncodedKeyframe& keyframe) = 0;
  /// Whether `read` would find it, as far as known.
  [[nodiscard]] virtual bool holds(const SessionId& session, std::uint32_t sequence) const = 0;
  /// The keyframe, or nothing if it is gone or damaged. May wait for the disk.
  virtual std::optional<EncodedKeyframe> read(const SessionId& session, std::uint32_t sequence) = 0;
  /// A base has stored these: they need not be sent again after a restart.
  virtual void acknowledge(const SessionId& session, std::span<const std::uint32_t> sequences) = 0;
  /// A base has confirmed the end of the session: nothing of it need be sent after a restart.
  virtual void end(const SessionId& session) = 0;
  /// Sessions of which nothing was added since the start.
  [[nodiscard]] virtual std::vector<EarlierSession> earlier_sessions() const = 0;
};

}  // namespace unimapper::wire
