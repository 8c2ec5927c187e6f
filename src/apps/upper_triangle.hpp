// Upper triangle of a covariance, as messages and files have it.
#pragma once

#include <array>
#include <cstddef>

#include "unimapper/merge/localisation.hpp"

namespace unimapper::apps {

/// Row by row, from the diagonal on.
[[nodiscard]] inline std::array<double, 21> upper_triangle(const merge::Matrix6d& matrix) {
  std::array<double, 21> entries{};
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int col = row; col < 6; ++col) entries[next++] = matrix(row, col);
  }
  return entries;
}

}  // namespace unimapper::apps
