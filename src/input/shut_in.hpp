// Scans from within a closed cabin
#pragma once

#include "ports/datasets/dataset.hpp"

namespace unimapper::input {

/// Whether nothing but a closed cabin was seen, as in a lift (`CabinTest`). O(points).
[[nodiscard]] bool is_shut_in(const datasets::Scan& scan);

}  // namespace unimapper::input
