// Writer of a session's LCM event log.
#pragma once

#include <cstdint>
#include <filesystem>

#include "ports/lcm/event_log.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/sending.hpp"

namespace unimapper::lcm_port {

/// Writes the messages of one session in the order and with the content a `Publisher` sends
/// them. Events are stamped with the keyframes' own times, so equal keyframes give equal bytes.
class SessionLogWriter {
 public:
  /// Throws EventLogError, or std::invalid_argument for an impossible name or datagram size.
  SessionLogWriter(const std::filesystem::path& path, SessionInfo info,
                   std::uint32_t datagram_bytes = kLargestDatagramBytes);

  /// Appends a keyframe; sequence numbers ascend from 0. Throws EventLogError; the keyframe is then
  /// missing from the log, and the next one may be written.
  void write(const EncodedKeyframe& keyframe);
  /// Appends the end-of-session message and flushes. Throws EventLogError.
  void finish();
  /// After `finish`: what follows is of another session. Throws std::invalid_argument for an
  /// impossible name.
  void begin(SessionInfo info);

 private:
  void write_session(SessionState state, std::int64_t stamp_us);
  void write_pieces(const EncodedKeyframe& keyframe);

  EventLogWriter log_;
  SessionMessage session_;
  std::uint32_t datagram_bytes_;
  std::int64_t stamp_us_ = 0;
  std::int64_t session_stamp_us_ = 0;
  bool started_ = false;
};

}  // namespace unimapper::lcm_port
