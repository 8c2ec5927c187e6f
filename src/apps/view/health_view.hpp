// History of a robot's health as the page shows it.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "ports/store/health_reader.hpp"

namespace unimapper::apps {

/// By how much the base's clock is ahead of the robot's, of a detail of kind "clock".
[[nodiscard]] double clock_offset_ms(const store::HealthDetail& clock);

/// Half of the shortest round trip that a message knows; none where it does not.
[[nodiscard]] std::optional<double> link_latency_ms(const store::HealthRow& health);

/// A robot of `api/health`: figures over time (docs/api.md); null without any. `row`: of its
/// session in the store.
[[nodiscard]] nlohmann::ordered_json describe_health(const std::vector<store::HealthRow>& history,
                                                     std::int64_t row);

}  // namespace unimapper::apps
