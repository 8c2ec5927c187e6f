// Latency benchmark of hostile (adversarial) scans.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "unimapper/onboard/config.hpp"

namespace unimapper::bench {

/// Times `keyframes` keyframes of every kind of hostile scan, after those of the warm-up.
/// `normal_worst_ms` is the total of the worst normal keyframe; the table on stderr gives each
/// kind's worst as a multiple of it.
[[nodiscard]] nlohmann::ordered_json time_hostile_scans(const PipelineConfig& config,
                                                        double normal_worst_ms, int keyframes);

}  // namespace unimapper::bench
