// New places from known ones.
#pragma once

#include <cstddef>

#include "bench/places/described.hpp"

namespace unimapper::bench {

/// What a mixed place may hold.
struct PlaceRoom {
  std::size_t keypoints = 128;
  std::size_t planes = 1024;
};

/// Half of `a` and half of `b`, each turned about the vertical by its yaw (radians) first: what of
/// `a` then lies left of the x axis, what of `b` right of it. Triangles stay as real ones are, but
/// the place is nowhere. Strongest keypoints first, as in every place.
[[nodiscard]] OwnedPlace mix_halves(const OwnedPlace& a, double yaw_a, const OwnedPlace& b,
                                    double yaw_b, const PlaceRoom& room = {});

}  // namespace unimapper::bench
