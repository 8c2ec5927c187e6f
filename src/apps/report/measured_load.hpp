// Load under which times were taken, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "ports/linux/host_load.hpp"

namespace unimapper::apps {

/// Of a machine while something was measured.
struct MeasuredLoad {
  std::string processor;      ///< empty: unknown
  unsigned cores = 0;         ///< that the process might use; 0: unknown
  unsigned same_program = 0;  ///< processes of this program, the larger number of both; 0: unknown
  double load_before = -1.0;  ///< load average of a minute as it began; negative: unknown
  double load_after = -1.0;   ///< as it ended
};

/// From what `linux_port::host_load` said as it began and as it ended.
[[nodiscard]] MeasuredLoad load_between(const linux_port::HostLoad& before,
                                        const linux_port::HostLoad& after);

/// "Some processor, 4 cores; 3 processes of unimapper; load average 1.20 at the start, 2.70 at the
/// end". What is unknown is called so.
[[nodiscard]] std::string load_text(const MeasuredLoad& load);

/// Where no load was written: files of earlier versions.
inline constexpr const char* kLoadUnknown = "the load is not known";

/// `load` of stats.json.
[[nodiscard]] nlohmann::ordered_json load_json(const MeasuredLoad& load);
/// Nothing if it is none.
[[nodiscard]] std::optional<MeasuredLoad> load_of_json(const nlohmann::ordered_json& json);

}  // namespace unimapper::apps
