// Result of one plausibility check of a recording
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace unimapper::input {

/// How sure a check is that the recording was handed over in the wrong form.
enum class Severity : std::uint8_t {
  kFine,        ///< nothing found, or nothing can be said
  kSuspicious,  ///< unusual: said to the user, mapped all the same
  kWrong,       ///< no right recording looks like this: refused without --force
};

/// "fine", "suspicious" or "wrong".
[[nodiscard]] std::string_view severity_name(Severity severity);

/// Beyond what a figure is said or refused; NaN where no figure alone decides.
struct Limits {
  double suspicious = std::numeric_limits<double>::quiet_NaN();
  double wrong = std::numeric_limits<double>::quiet_NaN();
};
/// Of a check that never refuses, or never only warns.
inline constexpr double kNoLimit = std::numeric_limits<double>::quiet_NaN();

/// What one check found.
struct Finding {
  std::string check;  ///< stable name, e.g. "units"
  Severity severity = Severity::kFine;
  double figure = 0.0;  ///< what was measured, in `unit`
  std::string unit;     ///< e.g. "m"; empty: a plain number
  std::string message;  ///< one sentence with the remedy; empty where nothing was found
  Limits limits{};      ///< of the figure's size, in `unit`
};

/// The largest severity; `kFine` without findings.
[[nodiscard]] Severity worst(const std::vector<Finding>& findings);

}  // namespace unimapper::input
