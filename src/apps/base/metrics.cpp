#include "src/apps/base/metrics.hpp"

#include <algorithm>
#include <set>

#include "src/apps/prometheus_text.hpp"

namespace unimapper::apps {
namespace {

void add_receiver(PrometheusText& text, const wire::ReceiverCounters& received) {
  text.count("messages_total", "Messages of robots", received.messages);
  text.count("messages_malformed_total", "Messages that could not be decoded", received.malformed);
  text.count("datagrams_dropped_total", "Datagrams that came faster than they were taken",
             received.overflowed);
  text.count("refused_total", "Sessions, keyframes and pieces beyond a limit", received.refused);
  text.count("contradictory_total", "Messages that contradict earlier ones",
             received.contradictory);
  text.count("pieces_duplicate_total", "Pieces that had come before", received.pieces_duplicate);
  text.count("keyframes_damaged_total", "Keyframes with a wrong checksum or content",
             received.keyframes_damaged);
  text.count("keyframes_abandoned_total", "Incomplete keyframes that gave way at a limit",
             received.keyframes_abandoned);
}

void add_store(PrometheusText& text, const store::StoreCounters& stored) {
  text.count("keyframes_stored_total", "Keyframes stored", stored.keyframes);
  text.count("keyframe_bytes_stored_total", "Bytes of the keyframes stored", stored.bytes);
  text.count("keyframes_repeated_total", "Keyframes that were stored already", stored.repeated);
  text.count("commits_total", "Commits that succeeded", stored.commits);
  text.count("commits_failed_total", "Commits that were rolled back", stored.failed_commits);
  text.times("commit_seconds", "Time that a commit took", stored.commit_times);
  text.gauge("commit_seconds_max", "Longest commit", text.seconds(stored.longest_commit));
  text.times("keyframe_wait_seconds", "From the last piece of a keyframe to its commit",
             stored.waits);
}

void add_sessions(PrometheusText& text, std::span<const wire::SessionProgress> sessions) {
  std::set<std::uint32_t> robots;
  std::uint64_t open = 0;
  std::uint64_t missing = 0;
  std::uint64_t dropped = 0;
  for (const wire::SessionProgress& session : sessions) {
    robots.insert(session.info.id.robot);
    open += session.ended ? 0 : 1;
    missing += session.announced - std::min(session.announced, session.received);
    dropped += session.dropped;
  }
  text.gauge("robots", "Robots heard", robots.size());
  text.gauge("sessions_open", "Sessions heard that have not ended", open);
  text.gauge("keyframes_missing", "Keyframes announced and not stored", missing);
  text.gauge("keyframes_dropped_by_robots", "Keyframes announced that robots have dropped",
             dropped);
}

void add_uplink(PrometheusText& text, const nats_port::UplinkCounters& uplink) {
  text.count("uplink_keyframes_total", "Keyframes that the stream acknowledged", uplink.keyframes);
  text.count("uplink_failures_total", "Attempts that failed and were repeated", uplink.failures);
  text.count("uplink_too_large_total", "Times that a keyframe was too large for the server",
             uplink.too_large);
  text.gauge("uplink_waiting", "Keyframes stored that the stream has not acknowledged",
             uplink.waiting);
}

void add_downlink(PrometheusText& text, const nats_port::DownlinkCounters& downlink) {
  text.count("downlink_stored_total", "Messages of sites that are stored", downlink.stored);
  text.count("downlink_postponed_total", "Messages that come again", downlink.postponed);
  text.count("downlink_dropped_total", "Messages that were forged or damaged", downlink.dropped);
  text.count("downlink_failures_total", "Connections that ended with a reason", downlink.failures);
}

void add_merges(PrometheusText& text, const LiveMergeCounters& merges) {
  text.count("merges_total", "Merges that ended with a map", merges.merges);
  text.gauge("merge_seconds_max", "Longest merge", text.seconds(merges.longest_merge));
  text.gauge("keyframe_in_map_seconds_max",
             "Longest time from a keyframe's commit to the end of its merge",
             text.seconds(merges.longest_effect));
}

}  // namespace

std::string metrics_text(const BaseCounters& counters,
                         std::span<const wire::SessionProgress> sessions) {
  PrometheusText text;
  add_receiver(text, counters.received);
  add_store(text, counters.stored);
  add_sessions(text, sessions);
  if (counters.epoch) text.gauge("epoch", "Latest epoch of the store's project", *counters.epoch);
  if (counters.uplink) add_uplink(text, *counters.uplink);
  if (counters.downlink) add_downlink(text, *counters.downlink);
  if (counters.merges) add_merges(text, *counters.merges);
  return text.take();
}

}  // namespace unimapper::apps
