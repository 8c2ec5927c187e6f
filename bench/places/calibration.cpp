#include "bench/places/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace unimapper::bench {
namespace {

constexpr std::size_t kBins = 10;

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

double CalibrationBin::right_share() const { return share(right, answers); }

double CalibrationBin::right_share_above() const { return share(right_above, answers_above); }

std::vector<CalibrationBin> calibrate(const std::vector<PairRow>& rows) {
  std::vector<CalibrationBin> bins(kBins);
  for (std::size_t i = 0; i < kBins; ++i) {
    bins[i].from = static_cast<double>(i) / kBins;
    bins[i].to = static_cast<double>(i + 1) / kBins;
  }
  for (const PairRow& row : rows) {
    for (const TopCandidate& top : row.top) {
      if (!top.answered) continue;
      const double clamped = std::clamp(top.confidence, 0.0, 1.0);
      CalibrationBin& bin = bins[std::min(kBins - 1, static_cast<std::size_t>(clamped * kBins))];
      ++bin.answers;
      bin.right += top.right ? 1 : 0;
    }
  }
  for (std::size_t i = kBins; i-- > 0;) {
    const bool is_last = i + 1 == kBins;
    bins[i].answers_above = bins[i].answers + (is_last ? 0 : bins[i + 1].answers_above);
    bins[i].right_above = bins[i].right + (is_last ? 0 : bins[i + 1].right_above);
  }
  return bins;
}

std::vector<evaluate::CurvePoint> pooled_curve(const std::vector<const PairRow*>& rows,
                                               bool TopCandidate::*positive) {
  std::vector<evaluate::RankedLoop> loops;
  std::size_t positives = 0;
  for (const PairRow* row : rows) {
    for (const TopCandidate& top : row->top) {
      positives += top.*positive ? 1 : 0;
      if (top.answered) loops.push_back({top.confidence, top.right, top.*positive});
    }
  }
  return evaluate::precision_recall_curve(std::move(loops), positives);
}

}  // namespace unimapper::bench
