// Known mistakes in poses, undone: what the right poses would be
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// A mistake and the relative motion that the recording would have without it.
struct PoseMistake {
  std::string name;    ///< stable, e.g. "inverted"
  std::string remedy;  ///< "the poses look like ...; do ..."
  /// T_i_j of the scans `i` and `j`. `complete` becomes false where the mistake leaves none.
  std::function<Pose(std::size_t i, std::size_t j, bool& complete)> relative;
  /// The right pose for a given one, up to the frame of the world and its handedness. Empty where
  /// one pose alone does not tell: scales, orders, increments.
  std::function<Pose(const Pose&)> correct = nullptr;
  bool is_named = true;  ///< not one of many axes that nobody has a name for
};

/// All known mistakes, the more frequent ones first. `name(i)` is the file name of scan `i` without
/// its extension. `track` must outlive the result.
[[nodiscard]] std::vector<PoseMistake> known_mistakes(
    const Track& track, const std::function<std::string(std::size_t)>& name);

}  // namespace unimapper::input
