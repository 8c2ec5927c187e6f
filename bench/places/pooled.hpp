// Figures over the best answers of many rows together.
#pragma once

#include <cstddef>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// Answers of one range of confidence.
struct CalibrationBin {
  double from = 0.0;
  double to = 0.0;
  std::size_t answers = 0;
  std::size_t right = 0;
  std::size_t answers_above = 0;  ///< these and all of higher confidence
  std::size_t right_above = 0;

  /// NaN if there are none.
  [[nodiscard]] double right_share() const;
  /// What precision a threshold at `from` gives; NaN if there are none.
  [[nodiscard]] double right_share_above() const;
};

/// Ten bins of equal width; the last one includes 1.
[[nodiscard]] std::vector<CalibrationBin> calibrate(const std::vector<PairRow>& rows);

/// Precision and recall of the best answers of all rows under one threshold. Right is who reports
/// the right pose; `positive` says which queries there were to answer. Falling confidence.
[[nodiscard]] std::vector<evaluate::CurvePoint> pooled_curve(
    const std::vector<const PairRow*>& rows, bool TopAnswer::*positive);

}  // namespace unimapper::bench
