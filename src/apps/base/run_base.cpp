// `unimapper base`: from the network into a store.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "ports/keys/guards.hpp"
#include "ports/lcm/live.hpp"
#include "ports/linux/boot_id.hpp"
#include "ports/nats/downlink.hpp"
#include "ports/nats/uplink.hpp"
#include "ports/store/keyframe_store.hpp"
#include "ports/store/process_io.hpp"
#include "ports/store/session_follower.hpp"
#include "src/apps/base/base_options.hpp"
#include "src/apps/base/localisation_thread.hpp"
#include "src/apps/base/merge_thread.hpp"
#include "src/apps/base/metrics.hpp"
#include "src/apps/prometheus_text.hpp"
#include "src/apps/say.hpp"
#include "src/apps/stop_signals.hpp"
#include "src/apps/view/map_files.hpp"
#include "src/apps/view/store_view.hpp"
#include "src/apps/view/view_server.hpp"

namespace unimapper::apps {
namespace {

constexpr double kBytesPerGigabyte = 1e9;
constexpr double kBytesPerMegabyte = 1e6;

/// What a base may hold besides what waits for the store: together about 150 MB, whatever arrives.
constexpr std::uint64_t kMaxPendingBytes = 64U << 20U;
constexpr std::uint64_t kMaxRobotPendingBytes = 16U << 20U;
/// Four of an OS2-128 at its largest; what decodes to a hundredfold stays bearable.
constexpr std::uint32_t kMaxKeyframeBytes = 4U << 20U;
constexpr std::uint64_t kMaxWaitingBytes = 32U << 20U;
constexpr std::uint32_t kMaxSessionsHeard = 256;
constexpr std::uint32_t kMaxDamaged = 1000;

std::uint64_t to_bytes(double amount, double unit) {
  return static_cast<std::uint64_t>(amount * unit);
}

wire::ReceiverLimits limits_of(const BaseOptions& options) {
  wire::ReceiverLimits limits;
  limits.max_sessions = kMaxSessionsHeard;
  limits.max_keyframe_bytes = kMaxKeyframeBytes;
  limits.max_pending_bytes = kMaxPendingBytes;
  limits.max_damaged = kMaxDamaged;
  limits.robot.sessions = options.robot_sessions;
  limits.robot.bytes = to_bytes(options.robot_gigabytes, kBytesPerGigabyte);
  limits.robot.bytes_per_second = options.robot_megabytes_per_second * kBytesPerMegabyte;
  limits.robot.pending_keyframes = options.robot_incomplete;
  limits.robot.pending_bytes = kMaxRobotPendingBytes;
  return limits;
}

std::string megabytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / kBytesPerMegabyte);
}

/// What was stored since the start, and what the sessions that were heard lack.
class Status {
 public:
  explicit Status(const store::KeyframeStore& kept) : store_(kept) {}

  /// One line if it says anything new.
  void tell(const std::vector<wire::SessionProgress>& sessions,
            const wire::ReceiverCounters& counters) {
    const std::string text = line(sessions, counters);
    if (text != last_line_ && !sessions.empty()) std::cout << text << std::endl;
    last_line_ = text;
    for (const wire::SessionProgress& session : sessions) {
      tell_refusal(session);
      tell_clock(session);
    }
    const std::string& trouble = store_.trouble();
    if (trouble != last_trouble_) {
      say(trouble.empty()
              ? "the store takes keyframes again"
              : "warning: nothing is stored or acknowledged, and it is tried again: " + trouble);
    }
    last_trouble_ = trouble;
  }

 private:
  /// Once for each session.
  void tell_refusal(const wire::SessionProgress& session) {
    if (session.refused == 0 || told_.size() >= kMaxSessionsHeard) return;
    if (!told_.insert(session.info.id).second) return;
    say("warning: session " + session.info.name + " of robot " +
        std::to_string(session.info.id.robot) +
        " is beyond a quota, or the store has no room: keyframes are refused");
  }

  /// Once for each session, and again when either clock was set.
  void tell_clock(const wire::SessionProgress& session) {
    if (!session.clock) return;
    const SessionId& id = session.info.id;
    const auto told = clock_steps_.find(id);
    if (told != clock_steps_.end() && told->second == session.clock->steps) return;
    if (told == clock_steps_.end() && clock_steps_.size() >= kMaxSessionsHeard) return;
    clock_steps_[id] = session.clock->steps;
    const std::string text = fmt::format(
        "the clock here is ahead of that of {} (robot {}) by {:.1f} ms, within {:.1f} ms",
        session.info.name, id.robot, static_cast<double>(session.clock->base_minus_robot_ns) * 1e-6,
        static_cast<double>(session.clock->uncertainty_ns) * 1e-6);
    say(text);
  }

