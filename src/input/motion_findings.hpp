// Findings from the agreement of scans under motions
#pragma once

#include "src/input/finding.hpp"
#include "src/input/motion_check.hpp"

namespace unimapper::input {

/// Scans that follow each other but show different places: a sensor that was covered or carried,
/// scans that are missing, or an order that is not that of time.
[[nodiscard]] Finding check_succession(const AgreementFigures& agreement);

/// Whether a known mistake, undone, agrees about as well as a registration does.
[[nodiscard]] bool has_known_mistake(const AgreementFigures& agreement);

/// Poses that do not belong to the scans, or are of another convention.
[[nodiscard]] Finding check_motion(const AgreementFigures& agreement);

}  // namespace unimapper::input
