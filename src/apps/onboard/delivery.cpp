#include "src/apps/onboard/delivery.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "ports/lcm/envelope.hpp"
#include "ports/lcm/live.hpp"

namespace unimapper::apps {

namespace {

constexpr std::chrono::milliseconds kDiskTimeout{10000};
constexpr std::chrono::milliseconds kEarlierTimeout{30000};

using Count = unsigned long long;

std::unique_ptr<spool::Spool> open_spool(const OnboardOptions& options) {
  if (options.spool.empty()) return nullptr;
  spool::SpoolOptions limits;
  limits.bytes = options.spool_bytes;
  limits.segment_bytes = std::min(limits.segment_bytes, limits.bytes / 4);
  limits.report = [](const std::string& text) {
    std::fprintf(stderr, "onboard: warning: spool %s\n", text.c_str());
  };
  return std::make_unique<spool::Spool>(options.spool, limits);
}

lcm_port::PublisherOptions publisher_options(const OnboardOptions& options, bool has_key) {
  lcm_port::PublisherOptions publisher;
  // Faster than real time, sending may block; in real time it must not.
  publisher.drop_when_full = options.realtime;
  publisher.datagram_bytes = options.datagram_bytes;
  if (has_key) {
    // With the envelope, a datagram is as large as asked for.
    publisher.datagram_bytes = std::max(options.datagram_bytes - lcm_port::kEnvelopeBytes,
                                        lcm_port::kSmallestDatagramBytes);
  }
  publisher.bytes_per_second = options.bytes_per_second;
  publisher.min_bytes_per_second = options.min_bytes_per_second;
  publisher.unacknowledged_bytes = options.unacknowledged_bytes;
  return publisher;
}

bool has_earlier_sessions(const spool::Spool* spool) {
  if (spool == nullptr) return false;
  const auto sessions = spool->earlier_sessions();
  return std::any_of(sessions.begin(), sessions.end(),
                     [](const wire::EarlierSession& session) { return !session.ended; });
}

/// What the link was like at the end.
void print_link(const lcm_port::PublisherCounters& own) {
  if (!own.rate_adapts) {
    std::fprintf(stderr, "onboard: sent at up to %.0f kB/s; no base said what arrives\n",
                 own.bytes_per_second * 1e-3);
    return;
  }
  std::fprintf(stderr,
               "onboard: link: %.0f kB/s at the end, %.1f %% of the pieces lost lately, round trip "
               "%.1f ms, window of the base %.0f kB\n",
               own.bytes_per_second * 1e-3, 100.0 * own.loss,
               static_cast<double>(own.round_trip_ns) * 1e-6,
               static_cast<double>(own.window_bytes) * 1e-3);
  if (!own.clock) return;
  std::fprintf(stderr, "onboard: the base's clock is ahead by %.1f ms (within %.1f ms)\n",
               static_cast<double>(own.clock->base_minus_robot_ns) * 1e-6,
               static_cast<double>(own.clock->uncertainty_ns) * 1e-6);
}

}  // namespace

Delivery::Delivery(const OnboardOptions& options, const SessionInfo& info,
                   const keys::RobotKey* key)
    : options_(options), info_(info), spool_(open_spool(options)) {
  if (options.publish.empty()) return;
  if (key != nullptr) guard_ = std::make_shared<keys::RobotGuard>(*key, info.id.boot);
  if (spool_ == nullptr) {
    std::fprintf(stderr,
                 "onboard: no --spool: what no base acknowledges is sent again from memory (%.0f "
                 "MB) until this process ends\n",
                 static_cast<double>(options.unacknowledged_bytes) * 1e-6);
  }
  lcm_port::PublisherOptions publisher = publisher_options(options, key != nullptr);
  lcm_port::SharedLink link(lcm_port::open_link(options.publish, guard_));
  if (!has_earlier_sessions(spool_.get())) {
    publisher_ = std::make_unique<lcm_port::Publisher>(info, link.share(), publisher, spool_.get());
    return;
  }
  const double rate = publisher.bytes_per_second;
  lcm_port::PublisherOptions earlier = publisher;
  earlier.bytes_per_second = std::max(1000.0, lcm_port::kBackfillShare * rate);
  publisher.bytes_per_second = std::max(1000.0, (1.0 - lcm_port::kBackfillShare) * rate);
  publisher_ = std::make_unique<lcm_port::Publisher>(info, link.share(), publisher, spool_.get());
  earlier_ = std::make_unique<lcm_port::EarlierSessionsSender>(
      *spool_, link.share(), earlier,
      [to = publisher_.get(), rate] { to->set_bytes_per_second(rate); });
  const lcm_port::EarlierCounters found = earlier_->counters();
  std::fprintf(stderr,
               "onboard: the spool holds %llu keyframes of %llu earlier sessions that no base has "
               "confirmed; they are sent too\n",
               static_cast<Count>(found.keyframes), static_cast<Count>(found.sessions));
}

void Delivery::take(wire::EncodedKeyframe keyframe) {
  if (publisher_ != nullptr) {
    publisher_->publish(std::move(keyframe));
  } else if (spool_ != nullptr) {
    spool_->add(info_, keyframe);
  }
}

DeliveryCounters Delivery::finish() {
  DeliveryCounters counters;
  counters.published = publisher_ != nullptr;
  counters.spooled = spool_ != nullptr;
  if (publisher_ != nullptr) counters.own = publisher_->finish();
  if (earlier_ != nullptr) counters.earlier = earlier_->finish(kEarlierTimeout);
  // All who used it have finished.
  if (guard_ != nullptr) counters.answers = guard_->counters();
  if (spool_ != nullptr) {
    (void)spool_->flush(kDiskTimeout);
    counters.disk = spool_->counters();
  }
  return counters;
}

void print_delivery(const DeliveryCounters& counters, std::uint64_t keyframes,
                    const OnboardOptions& options) {
  const lcm_port::PublisherCounters& own = counters.own;
  if (counters.published) {
    std::fprintf(stderr,
                 "onboard: %llu of %llu keyframes acknowledged by a base; %llu waiting in the "
                 "spool, %llu sent without an answer, %llu not sent; %llu pieces sent again\n",
                 static_cast<Count>(own.keyframes_acknowledged), static_cast<Count>(keyframes),
                 static_cast<Count>(own.keyframes_waiting),
                 static_cast<Count>(own.keyframes_unacknowledged),
                 static_cast<Count>(own.keyframes_dropped), static_cast<Count>(own.pieces_resent));
    print_link(own);
    if (!counters.spooled && own.keyframes_lost() > 0) {
      std::fprintf(stderr, "onboard: without --spool they are not sent again; %s has them all\n",
                   (options.out / "keyframes.lcmlog").c_str());
    }
    if (own.send_failures > 0) {
      std::fprintf(stderr, "onboard: warning: the network refused %llu datagrams\n",
                   static_cast<Count>(own.send_failures));
    }
  }
  if (counters.answers.refused() > 0) {
    std::fprintf(stderr, "onboard: warning: answers refused for their keys: %s\n",
                 keys::describe(counters.answers).c_str());
  }
  if (counters.earlier.sessions > 0) {
    std::fprintf(stderr,
                 "onboard: of earlier sessions %llu of %llu delivered, %llu of %llu keyframes "
                 "acknowledged, %llu lost\n",
                 static_cast<Count>(counters.earlier.sessions_delivered),
                 static_cast<Count>(counters.earlier.sessions),
                 static_cast<Count>(counters.earlier.keyframes_acknowledged),
                 static_cast<Count>(counters.earlier.keyframes),
                 static_cast<Count>(counters.earlier.keyframes_lost));
  }
  if (!counters.spooled) return;
  const spool::SpoolCounters& disk = counters.disk;
  std::fprintf(stderr,
               "onboard: spool %s: %llu keyframes in %.1f MB; %llu of this run written, %llu not "
               "written, %llu removed unacknowledged\n",
               options.spool.c_str(), static_cast<Count>(disk.keyframes_on_disk),
               static_cast<double>(disk.bytes_on_disk) * 1e-6,
               static_cast<Count>(disk.keyframes_durable),
               static_cast<Count>(disk.keyframes_added - disk.keyframes_durable),
               static_cast<Count>(disk.keyframes_lost));
}

}  // namespace unimapper::apps
