// Counters of a base in the text format of Prometheus.
#pragma once

#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "ports/nats/downlink.hpp"
#include "ports/nats/uplink.hpp"
#include "ports/store/keyframe_store.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::apps {

/// What a base has counted since its start.
struct BaseCounters {
  wire::ReceiverCounters received;
  store::StoreCounters stored;
  std::optional<nats_port::UplinkCounters> uplink;      ///< of a site
  std::optional<nats_port::DownlinkCounters> downlink;  ///< of a centre
};

/// Counters, and gauges over the sessions that are heard; about 4 kB.
std::string metrics_text(const BaseCounters& counters,
                         std::span<const wire::SessionProgress> sessions);

/// The latest text, from thread to thread.
class LatestMetrics {
 public:
  void set(std::string text) {
    const std::lock_guard<std::mutex> lock(guard_);
    text_ = std::move(text);
  }
  [[nodiscard]] std::string get() const {
    const std::lock_guard<std::mutex> lock(guard_);
    return text_;
  }

 private:
  mutable std::mutex guard_;
  std::string text_;
};

}  // namespace unimapper::apps
