// Maximum a posteriori scale of drift, common and by session.
#include "drift_scale.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "src/merge/loops/loop_cycle.hpp"

namespace unimapper::merge {
namespace {

/// Standard deviation of the logarithm of a scale before any loop is known.
constexpr double kPriorSigma = 0.35;
constexpr double kLargest = 5.0;
/// A smaller scale is none: sets of loops that agree are no sample without a choice.
constexpr double kSmallest = 1.25;
/// Fewer sessions cannot tell drift from maps that contradict each other.
constexpr std::size_t kFewestSessions = 6;
constexpr int kSteps = 24;
constexpr int kRounds = 3;

struct DriftCycle {
  LoopCycle cycle;
  std::size_t query = 0;
  std::size_t match = 0;
};

/// Cycles through loops of the same two sessions that follow each other along the query.
std::vector<DriftCycle> cycles_of(std::span<const LoopConstraint> loops,
                                  std::span<const SessionPath> odometry) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<const LoopConstraint*>> pairs;
  for (const LoopConstraint& loop : loops) {
    pairs[{loop.match.session, loop.query.session}].push_back(&loop);
  }
  std::vector<DriftCycle> cycles;
  for (auto& [sessions, of_pair] : pairs) {
    std::stable_sort(of_pair.begin(), of_pair.end(), [](const auto* a, const auto* b) {
      return a->query.keyframe < b->query.keyframe;
    });
    for (std::size_t i = 1; i < of_pair.size(); ++i) {
      const LoopConstraint& a = *of_pair[i - 1];
      const LoopConstraint& b = *of_pair[i];
      const auto [match, query] = sessions;
      cycles.push_back({loop_cycle(a, loop_covariance(a), b, loop_covariance(b), odometry[query],
                                   odometry[match]),
                        query, match});
    }
  }
  return cycles;
}

/// Minus twice the logarithm of the likelihood, but for a constant.
double misfit(const LoopCycle& cycle, double query_scale, double match_scale) {
  const Eigen::LLT<Matrix6d> factor(cycle.covariance(query_scale, match_scale));
  if (factor.info() != Eigen::Success) return 0.0;
  const Eigen::Matrix<double, 6, 1> whitened = factor.matrixL().solve(cycle.error);
  return whitened.squaredNorm() + 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

/// The logarithm of the scale with the least misfit and prior about `expected`.
template <typename Misfit>
double most_likely(double expected, const Misfit& misfit_of_scale) {
  double least = std::numeric_limits<double>::infinity();
  double best = 0.0;
  for (int step = 0; step <= kSteps; ++step) {
    const double log_scale = std::log(kLargest) * step / kSteps;
    const double off = (log_scale - expected) / kPriorSigma;
    const double sum = off * off + misfit_of_scale(std::exp(log_scale));
    if (sum < least) {
      least = sum;
      best = log_scale;
    }
  }
  return best;
}

}  // namespace

std::vector<double> drift_scales(std::span<const LoopConstraint> loops,
                                 std::span<const SessionPath> odometry) {
  if (odometry.size() < kFewestSessions) return std::vector<double>(odometry.size(), 1.0);
  const std::vector<DriftCycle> cycles = cycles_of(loops, odometry);
  std::vector<std::vector<const DriftCycle*>> of_session(odometry.size());
  for (const DriftCycle& cycle : cycles) {
    of_session[cycle.query].push_back(&cycle);
    of_session[cycle.match].push_back(&cycle);
  }
  const double common = most_likely(0.0, [&](double scale) {
    double sum = 0.0;
    for (const DriftCycle& c : cycles) sum += misfit(c.cycle, scale, scale);
    return sum;
  });
  std::vector<double> scales(odometry.size(), std::exp(common));
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> before = scales;
    for (std::size_t s = 0; s < scales.size(); ++s) {
      scales[s] = std::exp(most_likely(common, [&](double scale) {
        double sum = 0.0;
        for (const DriftCycle* c : of_session[s]) {
          sum += misfit(c->cycle, c->query == s ? scale : before[c->query],
                        c->match == s ? scale : before[c->match]);
        }
        return sum;
      }));
    }
  }
  for (double& scale : scales) {
    if (scale < kSmallest) scale = 1.0;
  }
  return scales;
}

}  // namespace unimapper::merge
