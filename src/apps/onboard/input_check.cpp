// Plausibility of a recording, told to the user before it is mapped.
#include "src/apps/onboard/input_check.hpp"

#include <cstdio>
#include <stdexcept>

#include "src/input/plausibility.hpp"
#include "src/input/text.hpp"

namespace unimapper::apps {

void print_warning(const input::Finding& finding) {
  std::fprintf(stderr, "onboard: warning: input, %s: %s\n", finding.check.c_str(),
               finding.message.c_str());
}

CheckedInput check_input(const OnboardOptions& options, const datasets::Dataset& dataset) {
  input::Plausibility found = input::examine(dataset, options.scans);
  std::vector<input::Finding>& findings = found.findings;
  const input::Finding* refusal = nullptr;
  for (const input::Finding& finding : findings) {
    if (finding.severity == input::Severity::kFine) continue;
    const bool refuses = finding.severity == input::Severity::kWrong && !options.force;
    if (refuses && refusal == nullptr) {
      refusal = &finding;
    } else {
      print_warning(finding);
    }
  }
  if (refusal != nullptr) {
    throw std::runtime_error(options.dataset.string() + ": " + refusal->check + ": " +
                             refusal->message + " (--force maps it as it is)");
  }
  return {std::move(findings), found.sensor, std::move(found.steps.breaks)};
}

std::optional<input::Finding> check_dynamic_share(double share, std::uint64_t scans) {
  // Measured: 0.05 to 25 % in right runs, above 49 % where poses or points were wrong.
  constexpr double kMost = 0.4;
  constexpr std::uint64_t kFewest = 5;
  if (share <= kMost || scans < kFewest) return std::nullopt;
  return input::Finding{
      "dynamic share", input::Severity::kSuspicious, 100.0 * share, "%",
      input::text(
          "%.0f %% of the points are dynamic, more than scenes show: likely causes are "
          "poses that are not those of the scans (order, stamps, convention, frame), points "
          "that are not compensated for the motion, or the wrong --sensor; unimapper "
          "inspect says more",
          100.0 * share)};
}

}  // namespace unimapper::apps
