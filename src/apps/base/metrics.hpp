// Counters of a base in the text format of Prometheus.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "ports/nats/downlink.hpp"
#include "ports/nats/uplink.hpp"
#include "ports/store/keyframe_store.hpp"
#include "src/apps/base/live_merge.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::apps {

/// What a base has counted since its start.
struct BaseCounters {
  wire::ReceiverCounters received;
  store::StoreCounters stored;
  std::optional<nats_port::UplinkCounters> uplink;      ///< of a site
  std::optional<nats_port::DownlinkCounters> downlink;  ///< of a centre
  std::optional<LiveMergeCounters> merges{};            ///< of a base that merges
  std::optional<std::int64_t> epoch{};                  ///< the latest; empty: not known now
};

/// Counters, and gauges over the sessions that are heard; about 6 kB.
std::string metrics_text(const BaseCounters& counters,
                         std::span<const wire::SessionProgress> sessions);

}  // namespace unimapper::apps
