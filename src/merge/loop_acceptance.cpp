#include "unimapper/merge/loop_acceptance.hpp"

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

/// How many of the chosen loops lie at distinct places: apart along both paths from all counted.
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

AdjacencyMatrix consistency(std::span<const LoopConstraint> loops, const SessionPath& query,
                            const SessionPath& match, double threshold) {
  AdjacencyMatrix graph(loops.size());
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t j = i + 1; j < loops.size(); ++j) {
      if (cycle_chi2(loops[i], loops[j], query, match) <= threshold) graph.connect(i, j);
    }
  }
  return graph;
}

/// Loops that side with the winners although not with every one of them are no rival story.
std::vector<std::size_t> rivals_of(const AdjacencyMatrix& graph,
                                   std::span<const std::size_t> winners) {
  std::vector<std::size_t> rivals;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    if (std::binary_search(winners.begin(), winners.end(), i)) continue;
    const auto friends = std::count_if(winners.begin(), winners.end(),
                                       [&](std::size_t w) { return graph.connected(i, w); });
    if (2 * static_cast<std::size_t>(friends) < winners.size()) rivals.push_back(i);
  }
  return rivals;
}

std::string refusal(std::span<const LoopConstraint> loops, const LoopVote& vote,
                    const SessionPath& query, const SessionPath& match,
                    const AcceptanceConfig& config) {
  if (static_cast<double>(vote.distinct) < config.margin * static_cast<double>(vote.second)) {
    return "ambiguous: " + std::to_string(vote.second) + " loops contradict " +
           std::to_string(vote.distinct);
  }
  const bool strong = vote.distinct >= config.min_strong_loops &&
                      std::all_of(vote.inliers.begin(), vote.inliers.end(), [&](std::size_t i) {
                        return loops[i].overlap >= config.strong_overlap;
                      });
  if (vote.distinct < config.min_loops && !strong) {
    return "too few consistent loops: " + std::to_string(vote.distinct) + " of " +
           std::to_string(loops.size());
  }
  const double needed = strong ? 0.5 * config.min_span_m : config.min_span_m;
  if (span_m(loops, vote.inliers, query, match) < needed) return "loops span too short a path";
  return {};
}

}  // namespace

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
  // Each loop contributes its keyframe's origin and the tips of its axes, long enough that a
  // single loop fixes all six degrees of freedom without outweighing the others' positions.
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

LoopVote vote_pair(std::span<const LoopConstraint> loops, const SessionPath& query,
                   const SessionPath& match, const AcceptanceConfig& config) {
  LoopVote vote;
  if (loops.empty()) {
    vote.reason = "no loops found";
    return vote;
  }
  const AdjacencyMatrix graph = consistency(loops, query, match, config.consistency_chi2);
  std::vector<std::size_t> all(loops.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  vote.inliers = max_clique(graph, all);
  vote.distinct = count_distinct(loops, vote.inliers, query, match, config.distinct_m);
  const auto second = max_clique(graph, rivals_of(graph, vote.inliers));
  vote.second = count_distinct(loops, second, query, match, config.distinct_m);
  // A single loop always stands alone; only two or more that agree tell a rival story.
  if (vote.second < 2) vote.second = 0;
  vote.T_match_session_query_session = fit_session_transform(loops, vote.inliers, query, match);
  vote.reason = refusal(loops, vote, query, match, config);
  vote.accepted = vote.reason.empty();
  return vote;
}

LoopVote vote_session(std::span<const LoopConstraint> loops, const SessionPath& path,
                      const AcceptanceConfig& config) {
  LoopVote vote;
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
  const AdjacencyMatrix graph = consistency(loops, path, path, config.consistency_chi2);
  vote.inliers = max_clique(graph, plausible);
  vote.distinct = count_distinct(loops, vote.inliers, path, path, config.distinct_m);
  vote.accepted = !vote.inliers.empty();
  if (!vote.accepted) vote.reason = "no loop agrees with odometry";
  return vote;
}

}  // namespace unimapper::merge
