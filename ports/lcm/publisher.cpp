#include "ports/lcm/publisher.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace unimapper::lcm_port {

namespace {

/// Announcements of a session's end: datagrams may be lost and are not acknowledged.
constexpr int kEndRepeats = 3;
constexpr std::chrono::milliseconds kEndInterval{50};

}  // namespace

void TokenBucket::refill(Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now - last_).count();
  last_ = now;
  tokens_ = std::min(burst_, tokens_ + std::max(0.0, seconds) * rate_);
}

TokenBucket::Clock::duration TokenBucket::wait_time(double bytes, Clock::time_point now) {
  refill(now);
  const double missing = std::min(bytes, burst_) - tokens_;
  if (missing <= 0.0) return Clock::duration::zero();
  // Rounded up: a sleeper that wakes a nanosecond early would spin.
  return std::chrono::ceil<Clock::duration>(std::chrono::duration<double>(missing / rate_)) +
         std::chrono::microseconds(1);
}

Publisher::Publisher(SessionInfo info, Send send, const PublisherOptions& options)
    : send_(std::move(send)),
      options_(options),
      bucket_(options.bytes_per_second, options.burst_bytes, Clock::now()),
      next_session_(Clock::now()) {
  if (!(options.bytes_per_second >= 1000.0) || options.burst_bytes == 0 ||
      options.queue_capacity == 0) {
    throw std::invalid_argument(
        "a publisher needs at least 1000 bytes per second, a burst and a queue");
  }
  session_.info = std::move(info);
  (void)encode(session_);
  (void)cut_into_messages({}, options_.datagram_bytes);
  thread_ = std::thread([this] { run(); });
}

Publisher::~Publisher() {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kRunning) phase_ = Phase::kStopping;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Publisher::publish(EncodedKeyframe keyframe) {
  {
    std::unique_lock lock(mutex_);
    if (!options_.drop_when_full) {
      has_room_.wait(lock, [this] {
        return queue_.size() < options_.queue_capacity || phase_ != Phase::kRunning;
      });
    }
    if (phase_ != Phase::kRunning) {
      ++counters_.keyframes_dropped;
      return;
    }
    session_.keyframes = std::max<std::uint64_t>(session_.keyframes, keyframe.sequence + 1ULL);
    if (queue_.size() >= options_.queue_capacity) {
      queue_.pop_front();
      ++counters_.keyframes_dropped;
    }
    queue_.push_back(std::move(keyframe));
  }
  wake_.notify_one();
}

void Publisher::set_health(HealthMessage health) {
  const std::lock_guard lock(mutex_);
  health_ = std::move(health);
}

PublisherCounters Publisher::finish() {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kRunning) {
      phase_ = Phase::kFinishing;
      deadline_ = Clock::now() + options_.finish_timeout;
    }
  }
  wake_.notify_all();
  has_room_.notify_all();
  if (thread_.joinable()) thread_.join();
  return counters();
}

PublisherCounters Publisher::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

bool Publisher::must_stop(Clock::time_point now) const {
  return phase_ == Phase::kStopping || now >= deadline_;
}

bool Publisher::wait_for(Clock::duration duration) {
  std::unique_lock lock(mutex_);
  const Clock::time_point until = std::min(Clock::now() + duration, deadline_);
  wake_.wait_until(lock, until, [this] { return phase_ == Phase::kStopping; });
  return !must_stop(Clock::now());
}

std::optional<EncodedKeyframe> Publisher::next_keyframe() {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, next_session_,
                   [this] { return !queue_.empty() || phase_ != Phase::kRunning; });
  if (queue_.empty() || must_stop(Clock::now())) return std::nullopt;
  EncodedKeyframe keyframe = std::move(queue_.front());
  queue_.pop_front();
  has_room_.notify_one();
  return keyframe;
}

void Publisher::run() {
  send_session(SessionState::kStarted);
  for (;;) {
    send_session_if_due();
    if (const std::optional<EncodedKeyframe> keyframe = next_keyframe()) {
      send_keyframe(*keyframe);
      continue;
    }
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kRunning) continue;
    counters_.keyframes_dropped += queue_.size();
    queue_.clear();
    if (phase_ == Phase::kStopping) return;
    break;
  }
  for (int i = 0; i < kEndRepeats; ++i) {
    if (i > 0) std::this_thread::sleep_for(kEndInterval);
    send_session(SessionState::kEnded);
  }
}

void Publisher::send_keyframe(const EncodedKeyframe& keyframe) {
  bool sent = true;
  for (const auto& message : cut_into_messages(keyframe, options_.datagram_bytes)) {
    const auto bytes = static_cast<double>(message.size());
    for (;;) {
      const Clock::duration wait = bucket_.wait_time(bytes, Clock::now());
      if (wait == Clock::duration::zero()) break;
      if (!wait_for(wait)) {
        const std::lock_guard lock(mutex_);
        ++counters_.keyframes_dropped;
        return;
      }
    }
    bucket_.take(bytes);
    sent = send_message(kKeyframeChannel, message) && sent;
    send_session_if_due();
  }
  const std::lock_guard lock(mutex_);
  if (sent) ++counters_.keyframes_sent;
}

void Publisher::send_session_if_due() {
  if (Clock::now() >= next_session_) send_session(SessionState::kRunning);
}

void Publisher::send_session(SessionState state) {
  SessionMessage session;
  std::optional<HealthMessage> health;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
    session.keyframes_dropped = counters_.keyframes_dropped;
    health = health_;
    if (health) health->bytes_sent = counters_.bytes_sent;
  }
  session.state = state;
  send_message(kSessionChannel, encode(session));
  if (health) send_message(kHealthChannel, encode(*health));
  next_session_ = Clock::now() + options_.session_period;
}

bool Publisher::send_message(std::string_view channel, Bytes message) {
  const bool sent = send_(channel, message);
  const std::lock_guard lock(mutex_);
  counters_.messages_sent += sent ? 1 : 0;
  counters_.bytes_sent += sent ? message.size() : 0;
  counters_.send_failures += sent ? 0 : 1;
  return sent;
}

}  // namespace unimapper::lcm_port
