#include "map_regions.hpp"

#include <algorithm>
#include <map>

namespace unimapper::merge {
namespace {

using Sizes = std::map<MapTile, std::size_t>;

/// Voxels by column or by row of tiles within a box.
std::map<std::int32_t, std::size_t> along(const Sizes& sizes, const TileBox& box, bool is_x) {
  std::map<std::int32_t, std::size_t> lines;
  for (const auto& [tile, size] : sizes) {
    if (box.contains(tile)) lines[is_x ? tile.x : tile.y] += size;
  }
  return lines;
}

/// The last line of the first half, by voxels; there are two lines at least.
std::int32_t middle(const std::map<std::int32_t, std::size_t>& lines, std::size_t all) {
  std::size_t sum = 0;
  const auto last = std::prev(lines.end());
  for (auto line = lines.begin(); line != last; ++line) {
    sum += line->second;
    if (2 * sum >= all) return line->first;
  }
  return std::prev(last)->first;
}

void divide(const Sizes& sizes, const TileBox& box, std::size_t most,
            std::vector<TileBox>& regions) {
  const auto columns = along(sizes, box, true);
  const auto rows = along(sizes, box, false);
  std::size_t all = 0;
  for (const auto& [column, size] : columns) all += size;
  if (all <= most || (columns.size() < 2 && rows.size() < 2)) {
    regions.push_back(box);
    return;
  }
  const auto extent = [](const auto& lines) {
    return lines.rbegin()->first - lines.begin()->first;
  };
  TileBox first = box;
  TileBox second = box;
  if (extent(columns) >= extent(rows)) {
    first.high.x = middle(columns, all);
    second.low.x = first.high.x + 1;
  } else {
    first.high.y = middle(rows, all);
    second.low.y = first.high.y + 1;
  }
  divide(sizes, first, most, regions);
  divide(sizes, second, most, regions);
}

}  // namespace

std::vector<TileBox> map_regions(const std::vector<const SessionVoxels*>& sessions,
                                 std::size_t most) {
  Sizes sizes;
  for (const SessionVoxels* session : sessions) {
    if (session == nullptr) continue;
    for (const auto& [tile, size] : session->sizes()) sizes[tile] += size;
  }
  std::vector<TileBox> regions;
  divide(sizes, TileBox{}, most, regions);
  return regions;
}

}  // namespace unimapper::merge
