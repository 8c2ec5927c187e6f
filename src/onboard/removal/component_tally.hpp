// Tally of a connected component
#pragma once

#include <cstdint>

#include "src/free_space/component_outline.hpp"

namespace unimapper::onboard {

/// What is known of a component.
struct ComponentTally {
  std::uint32_t cells = 0;
  std::uint32_t evidence = 0;          ///< magnitudes of the cells' log-odds, each clamped
  std::uint32_t evidence_dynamic = 0;  ///< magnitudes of the log-odds that say dynamic
  std::uint32_t was_dynamic = 0;
  std::uint32_t was_static = 0;
  CellBox box;  ///< of all but followers; wider than a pole, where it is not complete
};

}  // namespace unimapper::onboard
