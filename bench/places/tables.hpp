// Markdown tables of retrieval metrics.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "bench/places/calibration.hpp"
#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// One line per row.
void print_rows(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows,
                const RowConfig& config);

/// One line per route and group: means of the figures, sums of the counts.
void print_summary(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows,
                   const RowConfig& config);

/// A variant's rows.
struct VariantRows {
  std::string name;
  std::vector<PairRow> rows;
};

/// One line per variant: maximum F1 by pose and by view of every group, both routes together.
void print_ablations(std::ostream& out, const std::string& title,
                     const std::vector<VariantRows>& variants);

/// Mean cost of STD's searches and mean number of triangles. No model is fitted: rows also differ
/// in the number of the queries' triangles.
void print_std_cost(std::ostream& out, const std::vector<PairRow>& rows);

/// Share of right candidates by confidence.
void print_calibration(std::ostream& out, const std::string& title,
                       const std::vector<CalibrationBin>& bins);

}  // namespace unimapper::bench
