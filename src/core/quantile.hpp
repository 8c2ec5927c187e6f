// Order statistics: median and nearest-rank quantile.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace unimapper {

/// The value of rank `rank` (0: the smallest) of `values`, which it reorders; linear on average.
/// `values` must hold more than `rank` values.
template <typename T>
[[nodiscard]] T order_statistic(std::span<T> values, std::size_t rank) noexcept {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The median of `values`, which must not be empty and are reordered; of an even number the larger
/// of the two in the middle.
template <typename T>
[[nodiscard]] T median(std::span<T> values) noexcept {
  return order_statistic(values, values.size() / 2);
}

/// Nearest-rank quantile: the smallest of `values` that at least a share of them, [0, 1], does not
/// exceed. `values` must not be empty and are reordered.
template <typename T>
[[nodiscard]] T quantile(std::span<T> values, double share) noexcept {
  const auto size = static_cast<double>(values.size());
  const double rank = std::clamp(std::ceil(share * size), 1.0, size);
  return order_statistic(values, static_cast<std::size_t>(rank) - 1);
}

}  // namespace unimapper
