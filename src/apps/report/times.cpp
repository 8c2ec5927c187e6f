#include "src/apps/report/times.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "src/apps/report/run_stats.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

std::string text_or_unknown(const std::optional<MeasuredLoad>& load) {
  return load ? load_text(*load) : kLoadUnknown;
}

Json online_times(const ReportInput& input) {
  Json online = Json::array();
  for (std::size_t s = 0; s < input.references.size(); ++s) {
    const auto stats = read_run_stats(input.references[s].run);
    if (!stats) continue;
    const auto total =
        std::find_if(stats->stages.begin(), stats->stages.end(),
                     [](const StageLatency& stage) { return stage.name == kTotalStage; });
    if (total == stats->stages.end()) continue;
    online.push_back({{"session", s},
                      {"p50_ms", total->p50_ms},
                      {"p99_ms", total->p99_ms},
                      {"max_ms", total->max_ms},
                      {"load", text_or_unknown(stats->load)}});
  }
  return online;
}

Json merge_times(const ReportInput& input) {
  if (input.result->timing.empty()) return nullptr;
  Json stages = Json::array();
  for (const merge::StageTime& stage : input.result->timing) {
    stages.push_back({{"stage", stage.stage}, {"seconds", stage.seconds}});
  }
  return {{"load", text_or_unknown(input.load)}, {"stages", stages}};
}

}  // namespace

void add_times(MapFiles& files, const ReportInput& input) {
  const Json json = {{"online", online_times(input)}, {"timing", merge_times(input)}};
  files.times = json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace unimapper::apps
