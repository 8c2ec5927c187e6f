// Consistency graph of loops and its maximum clique (after PCM: Mangelson et al., 2018).
#include "loop_acceptance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "max_clique.hpp"
#include "unimapper/core/cholesky.hpp"
#include "unimapper/core/rigid_fit.hpp"

namespace unimapper::merge {
namespace {

RelativeVariance loop_variance(const LoopConstraint& loop) {
  const Matrix6d covariance = Cholesky<6>(loop.information).inverse();
  // The largest axis: a loop along a corridor must not look better than it is.
  return {covariance.topLeftCorner<3, 3>().diagonal().maxCoeff(),
          covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff()};
}

double chi2(const Pose& error, double translation_variance, double rotation_variance) {
  const double angle = rotation_angle(error.rotation);
  return error.translation.squaredNorm() / translation_variance + angle * angle / rotation_variance;
}

/// How many of the chosen loops lie apart along both paths from all counted before.
std::size_t count_distinct(std::span<const LoopConstraint> loops,
                           std::span<const std::size_t> chosen, const SessionPath& query,
                           const SessionPath& match, double spacing_m) {
  std::vector<std::size_t> counted;
  for (const std::size_t i : chosen) {
    const auto near = [&](std::size_t j) {
      const double q =
          query.path_m(loops[i].query.keyframe) - query.path_m(loops[j].query.keyframe);
      const double m =
          match.path_m(loops[i].match.keyframe) - match.path_m(loops[j].match.keyframe);
      return std::abs(q) < spacing_m || std::abs(m) < spacing_m;
    };
    if (std::none_of(counted.begin(), counted.end(), near)) counted.push_back(i);
  }
  return counted.size();
}

double span_m(std::span<const LoopConstraint> loops, std::span<const std::size_t> chosen,
              const SessionPath& query, const SessionPath& match) {
  double q_low = 1e300, q_high = -1e300, m_low = 1e300, m_high = -1e300;
  for (const std::size_t i : chosen) {
    const double q = query.path_m(loops[i].query.keyframe);
    const double m = match.path_m(loops[i].match.keyframe);
    q_low = std::min(q_low, q);
    q_high = std::max(q_high, q);
    m_low = std::min(m_low, m);
    m_high = std::max(m_high, m);
  }
  return std::min(q_high - q_low, m_high - m_low);
}

AdjacencyMatrix consistency_graph(std::span<const LoopConstraint> loops, const SessionPath& query,
                                  const SessionPath& match, double threshold) {
  AdjacencyMatrix graph(loops.size());
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t j = i + 1; j < loops.size(); ++j) {
      if (cycle_chi2(loops[i], loops[j], query, match) <= threshold) graph.connect(i, j);
    }
  }
  return graph;
}

/// Loops that are inconsistent with more than half of the inliers. The others belong to the same
/// hypothesis although they are not consistent with every one of them.
std::vector<std::size_t> competing_loops(const AdjacencyMatrix& graph,
                                         std::span<const std::size_t> inliers) {
  std::vector<std::size_t> competing;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    if (std::binary_search(inliers.begin(), inliers.end(), i)) continue;
    const auto consistent = std::count_if(inliers.begin(), inliers.end(),
                                          [&](std::size_t w) { return graph.connected(i, w); });
    if (2 * static_cast<std::size_t>(consistent) < inliers.size()) competing.push_back(i);
  }
  return competing;
}

std::string reason_to_refuse_set(std::span<const LoopConstraint> loops, const ConsistencySet& set,
                                 const SessionPath& query, const SessionPath& match,
                                 const AcceptanceConfig& config) {
  if (static_cast<double>(set.distinct) < config.margin * static_cast<double>(set.competing)) {
    return "ambiguous: " + std::to_string(set.competing) + " loops contradict " +
           std::to_string(set.distinct);
  }
  const bool strong = set.distinct >= config.min_strong_loops &&
                      std::all_of(set.inliers.begin(), set.inliers.end(), [&](std::size_t i) {
                        return loops[i].overlap >= config.strong_overlap;
                      });
  if (set.distinct < config.min_loops && !strong) {
    return "too few consistent loops: " + std::to_string(set.distinct) + " of " +
           std::to_string(loops.size());
  }
  const double needed = strong ? 0.5 * config.min_span_m : config.min_span_m;
  if (span_m(loops, set.inliers, query, match) < needed) return "loops span too short a path";
  return {};
}

}  // namespace

