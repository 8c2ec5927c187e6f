// CSV files of a place recognition benchmark.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/places/tables.hpp"
#include "bench/places/worst_plot.hpp"

namespace unimapper::bench {

struct Results {
  std::vector<VariantRows> variants;  ///< the default first
  std::vector<PairRow> baseline;      ///< STD's rows; may be fewer
  std::vector<FailurePicture> worst;  ///< of the default
};

/// Writes into `folder`:
///   rows.csv          every row of every variant and of STD
///   answers.csv       the top candidate of every query, of the default and of STD
///   worst.csv         false and missed loops, worst first
///   calibration.csv   confidence against the share of right candidates
///   curve-GROUP-METHOD.csv   precision over recall, rows of a group together
///   map-N-*.csv       tracks and loops of the worst rows, and map-N.title
///   worst-N.csv       two keyframes of a false or missed loop from above, and worst-N.title
/// Throws std::runtime_error.
void write_results(const std::filesystem::path& folder, const Results& results);

}  // namespace unimapper::bench
