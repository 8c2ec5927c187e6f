#include "ports/lcm/publisher.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace unimapper::lcm_port {

namespace {

/// Announcements of a session's end where nobody confirms it: datagrams may be lost.
constexpr int kEndRepeats = 3;
constexpr std::chrono::milliseconds kEndInterval{50};

/// How often a waiting thread looks for answers.
constexpr std::chrono::milliseconds kListenInterval{20};
/// How often a waiting thread looks where nothing but a place in the base's map can come.
constexpr std::chrono::milliseconds kMapPoseInterval{100};

/// A base answers a few times a second; one that has not answered for so long is not there.
constexpr std::chrono::milliseconds kFirstAnswer{1000};

/// After a probe answers are looked for, whatever else there is to do.
constexpr std::chrono::milliseconds kProbeWait{400};

/// A piece may be this long on its way to the base, and the answer on its way back.
constexpr std::chrono::nanoseconds kResendAfter = std::chrono::milliseconds(400);

/// A link whose datagrams are large carries some of them a second: at the start, and at least.
constexpr double kDatagramsAtStart = 16.0;
constexpr double kDatagramsAtLeast = 4.0;

/// Checked before anything is made of them.
PacingOptions pacing_options(const PublisherOptions& options) {
  if (!(options.bytes_per_second >= 1000.0) || !(options.min_bytes_per_second > 0.0)) {
    throw std::invalid_argument("a publisher needs at least 1000 bytes per second");
  }
  PacingOptions pacing;
  pacing.maximum = options.bytes_per_second;
  const double least =
      std::max(options.min_bytes_per_second, kDatagramsAtLeast * options.datagram_bytes);
  pacing.minimum = std::min(least, pacing.maximum);
  pacing.start = std::max(pacing.start, kDatagramsAtStart * options.datagram_bytes);
  return pacing;
}

/// Health of the pipeline takes at most this share of a link that the rate follows.
constexpr double kHealthShare = 0.05;

std::int64_t nanoseconds_of(TokenBucket::Clock::time_point time) {
  return std::chrono::nanoseconds(time.time_since_epoch()).count();
}

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
    : Publisher(std::move(info), Link{std::move(send), {}}, options) {}

Publisher::Publisher(SessionInfo info, Link link, const PublisherOptions& options,
                     wire::SenderStorage* storage)
    : link_(std::move(link)),
      options_(options),
      storage_(storage),
      map_pose_(info.id),
      bucket_(options.bytes_per_second, options.burst_bytes, Clock::now()),
      pacing_(pacing_options(options)),
      next_session_(Clock::now()),
      outbox_(kResendAfter.count()) {
  if (options.burst_bytes == 0 || options.queue_capacity == 0) {
    throw std::invalid_argument("a publisher needs a burst and a queue");
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
  if (storage_ != nullptr) storage_->add(session_.info, keyframe);
  {
    std::unique_lock lock(mutex_);
    if (!options_.drop_when_full) {
      has_room_.wait(lock, [this] {
        return queued_in_memory_ < options_.queue_capacity || phase_ != Phase::kRunning;
      });
    }
    ++counters_.keyframes_published;
    if (phase_ != Phase::kRunning) {
      ++counters_.keyframes_dropped;
      return;
    }
    session_.keyframes = std::max<std::uint64_t>(session_.keyframes, keyframe.sequence + 1ULL);
    if (queued_in_memory_ >= options_.queue_capacity) make_queue_room();
    const auto bytes = static_cast<std::uint32_t>(keyframe.bytes.size());
    queue_.push_back({std::move(keyframe), bytes});
    ++queued_in_memory_;
  }
  wake_.notify_one();
}

void Publisher::resume(const wire::EarlierSession& earlier) {
  {
    const std::lock_guard lock(mutex_);
    session_.keyframes = std::max(session_.keyframes, earlier.keyframes);
    const std::uint64_t known = earlier.acknowledged + earlier.waiting.size();
    const std::uint64_t lost = earlier.keyframes - std::min(earlier.keyframes, known);
    counters_.keyframes_published += earlier.waiting.size() + lost;
    counters_.keyframes_dropped += lost;
    for (const wire::WaitingKeyframe& waiting : earlier.waiting) {
      EncodedKeyframe keyframe{earlier.info.id, waiting.sequence, 0, {}};
      queue_.push_back({std::move(keyframe), waiting.bytes, true});
    }
  }
  wake_.notify_one();
}

void Publisher::set_bytes_per_second(double bytes_per_second) {
  const std::lock_guard lock(mutex_);
  new_rate_ = bytes_per_second;
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
  PublisherCounters counters = counters_;
  const std::uint64_t done = counters.keyframes_acknowledged + counters.keyframes_lost();
  counters.keyframes_waiting = link_.receive ? counters.keyframes_published - done : 0;
  counters.map_poses = map_pose_.counters();
  return counters;
}

std::optional<HeardMapPose> Publisher::map_pose() const {
  const std::lock_guard lock(mutex_);
  return map_pose_.latest();
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

void Publisher::run() {
  send_session(SessionState::kStarted);
  while (!is_done()) {
    send_session_if_due();
    take_stored();
    take_receipts();
    take_map_poses();
    apply_rate();
    fill_outbox();
    send_probe_if_due();
    if (const auto piece = outbox_.next()) {
      send_piece(*piece);
    } else {
      wait_for_work();
    }
  }
  evict_rest();
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kStopping) return;
  }
  announce_end();
}

/// Stopped, or finishing with nothing left to send or to wait for.
bool Publisher::is_done() {
  const std::lock_guard lock(mutex_);
  if (phase_ == Phase::kRunning) return false;
  const Clock::time_point now = Clock::now();
  if (must_stop(now)) return true;
  if (!queue_.empty() || outbox_.next()) return false;
  const bool awaits_answer =
      base_answers_ || now < deadline_ - options_.finish_timeout + kFirstAnswer;
  return outbox_.size() == 0 || !awaits_answer;
}

void Publisher::take_stored() {
  if (!link_.receive) return;
  for (const StoredMessage& message : link_.receive()) {
    if (message.session != session_.info.id) continue;
    base_answers_ = true;
    end_confirmed_ = message.ended;
    const auto stored = outbox_.take(message, nanoseconds_of(Clock::now()));
    for (const std::uint32_t sequence : stored) release(sequence);
    if (storage_ != nullptr) storage_->acknowledge(session_.info.id, stored);
    const std::lock_guard lock(mutex_);
    counters_.keyframes_acknowledged += stored.size();
    counters_.base_answers = true;
  }
}

void Publisher::take_map_poses() {
  if (!link_.map_poses) return;
  for (const ReceivedMapPose& received : link_.map_poses()) {
    const std::lock_guard lock(mutex_);
    map_pose_.take(received, Clock::now());
  }
}

/// Keyframes in memory come one at a time, so that the queue fills where the link is too slow for
/// them; of those in the storage only their numbers come.
void Publisher::fill_outbox() {
  while (true) {
    Queued queued;
    {
      const std::lock_guard lock(mutex_);
      if (queue_.empty()) return;
      const bool sends = fresh_ && held_.contains(*fresh_) && !outbox_.was_sent(*fresh_);
      if (sends && !queue_.front().keyframe.bytes.empty() && !may_hold_early()) return;
      queued = std::move(queue_.front());
      queue_.pop_front();
      if (!queued.keyframe.bytes.empty()) --queued_in_memory_;
    }
    has_room_.notify_one();
    hold(queued);
  }
}

void Publisher::send_piece(const wire::Outbox::Piece& piece) {
  if (!load(piece.sequence)) return;
  Held& held = held_.at(piece.sequence);
  const std::vector<std::uint8_t>& message = held.messages[piece.index];
  const auto bytes = static_cast<double>(message.size());
  if (!pacing_.has_room(bytes)) {
    wait_for(kListenInterval);
    return;
  }
  const Clock::duration wait = bucket_.wait_time(bytes, Clock::now());
  // Whatever waits meanwhile, a session's message or an answer, goes first.
  if (wait > Clock::duration::zero()) {
    wait_for(std::min<Clock::duration>(wait, kListenInterval));
    return;
  }
  bucket_.take(bytes);
  pacing_.sent(bytes);
  if (!send_message(kKeyframeChannel, message)) held.refused = true;
  const bool again = outbox_.was_sent(piece.sequence);
  const bool whole = outbox_.sent(piece, nanoseconds_of(Clock::now()));
  {
    const std::lock_guard lock(mutex_);
    if (again) ++counters_.pieces_resent;
    if (whole && !again && !held.refused) ++counters_.keyframes_sent;
  }
  if (whole && !link_.receive) release(piece.sequence);
}

void Publisher::announce_end() {
  end_confirmed_ = false;
  for (int i = 0; i < kEndRepeats || base_answers_; ++i) {
    if (i > 0) std::this_thread::sleep_for(kEndInterval);
    take_stored();
    take_map_poses();
    if (end_confirmed_) {
      {
        const std::lock_guard lock(mutex_);
        counters_.end_confirmed = true;
      }
      // Otherwise the next start goes on with the session.
      if (storage_ != nullptr && counters().keyframes_waiting == 0) {
        storage_->end(session_.info.id);
      }
      return;
    }
    if (i >= kEndRepeats && Clock::now() >= deadline_) return;
    send_session(SessionState::kEnded);
  }
}

void Publisher::wait_for_work() {
  std::unique_lock lock(mutex_);
  const Clock::time_point now = Clock::now();
  const bool looks_for_answers =
      link_.receive && (outbox_.size() > 0 || now - last_probe_ < kProbeWait);
  Clock::time_point until = std::min(next_session_, deadline_);
  if (link_.map_poses) until = std::min<Clock::time_point>(until, now + kMapPoseInterval);
  if (looks_for_answers) until = std::min<Clock::time_point>(until, now + kListenInterval);
  const bool was_running = phase_ == Phase::kRunning;
  wake_.wait_until(lock, until, [this, was_running] {
    return !queue_.empty() || phase_ == Phase::kStopping ||
           (was_running && phase_ != Phase::kRunning);
  });
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
  const Clock::time_point now = Clock::now();
  next_session_ = now + options_.session_period;
  const bool may_wait = pacing_.adapts() && state == SessionState::kRunning;
  if (!health || (may_wait && now < next_health_)) return;
  const std::vector<std::uint8_t> message = encode(*health);
  const std::chrono::duration<double> seconds(static_cast<double>(message.size()) /
                                              (kHealthShare * pacing_.rate()));
  next_health_ = now + std::chrono::duration_cast<Clock::duration>(seconds);
  send_message(kHealthChannel, message);
}

bool Publisher::send_message(std::string_view channel, Bytes message) {
  const bool sent = link_.send(channel, message);
  const std::lock_guard lock(mutex_);
  counters_.messages_sent += sent ? 1 : 0;
  counters_.bytes_sent += sent ? message.size() : 0;
  counters_.send_failures += sent ? 0 : 1;
  return sent;
}

}  // namespace unimapper::lcm_port
