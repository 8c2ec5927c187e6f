#include "ports/delivery/delivery.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "ports/lcm/envelope.hpp"
#include "ports/lcm/live.hpp"

namespace unimapper::delivery {

namespace {

constexpr double kLowestShareOfRate = 1000.0;  ///< bytes per second

std::unique_ptr<spool::Spool> open_spool(const DeliveryOptions& options) {
  if (options.spool.empty()) return nullptr;
  spool::SpoolOptions limits = options.spool_limits;
  limits.segment_bytes = std::min(limits.segment_bytes, limits.bytes / 4);
  return std::make_unique<spool::Spool>(options.spool, limits);
}

lcm_port::PublisherOptions within_envelope(const DeliveryOptions& options) {
  lcm_port::PublisherOptions publisher = options.publisher;
  if (options.guard != nullptr) {
    publisher.datagram_bytes = std::max(publisher.datagram_bytes - lcm_port::kEnvelopeBytes,
                                        lcm_port::kSmallestDatagramBytes);
  }
  return publisher;
}

bool has_earlier_sessions(const spool::Spool* spool) {
  if (spool == nullptr) return false;
  const auto sessions = spool->earlier_sessions();
  return std::any_of(sessions.begin(), sessions.end(),
                     [](const wire::EarlierSession& session) { return !session.ended; });
}

}  // namespace

Delivery::Delivery(const SessionInfo& info, DeliveryOptions options)
    : info_(info), options_(std::move(options)), spool_(open_spool(options_)) {
  if (!options_.url.empty()) begin(lcm_port::open_link(options_.url, options_.guard));
}

Delivery::Delivery(const SessionInfo& info, DeliveryOptions options, lcm_port::Link network)
    : info_(info), options_(std::move(options)), spool_(open_spool(options_)) {
  begin(std::move(network));
}

void Delivery::begin(lcm_port::Link network) {
  lcm_port::PublisherOptions own = within_envelope(options_);
  lcm_port::SharedLink link(std::move(network));
  if (!has_earlier_sessions(spool_.get())) {
    publisher_ = std::make_unique<lcm_port::Publisher>(info_, link.share(), own, spool_.get());
    return;
  }
  const double rate = own.bytes_per_second;
  lcm_port::PublisherOptions earlier = own;
  earlier.bytes_per_second = std::max(kLowestShareOfRate, lcm_port::kBackfillShare * rate);
  own.bytes_per_second = std::max(kLowestShareOfRate, (1.0 - lcm_port::kBackfillShare) * rate);
  publisher_ = std::make_unique<lcm_port::Publisher>(info_, link.share(), own, spool_.get());
  earlier_ = std::make_unique<lcm_port::EarlierSessionsSender>(
      *spool_, link.share(), earlier,
      [to = publisher_.get(), rate] { to->set_bytes_per_second(rate); });
}

void Delivery::publish(wire::EncodedKeyframe keyframe) {
  if (publisher_ != nullptr) {
    publisher_->publish(std::move(keyframe));
  } else if (spool_ != nullptr) {
    spool_->add(info_, keyframe);
  }
}

void Delivery::set_health(wire::HealthMessage health) {
  if (publisher_ == nullptr) return;
  health.session = info_.id;
  health.bytes_sent = publisher_->counters().bytes_sent;
  if (spool_ != nullptr) {
    health.containers.push_back({std::string(wire::kSpoolContainer),
                                 spool_->counters().bytes_waiting, options_.spool_limits.bytes});
  }
  publisher_->set_health(std::move(health));
}

DeliveryCounters Delivery::counters() const {
  DeliveryCounters counters;
  counters.published = publisher_ != nullptr;
  counters.spooled = spool_ != nullptr;
  if (publisher_ != nullptr) counters.own = publisher_->counters();
  if (earlier_ != nullptr) counters.earlier = earlier_->counters();
  if (spool_ != nullptr) counters.disk = spool_->counters();
  return counters;
}

std::optional<lcm_port::HeardMapPose> Delivery::map_pose() const {
  return publisher_ != nullptr ? publisher_->map_pose() : std::nullopt;
}

DeliveryCounters Delivery::finish() {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  if (publisher_ != nullptr) (void)publisher_->finish();
  if (earlier_ != nullptr) {
    const auto taken = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
    const auto left = std::max(options_.finish_timeout - taken, std::chrono::milliseconds::zero());
    (void)earlier_->finish(std::min(options_.earlier_timeout, left));
  }
  if (spool_ != nullptr) (void)spool_->flush(options_.disk_timeout);
  return counters();
}

}  // namespace unimapper::delivery
