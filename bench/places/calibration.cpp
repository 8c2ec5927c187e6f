#include "bench/places/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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
  std::vector<TopCandidate> answers;
  std::size_t positives = 0;
  for (const PairRow* row : rows) {
    for (const TopCandidate& top : row->top) {
      positives += top.*positive ? 1 : 0;
      if (top.answered) answers.push_back(top);
    }
  }
  std::vector<evaluate::CurvePoint> curve;
  if (positives == 0) return curve;
  std::stable_sort(
      answers.begin(), answers.end(),
      [](const TopCandidate& a, const TopCandidate& b) { return a.confidence > b.confidence; });
  std::size_t right = 0;
  std::size_t found = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    right += answers[i].right ? 1 : 0;
    found += answers[i].right && answers[i].*positive ? 1 : 0;
    // No threshold can tell equal confidences apart.
    if (i + 1 < answers.size() && answers[i + 1].confidence == answers[i].confidence) continue;
    curve.push_back({answers[i].confidence, share(right, i + 1), share(found, positives)});
  }
  return curve;
}

}  // namespace unimapper::bench
