// Synthetic places composed of halves of real ones.
#pragma once

#include <cstddef>

#include "bench/places/description.hpp"

namespace unimapper::bench {

/// Capacity of a synthetic place.
struct PlaceCapacity {
  std::size_t keypoints = 128;
  std::size_t planes = 1024;
};

/// Half of `a` and half of `b`, each rotated about the vertical by its yaw (radians) first: from
/// `a` the part left of the x axis, from `b` the part right of it. Triangles have realistic shapes,
/// but the place does not exist. Strongest keypoints first, as in every place.
[[nodiscard]] OwnedPlace mix_halves(const OwnedPlace& a, double yaw_a, const OwnedPlace& b,
                                    double yaw_b, const PlaceCapacity& capacity = {});

}  // namespace unimapper::bench