  [[nodiscard]] std::string line(const std::vector<wire::SessionProgress>& sessions,
                                 const wire::ReceiverCounters& counters) const {
    std::set<std::uint32_t> robots;
    std::uint64_t missing = 0;
    std::uint64_t summaries = 0;
    std::uint64_t damaged = 0;
    std::uint64_t open = 0;
    for (const wire::SessionProgress& session : sessions) {
      robots.insert(session.info.id.robot);
      missing += session.announced - std::min(session.announced, session.received);
      summaries += session.summaries;
      damaged += session.damaged;
      open += session.ended ? 0 : 1;
    }
    const store::StoreCounters& stored = store_.counters();
    return "robots " + std::to_string(robots.size()) + ", sessions " +
           std::to_string(sessions.size()) + " (" + std::to_string(open) + " open), stored " +
           std::to_string(stored.keyframes) + " keyframes (" + megabytes(stored.bytes) +
           "), missing " + std::to_string(missing) +
           (summaries == 0 ? "" : " (summaries of " + std::to_string(summaries) + ")") +
           ", damaged " + std::to_string(damaged) + ", refused " + std::to_string(counters.refused);
  }

  const store::KeyframeStore& store_;
  std::set<SessionId> told_;
  std::map<SessionId, std::uint32_t> clock_steps_;  ///< told so far
  std::string last_line_;
  std::string last_trouble_;
};

/// What localises and merges leaves a processor to what receives and stores.
std::uint32_t background_threads() { return std::max(2U, std::thread::hardware_concurrency()) - 1; }

std::unique_ptr<LocalisationThread> start_localisation(const BaseOptions& options) {
  if (!options.localises) return nullptr;
  LiveLocalisationOptions live;
  live.store = options.store;
  live.max_sessions = options.localised_sessions;
  live.read_map = [store = options.store, memory_mb = options.memory_mb] {
    StoredMap map = read_stored_map(store, 0);
    map.config.threads = background_threads();
    if (memory_mb) map.config.memory_mb = *memory_mb;
    return map;
  };
  live.report = &say;
  return std::make_unique<LocalisationThread>(std::move(live));
}

std::unique_ptr<MergeThread> start_merges(const BaseOptions& options,
                                          const store::KeyframeStore& kept) {
  if (!options.merges) return nullptr;
  LiveMergeOptions live;
  live.store = options.store;
  live.config.threads = background_threads();
  if (options.memory_mb) live.config.memory_mb = *options.memory_mb;
  live.report = &say;
  return std::make_unique<MergeThread>(std::move(live), kept.lock());
}

void end_merges(MergeThread& merges) {
  LiveMergeCounters counters;
  try {
    counters = merges.finish();
  } catch (const std::exception& error) {
    return say(std::string("warning: what arrived last is stored, but not merged: ") +
               error.what());
  }
  const auto seconds = [](std::chrono::steady_clock::duration time) {
    return fmt::format("{:.1f} s", std::chrono::duration<double>(time).count());
  };
  say("merged " + std::to_string(counters.merges) + " times, " + seconds(counters.longest_merge) +
      " the longest; every keyframe was in the map " + seconds(counters.longest_effect) +
      " after it was stored at the latest; all loops at the end took " +
      seconds(counters.complete));
}

/// The page of the store while it is written, and its server.
struct Page {
  StoreView view;
  ViewServer server;

  Page(StoreViewOptions shown, const ViewServerOptions& serving)
      : view(std::move(shown)), server(serving, view) {}
};

std::unique_ptr<Page> start_page(const BaseOptions& options, const store::KeyframeStore& kept,
                                 const LatestMetrics& metrics) {
  if (options.http.empty()) return nullptr;
  StoreViewOptions shown;
  shown.store = options.store;
  shown.may_change = true;
  shown.held = &kept.lock();
  shown.report = &say;
  auto page = std::make_unique<Page>(std::move(shown),
                                     ViewServerOptions{options.http, make_token(), empty_page(),
                                                       [&metrics] { return metrics.get(); }});
  say("the map is at " + page->server.url());
  return page;
}

std::unique_ptr<nats_port::Uplink> start_uplink(const BaseOptions& options,
                                                const store::KeyframeStore& kept) {
  if (options.uplink.empty()) return nullptr;
  nats_port::UplinkOptions uplink;
  uplink.server = options.nats;
  uplink.server.url = options.uplink;
  uplink.store = options.store;
  uplink.site = options.site;
  uplink.sends_all = options.uplinks_all;
  uplink.report = &say;
  return nats_port::start_uplink(std::move(uplink), kept.lock());
}

std::unique_ptr<nats_port::Downlink> start_downlink(const BaseOptions& options,
                                                    store::KeyframeStore& kept) {
  if (options.from.empty()) return nullptr;
  nats_port::DownlinkOptions downlink;
  downlink.server = options.nats;
  downlink.server.url = options.from;
  downlink.max_keyframe_bytes = kMaxKeyframeBytes;
  downlink.report = &say;
  return nats_port::start_downlink(std::move(downlink), kept);
}

