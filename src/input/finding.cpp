// Names of severities and the worst of several findings
#include "src/input/finding.hpp"

#include <algorithm>
#include <array>

namespace unimapper::input {

std::string_view severity_name(Severity severity) {
  constexpr std::array<std::string_view, 3> kNames = {"fine", "suspicious", "wrong"};
  return kNames.at(static_cast<std::size_t>(severity));
}

Severity worst(const std::vector<Finding>& findings) {
  Severity worst = Severity::kFine;
  for (const Finding& finding : findings) worst = std::max(worst, finding.severity);
  return worst;
}

}  // namespace unimapper::input
