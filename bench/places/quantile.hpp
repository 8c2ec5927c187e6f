// Median, quantile and mean of samples that may be empty.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "unimapper/core/quantile.hpp"

namespace unimapper::bench {

/// Nearest-rank quantile; NaN if there are no values.
inline double quantile(std::vector<double> values, double share) {
  return values.empty() ? std::numeric_limits<double>::quiet_NaN()
                        : unimapper::quantile(std::span(values), share);
}

/// The median; NaN if there are no values.
inline double median(std::vector<double> values) {
  return values.empty() ? std::numeric_limits<double>::quiet_NaN()
                        : unimapper::median(std::span(values));
}

/// Mean without NaN values; NaN if there is no other.
inline double mean(const std::vector<double>& values) {
  double sum = 0.0;
  double count = 0.0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace unimapper::bench