void report_uplink(const nats_port::UplinkCounters& counters) {
  say("the uplink sent " + std::to_string(counters.keyframes) + " keyframes and " +
      std::to_string(counters.sessions) + " messages about sessions; " +
      std::to_string(counters.failures) + " attempts failed, " +
      std::to_string(counters.too_large) + " keyframes were too large");
}

void report_downlink(const nats_port::DownlinkCounters& counters) {
  say("from the sites came " + std::to_string(counters.messages) +
      " messages: " + std::to_string(counters.stored) + " stored, " +
      std::to_string(counters.postponed) + " postponed, " + std::to_string(counters.dropped) +
      " dropped; " + std::to_string(counters.failures) + " connections failed");
}

std::optional<std::int64_t> epoch_of(store::SessionFollower& follower) {
  try {
    return follower.epoch();
  } catch (const store::StoreError&) {
    return std::nullopt;
  }
}

void report_localisation(const LiveLocalisationCounters& counters) {
  say("localised by " + std::to_string(counters.keyframes) + " keyframes; " +
      std::to_string(counters.late) + " came after later ones and " +
      std::to_string(counters.unusable) + " could not be used; " +
      std::to_string(counters.sessions_refused) + " times there was no room for a session");
}

void report_end(const store::KeyframeStore& kept, std::optional<std::uint64_t> written_before) {
  const store::StoreCounters& counters = kept.counters();
  say("stored " + std::to_string(counters.keyframes) + " keyframes, " +
      std::to_string(counters.bytes) + " bytes, in " + std::to_string(counters.commits) +
      " commits (" + std::to_string(counters.failed_commits) + " failed), the longest " +
      std::to_string(
          std::chrono::duration_cast<std::chrono::milliseconds>(counters.longest_commit).count()) +
      " ms");
  const std::optional<std::uint64_t> written = store::bytes_written_to_disk();
  if (!written || !written_before || counters.bytes == 0) return;
  const std::uint64_t bytes = *written - *written_before;
  const std::string ratio =
      fmt::format("{:.2f}", static_cast<double>(bytes) / static_cast<double>(counters.bytes));
  say("wrote " + std::to_string(bytes) + " bytes to the disk, " + ratio +
      " for each byte of a keyframe");
}

}  // namespace

void run_base(const BaseOptions& options) {
  const std::optional<std::uint64_t> written_before = store::bytes_written_to_disk();
  store::StoreOptions store_options;
  store_options.max_waiting_bytes = kMaxWaitingBytes;
  store_options.max_bytes = to_bytes(options.max_gigabytes, kBytesPerGigabyte);
  store::KeyframeStore kept(options.store, store_options);
  StopSignals signals;
  Status status(kept);
  LatestMetrics metrics;
  store::SessionFollower follower(options.store);
  std::unique_ptr<nats_port::Uplink> uplink;
  std::unique_ptr<nats_port::Downlink> downlink;
  std::unique_ptr<MergeThread> merges;
  lcm_port::ListenOptions listening;
  listening.url = options.listen.empty() ? lcm_port::kNoNetwork : options.listen;
  listening.sessions_expected = options.sessions;
  listening.limits = limits_of(options);
  listening.stop = [&signals] { return signals.arrived(); };
  listening.progress = &say;
  listening.status = [&](const auto& sessions, const auto& counters) {
    status.tell(sessions, counters);
    BaseCounters all{counters, kept.counters(), {}, {}};
    if (uplink != nullptr) all.uplink = uplink->counters();
    if (downlink != nullptr) all.downlink = downlink->counters();
    if (merges != nullptr) all.merges = merges->counters();
    all.epoch = epoch_of(follower);
    metrics.set(metrics_text(all, sessions));
  };
  std::shared_ptr<keys::BaseGuard> guard;
  if (!options.keys.empty()) {
    guard = std::make_shared<keys::BaseGuard>(options.keys, linux_port::random_boot());
  }
  listening.guard = guard;
  const std::unique_ptr<LocalisationThread> localisation = start_localisation(options);
  if (localisation != nullptr) {
    listening.map_poses = [&localisation] { return localisation->due(); };
  }
  merges = start_merges(options, kept);
  if (merges != nullptr) listening.map_poses = [&merges] { return merges->due(); };
  const std::unique_ptr<Page> page = start_page(options, kept, metrics);
  uplink = start_uplink(options, kept);
  downlink = start_downlink(options, kept);
  if (downlink != nullptr) {
    listening.feed = [&downlink](wire::Receiver& receiver) { downlink->take(receiver); };
    lcm_port::listen(listening, *downlink);
    report_downlink(downlink->counters());
  } else {
    lcm_port::listen(listening, kept);
  }
  if (uplink != nullptr) report_uplink(uplink->finish());
  if (localisation != nullptr) report_localisation(localisation->finish());
  if (merges != nullptr) end_merges(*merges);
  report_end(kept, written_before);
  if (guard != nullptr && guard->counters().refused() > 0) {
    say("warning: refused for their keys: " + keys::describe(guard->counters()));
  }
}

}  // namespace unimapper::apps
