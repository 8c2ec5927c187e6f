#include "ports/lcm/earlier_sessions.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace unimapper::lcm_port {

namespace {

constexpr std::chrono::milliseconds kLookInterval{20};
constexpr std::chrono::milliseconds kNobodyAnswers{1500};
/// Everything is acknowledged by then, and the base answers.
constexpr std::chrono::milliseconds kEndTimeout{3000};

PublisherOptions with_short_end(PublisherOptions options) {
  options.finish_timeout = kEndTimeout;
  return options;
}

}  // namespace

EarlierSessionsSender::EarlierSessionsSender(wire::SenderStorage& storage, Link link,
                                             const PublisherOptions& options,
                                             std::function<void()> done)
    : storage_(storage),
      link_(std::move(link)),
      options_(with_short_end(options)),
      done_(std::move(done)) {
  sessions_ = storage_.earlier_sessions();
  std::erase_if(sessions_, [](const wire::EarlierSession& session) { return session.ended; });
  std::sort(sessions_.begin(), sessions_.end(),
            [](const auto& a, const auto& b) { return a.newest_stamp_ns > b.newest_stamp_ns; });
  counters_.sessions = sessions_.size();
  for (const wire::EarlierSession& session : sessions_) {
    counters_.keyframes += session.waiting.size();
  }
  thread_ = std::thread([this] { run(); });
}

EarlierSessionsSender::~EarlierSessionsSender() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

EarlierCounters EarlierSessionsSender::finish(std::chrono::milliseconds timeout) {
  const auto begin = std::chrono::steady_clock::now();
  {
    std::unique_lock lock(mutex_);
    wake_.wait_until(lock, begin + std::min(timeout, kNobodyAnswers),
                     [this] { return over_ || base_answers_; });
    if (base_answers_) wake_.wait_until(lock, begin + timeout, [this] { return over_; });
  }
  return counters();
}

EarlierCounters EarlierSessionsSender::counters() const {
  const std::lock_guard lock(mutex_);
  EarlierCounters counters = counters_;
  counters.keyframes_acknowledged += present_.keyframes_acknowledged;
  counters.keyframes_lost += present_.keyframes_lost;
  return counters;
}

bool EarlierSessionsSender::wait() {
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, kLookInterval, [this] { return stopping_; });
}

void EarlierSessionsSender::run() {
  for (const wire::EarlierSession& session : sessions_) {
    try {
      if (!deliver(session)) return;
    } catch (const std::invalid_argument&) {
      continue;  // a name that no base would take
    }
  }
  if (done_) done_();
  const std::lock_guard lock(mutex_);
  over_ = true;
  wake_.notify_all();
}

/// False if it was stopped before.
bool EarlierSessionsSender::deliver(const wire::EarlierSession& session) {
  Publisher publisher(session.info, link_, options_, &storage_);
  publisher.resume(session);
  // What was lost before this start is not counted as lost now.
  const std::uint64_t lost_before = publisher.counters().keyframes_lost();
  while (true) {
    const PublisherCounters counters = publisher.counters();
    {
      const std::lock_guard lock(mutex_);
      present_.keyframes_acknowledged = counters.keyframes_acknowledged;
      present_.keyframes_lost = counters.keyframes_lost() - lost_before;
      base_answers_ = base_answers_ || counters.base_answers;
      wake_.notify_all();
    }
    if (counters.keyframes_waiting == 0 && counters.base_answers) break;
    if (!wait()) return false;
  }
  const bool ended = publisher.finish().end_confirmed;
  const std::lock_guard lock(mutex_);
  counters_.keyframes_acknowledged += present_.keyframes_acknowledged;
  counters_.keyframes_lost += present_.keyframes_lost;
  counters_.sessions_delivered += ended ? 1 : 0;
  present_ = {};
  return true;
}

}  // namespace unimapper::lcm_port
