#include "src/apps/report/measured_load.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/apps/report/format.hpp"

namespace unimapper::apps {
namespace {

std::string count_or_unknown(unsigned count, const std::string& one, const std::string& many) {
  if (count == 0) return "an unknown number of " + many;
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string load_or_unknown(double load) { return load < 0.0 ? "unknown" : fixed(load, 2); }

nlohmann::ordered_json known_load(double load) {
  return load < 0.0 ? nlohmann::ordered_json() : nlohmann::ordered_json(load);
}

}  // namespace

MeasuredLoad load_between(const linux_port::HostLoad& before, const linux_port::HostLoad& after) {
  return {before.processor, before.cores, std::max(before.same_program, after.same_program),
          before.load_average, after.load_average};
}

std::string load_text(const MeasuredLoad& load) {
  return (load.processor.empty() ? "unknown processor" : load.processor) + ", " +
         count_or_unknown(load.cores, "core", "cores") + "; " +
         count_or_unknown(load.same_program, "process of unimapper", "processes of unimapper") +
         "; load average " + load_or_unknown(load.load_before) + " at the start, " +
         load_or_unknown(load.load_after) + " at the end";
}

nlohmann::ordered_json load_json(const MeasuredLoad& load) {
  return {{"processor", load.processor},
          {"cores", load.cores},
          {"processes", load.same_program},
          {"average_before", known_load(load.load_before)},
          {"average_after", known_load(load.load_after)}};
}

std::optional<MeasuredLoad> load_of_json(const nlohmann::ordered_json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto average = [&](const char* name) {
    const bool is_known = json.contains(name) && json[name].is_number();
    return is_known ? json[name].get<double>() : -1.0;
  };
  try {
    return MeasuredLoad{json.value("processor", ""), json.value("cores", 0U),
                        json.value("processes", 0U), average("average_before"),
                        average("average_after")};
  } catch (const nlohmann::ordered_json::exception&) {
    return std::nullopt;
  }
}

}  // namespace unimapper::apps
