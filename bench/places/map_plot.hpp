// Plot data of loops on the map.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// The worst row of every group and route (by F1 by view) as map-N.title, map-N-database.csv and
/// map-N-queries.csv (x, y) and map-N-loops.csv (x, y at the query, x, y at the match, right,
/// accepted, at full precision), N counting from 0.
void write_map_plots(const std::filesystem::path& folder, const std::vector<PairRow>& rows);

}  // namespace unimapper::bench