AcceptanceConfig scaled_to_extent(AcceptanceConfig config, double extent_m) {
  if (extent_m <= 0.0 || config.full_extent_m <= 0.0) return config;
  const double scale = std::clamp(extent_m / config.full_extent_m, config.smallest_scale, 1.0);
  config.min_span_m *= scale;
  config.distinct_m *= scale;
  return config;
}

double cycle_chi2(const LoopConstraint& a, const LoopConstraint& b, const SessionPath& query,
                  const SessionPath& match) {
  const Pose query_step = query[a.query.keyframe].inverse() * query[b.query.keyframe];
  const Pose match_step = match[a.match.keyframe].inverse() * match[b.match.keyframe];
  // Both sides are the pose of b's match keyframe's query in a's match keyframe.
  const Pose error = (match_step * b.T_match_query).inverse() * (a.T_match_query * query_step);
  const RelativeVariance va = loop_variance(a);
  const RelativeVariance vb = loop_variance(b);
  const RelativeVariance vq = query.variance(a.query.keyframe, b.query.keyframe);
  const RelativeVariance vm = match.variance(a.match.keyframe, b.match.keyframe);
  const double lever = query_step.translation.squaredNorm();
  return chi2(
      error,
      va.translation + vb.translation + vq.translation + vm.translation + va.rotation * lever,
      va.rotation + vb.rotation + vq.rotation + vm.rotation);
}

Pose fit_session_transform(std::span<const LoopConstraint> loops,
                           std::span<const std::size_t> chosen, const SessionPath& query,
                           const SessionPath& match) {
  // Each loop contributes its keyframe's origin and the ends of its axes, long enough that a
  // single loop determines all six degrees of freedom without outweighing the others' positions.
  constexpr double kAxisLength = 10.0;
  std::vector<PointPair> pairs;
  for (const std::size_t i : chosen) {
    const Pose& in_query = query[loops[i].query.keyframe];
    const Pose in_match = match[loops[i].match.keyframe] * loops[i].T_match_query;
    for (int corner = -1; corner < 3; ++corner) {
      Eigen::Vector3d tip = Eigen::Vector3d::Zero();
      if (corner >= 0) tip[corner] = kAxisLength;
      pairs.push_back({in_query * tip, in_match * tip});
    }
  }
  Pose T_match_query;
  return fit_rigid(pairs, T_match_query) ? T_match_query : Pose{};
}

ConsistencySet inter_session_consistency(std::span<const LoopConstraint> loops,
                                         const SessionPath& query, const SessionPath& match,
                                         const AcceptanceConfig& config) {
  ConsistencySet set;
  if (loops.empty()) {
    set.decision.reason = "no loops found";
    return set;
  }
  const AdjacencyMatrix graph = consistency_graph(loops, query, match, config.consistency_chi2);
  std::vector<std::size_t> all(loops.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  set.inliers = max_clique(graph, all);
  set.distinct = count_distinct(loops, set.inliers, query, match, config.distinct_m);
  const auto competing = max_clique(graph, competing_loops(graph, set.inliers));
  set.competing = count_distinct(loops, competing, query, match, config.distinct_m);
  // One outlier is no hypothesis: it takes two or more that agree to compete.
  if (set.competing < 2) set.competing = 0;
  set.T_match_session_query_session = fit_session_transform(loops, set.inliers, query, match);
  set.decision.reason = reason_to_refuse_set(loops, set, query, match, config);
  set.decision.accepted = set.decision.reason.empty();
  return set;
}

ConsistencySet intra_session_consistency(std::span<const LoopConstraint> loops,
                                         const SessionPath& path, const AcceptanceConfig& config) {
  ConsistencySet set;
  std::vector<std::size_t> plausible;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto& loop = loops[i];
    const Pose odometry = path[loop.match.keyframe].inverse() * path[loop.query.keyframe];
    const RelativeVariance drift = path.variance(loop.match.keyframe, loop.query.keyframe);
    const RelativeVariance own = loop_variance(loop);
    if (chi2(odometry.inverse() * loop.T_match_query, drift.translation + own.translation,
             drift.rotation + own.rotation) <= config.consistency_chi2) {
      plausible.push_back(i);
    }
  }
  const AdjacencyMatrix graph = consistency_graph(loops, path, path, config.consistency_chi2);
  set.inliers = max_clique(graph, plausible);
  set.distinct = count_distinct(loops, set.inliers, path, path, config.distinct_m);
  set.decision.accepted = !set.inliers.empty();
  if (!set.decision.accepted) set.decision.reason = "no loop agrees with odometry";
  return set;
}

}  // namespace unimapper::merge
