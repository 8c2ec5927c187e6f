// Calibration and precision-recall of the top candidates of several rows.
#pragma once

#include <cstddef>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// Top candidates in one range of confidence.
struct CalibrationBin {
  double from = 0.0;
  double to = 0.0;
  std::size_t answers = 0;
  std::size_t right = 0;
  std::size_t answers_above = 0;  ///< in this and all higher bins
  std::size_t right_above = 0;

  /// NaN if there are none.
  [[nodiscard]] double right_share() const;
  /// Precision of a threshold at `from`; NaN if there are none.
  [[nodiscard]] double right_share_above() const;
};

/// Ten bins of equal width; the last one includes 1.
[[nodiscard]] std::vector<CalibrationBin> calibrate(const std::vector<PairRow>& rows);

/// Precision and recall of the top candidates of all rows under one threshold, by falling
/// confidence. A candidate is right if its pose is; `positive` selects the positive queries.
[[nodiscard]] std::vector<evaluate::CurvePoint> pooled_curve(
    const std::vector<const PairRow*>& rows, bool TopCandidate::*positive);

}  // namespace unimapper::bench
