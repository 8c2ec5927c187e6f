// Disjoint sets: union-find with path halving.
#pragma once

#include <algorithm>

namespace unimapper {

/// The root of `element`'s set. `parent(i)` gives a reference to the parent of element i, wherever
/// the caller stores it; a root is its own parent. Halves the path on the way, so that a sequence
/// of calls is almost linear.
template <typename Index, typename Parent>
[[nodiscard]] Index find_root(Index element, const Parent& parent) noexcept {
  while (parent(element) != element) {
    parent(element) = parent(parent(element));
    element = parent(element);
  }
  return element;
}

/// Joins the sets of `a` and `b`. The smaller root becomes the root of both, so the result does not
/// depend on the order of joins. False if they were one set already.
template <typename Index, typename Parent>
bool join_sets(Index a, Index b, const Parent& parent) noexcept {
  a = find_root(a, parent);
  b = find_root(b, parent);
  parent(std::max(a, b)) = std::min(a, b);
  return a != b;
}

}  // namespace unimapper
