// Scans from within a closed cabin
#pragma once

#include "ports/datasets/dataset.hpp"

namespace unimapper::input {

/// Whether nothing but a closed cabin of a few metres was seen, as in a lift: returns on all
/// sides, and all but one in fifty of them within 3.5 m, measured along the sensor's level. A
/// narrow view cannot tell. O(points).
[[nodiscard]] bool is_shut_in(const datasets::Scan& scan);

}  // namespace unimapper::input
