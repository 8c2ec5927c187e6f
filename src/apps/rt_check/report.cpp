#include "src/apps/rt_check/report.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace unimapper::apps {

using linux_port::CheckStatus;
using linux_port::Finding;

namespace {

std::string row(const char* status, const std::string& name, const std::string& value) {
  char line[256];
  std::snprintf(line, sizeof line, "%-8s %-23s %s\n", status, name.c_str(), value.c_str());
  return line;
}

std::string wakeup_text(const linux_port::WakeupLatency& wakeup) {
  char text[160];
  std::snprintf(text, sizeof text, "%.0f us median, %.0f us 99 %%, %.0f us longest of %zu (%s)",
                wakeup.p50_us, wakeup.p99_us, wakeup.max_us, wakeup.wakeups,
                wakeup.realtime ? "SCHED_FIFO" : "ordinary scheduling");
  return text;
}

std::string prefault_text(const linux_port::PrefaultTrial& trial) {
  return std::to_string(trial.bytes / 1024) +
         " kB: " + std::to_string(trial.faults_while_prefaulting) +
         " page faults while prefaulting, " + std::to_string(trial.faults_afterwards) + " in use";
}

}  // namespace

std::string RtReport::refused() const {
  std::string names;
  for (const Finding& finding : findings) {
    if (finding.status != CheckStatus::kRefused) continue;
    names += (names.empty() ? "" : ", ") + finding.name;
  }
  return names;
}

std::string RtReport::to_text() const {
  std::string text;
  for (const Finding& finding : findings) {
    text += row(status_name(finding.status), finding.name, finding.value);
    if (!finding.advice.empty()) text += "         -> " + finding.advice + "\n";
  }
  text += row("measured", "wake-up latency", wakeup_text(wakeup));
  text += row(prefault.faults_afterwards == 0 ? "good" : "warning", "prefault",
              prefault_text(prefault));
  return text;
}

std::string RtReport::to_json() const {
  nlohmann::ordered_json json;
  json["ready"] = refused().empty();
  auto& checks = json["checks"] = nlohmann::ordered_json::object();
  for (const Finding& finding : findings) {
    checks[finding.name] = {{"status", status_name(finding.status)},
                            {"value", finding.value},
                            {"advice", finding.advice}};
  }
  json["wakeup"] = {{"wakeups", wakeup.wakeups},
                    {"realtime", wakeup.realtime},
                    {"p50_us", wakeup.p50_us},
                    {"p99_us", wakeup.p99_us},
                    {"max_us", wakeup.max_us}};
  json["prefault"] = {{"bytes", prefault.bytes},
                      {"faults_while_prefaulting", prefault.faults_while_prefaulting},
                      {"faults_afterwards", prefault.faults_afterwards}};
  return json.dump(2) + "\n";
}

}  // namespace unimapper::apps
