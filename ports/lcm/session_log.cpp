#include "ports/lcm/session_log.hpp"

#include <algorithm>

namespace unimapper::lcm_port {

namespace {

constexpr std::int64_t kSessionPeriodUs = 1'000'000;

}  // namespace

SessionLogWriter::SessionLogWriter(const std::filesystem::path& path, SessionInfo info,
                                   std::uint32_t datagram_bytes)
    : log_(path), datagram_bytes_(datagram_bytes) {
  session_.info = std::move(info);
  // What a later call would refuse is refused before hours of driving.
  (void)encode(session_);
  (void)cut_into_messages({}, datagram_bytes);
}

void SessionLogWriter::begin(SessionInfo info) {
  SessionMessage session;
  session.info = std::move(info);
  (void)encode(session);
  session_ = std::move(session);
  started_ = false;
}

void SessionLogWriter::write_session(SessionState state, std::int64_t stamp_us) {
  session_.state = state;
  log_.write(stamp_us, kSessionChannel, encode(session_));
  session_stamp_us_ = stamp_us;
}

void SessionLogWriter::write(const EncodedKeyframe& keyframe) {
  const bool was_started = started_;
  const std::int64_t session_stamp_us = session_stamp_us_;
  const std::uint64_t keyframes =
      std::max<std::uint64_t>(session_.keyframes, keyframe.sequence + 1ULL);
  try {
    write_pieces(keyframe);
    // A robot that loses power loses no keyframe it had finished.
    log_.flush();
  } catch (const EventLogError&) {
    // Nothing of this call is in the log, but its reader is to miss the keyframe.
    started_ = was_started;
    session_stamp_us_ = session_stamp_us;
    session_.keyframes = keyframes;
    throw;
  }
  session_.keyframes = keyframes;
}

void SessionLogWriter::write_pieces(const EncodedKeyframe& keyframe) {
  // Truncation towards zero is good enough for a clock that only orders messages.
  const std::int64_t stamp_us = keyframe.stamp_ns / 1000;
  stamp_us_ = started_ ? std::max(stamp_us_, stamp_us) : stamp_us;
  if (!started_) {
    write_session(SessionState::kStarted, stamp_us_);
  } else if (stamp_us_ - session_stamp_us_ >= kSessionPeriodUs) {
    write_session(SessionState::kRunning, stamp_us_);
  }
  started_ = true;
  for (const auto& message : cut_into_messages(keyframe, datagram_bytes_)) {
    log_.write(stamp_us_, kKeyframeChannel, message);
  }
}

void SessionLogWriter::finish() {
  write_session(SessionState::kEnded, stamp_us_);
  log_.flush();
}

}  // namespace unimapper::lcm_port
