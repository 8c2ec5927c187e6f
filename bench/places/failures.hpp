// False and missed loops of an evaluation.
#pragma once

#include <cstddef>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// A false loop, or a query without its loop.
struct Failure {
  std::size_t row = 0;  ///< index into the rows
  const TopCandidate* top = nullptr;
  const char* why = "";
};

/// True if a wrong candidate was accepted.
[[nodiscard]] bool is_false_loop(const TopCandidate& top);

/// False loops by falling confidence, then missed loops by falling common view. Point into `rows`.
[[nodiscard]] std::vector<Failure> failures_of(const std::vector<PairRow>& rows);

}  // namespace unimapper::bench
