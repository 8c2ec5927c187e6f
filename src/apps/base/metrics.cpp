#include "src/apps/base/metrics.hpp"

#include <fmt/format.h>

#include <chrono>
#include <set>

namespace unimapper::apps {
namespace {

class Text {
 public:
  template <typename Value>
  void add(const char* type, const char* name, const char* help, Value value) {
    text_ += fmt::format("# HELP unimapper_{0} {1}\n# TYPE unimapper_{0} {2}\nunimapper_{0} {3}\n",
                         name, help, type, value);
  }
  template <typename Value>
  void count(const char* name, const char* help, Value value) {
    add("counter", name, help, value);
  }
  template <typename Value>
  void gauge(const char* name, const char* help, Value value) {
    add("gauge", name, help, value);
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

void add_receiver(Text& text, const wire::ReceiverCounters& received) {
  text.count("messages_total", "Messages of robots", received.messages);
  text.count("messages_malformed_total", "Messages that could not be decoded", received.malformed);
  text.count("refused_total", "Sessions, keyframes and pieces beyond a limit", received.refused);
  text.count("contradictory_total", "Messages that contradict earlier ones",
             received.contradictory);
  text.count("pieces_duplicate_total", "Pieces that had come before", received.pieces_duplicate);
  text.count("keyframes_damaged_total", "Keyframes with a wrong checksum or content",
             received.keyframes_damaged);
  text.count("keyframes_abandoned_total", "Incomplete keyframes that gave way at a limit",
             received.keyframes_abandoned);
}

void add_store(Text& text, const store::StoreCounters& stored) {
  text.count("keyframes_stored_total", "Keyframes stored", stored.keyframes);
  text.count("keyframe_bytes_stored_total", "Bytes of the keyframes stored", stored.bytes);
  text.count("keyframes_repeated_total", "Keyframes that were stored already", stored.repeated);
  text.count("commits_total", "Commits that succeeded", stored.commits);
  text.count("commits_failed_total", "Commits that were rolled back", stored.failed_commits);
  text.count("commit_seconds_total", "Time that commits took", seconds(stored.commit_time));
  text.gauge("commit_seconds_max", "Longest commit", seconds(stored.longest_commit));
}

void add_sessions(Text& text, std::span<const wire::SessionProgress> sessions) {
  std::set<std::uint32_t> robots;
  std::uint64_t open = 0;
  std::uint64_t missing = 0;
  for (const wire::SessionProgress& session : sessions) {
    robots.insert(session.info.id.robot);
    open += session.ended ? 0 : 1;
    missing += session.announced - std::min(session.announced, session.received);
  }
  text.gauge("robots", "Robots heard", robots.size());
  text.gauge("sessions_open", "Sessions heard that have not ended", open);
  text.gauge("keyframes_missing", "Keyframes announced and not stored", missing);
}

}  // namespace

std::string metrics_text(const BaseCounters& counters,
                         std::span<const wire::SessionProgress> sessions) {
  Text text;
  add_receiver(text, counters.received);
  add_store(text, counters.stored);
  add_sessions(text, sessions);
  if (const auto& uplink = counters.uplink) {
    text.count("uplink_keyframes_total", "Keyframes that the stream acknowledged",
               uplink->keyframes);
    text.count("uplink_failures_total", "Attempts that failed and were repeated", uplink->failures);
    text.count("uplink_too_large_total", "Times that a keyframe was too large for the server",
               uplink->too_large);
  }
  if (const auto& downlink = counters.downlink) {
    text.count("downlink_stored_total", "Messages of sites that are stored", downlink->stored);
    text.count("downlink_postponed_total", "Messages that come again", downlink->postponed);
    text.count("downlink_dropped_total", "Messages that were forged or damaged", downlink->dropped);
    text.count("downlink_failures_total", "Connections that ended with a reason",
               downlink->failures);
  }
  return text.take();
}

}  // namespace unimapper::apps
