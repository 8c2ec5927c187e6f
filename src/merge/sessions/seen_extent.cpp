#include "seen_extent.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "src/core/quantile.hpp"

namespace unimapper::merge {
namespace {

constexpr double kShare = 0.95;
constexpr std::size_t kMostKeyframes = 64;

}  // namespace

double seen_extent_m(const SessionData& session) {
  const std::size_t keyframes = session.keyframes.size();
  const std::size_t step = keyframes / kMostKeyframes + 1;
  std::vector<float> of_keyframes;
  std::vector<float> distances;
  for (std::size_t k = 0; k < keyframes; k += step) {
    distances.clear();
    const auto keyframe = whole_keyframe(session, k);
    for (const FineCell& cell : keyframe->static_cells) {
      distances.push_back(cell.position.norm());
    }
    if (!distances.empty()) of_keyframes.push_back(quantile(std::span(distances), kShare));
  }
  return of_keyframes.empty() ? 0.0 : static_cast<double>(median(std::span(of_keyframes)));
}

}  // namespace unimapper::merge
