#include "range_limit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace unimapper::onboard {
namespace {

constexpr std::uint32_t kRings = 64;

bool is_candidate(const CellTable& cells, std::uint32_t row) noexcept {
  return cells.has(row, &CellMarks::candidate);
}

}  // namespace

RangeLimit keep_nearest(CellTable& cells, const Eigen::Vector3f& center, float range_max_m,
                        std::uint32_t limit) noexcept {
  const float rings_per_m = static_cast<float>(kRings) / range_max_m;
  const auto ring_of = [&](std::uint32_t row) {
    const float ring = (cells.position(row) - center).norm() * rings_per_m;
    return static_cast<std::uint32_t>(std::min(ring, static_cast<float>(kRings - 1)));
  };
  std::array<std::uint32_t, kRings> in_ring{};
  std::uint32_t candidates = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if (!is_candidate(cells, row)) continue;
    ++in_ring[ring_of(row)];
    ++candidates;
  }
  if (candidates <= limit) return {candidates, 0, 0.0F};

  RangeLimit result;
  std::uint32_t ring = 0;
  for (; result.kept + in_ring[ring] <= limit; ++ring) result.kept += in_ring[ring];
  result.shed = candidates - result.kept;
  result.range_m = std::max(static_cast<float>(ring), 1e-3F) / rings_per_m;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if (!is_candidate(cells, row) || ring_of(row) < ring) continue;
    cells.clear(row, &CellMarks::candidate);
    cells.clear(row, &CellMarks::low);
  }
  return result;
}

}  // namespace unimapper::onboard
