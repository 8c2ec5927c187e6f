// What went wrong: false loops and missed ones.
#pragma once

#include <cstddef>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// A wrong answer that was accepted, or a query that was missed.
struct Failure {
  std::size_t row = 0;  ///< index into the rows
  const TopAnswer* top = nullptr;
  const char* why = "";
};

/// True if a wrong answer was accepted.
[[nodiscard]] bool is_false_loop(const TopAnswer& top);

/// All of them, false loops before missed ones; the surest of the former and the best seen of the
/// latter first. Point into `rows`.
[[nodiscard]] std::vector<Failure> failures_of(const std::vector<PairRow>& rows);

}  // namespace unimapper::bench
