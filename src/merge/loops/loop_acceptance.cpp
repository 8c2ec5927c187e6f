// Consistency graph of loops and its maximum clique (after PCM: Mangelson et al., 2018).
#include "loop_acceptance.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "loop_cycle.hpp"
#include "max_clique.hpp"
#include "src/core/rigid_fit.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "src/merge/registration/weak_axis.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {
namespace {

// More placements than these that compete are not told apart.
constexpr std::size_t kMostCompeting = 3;

/// Odometry that drifted 0.03 degrees a metre over 140 m asked for 6; aisles that look alike, taken
/// for each other, for 9 to 17.
constexpr double kMostDrift = 8.0;

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

std::vector<Matrix6d> loop_covariances(std::span<const LoopConstraint> loops) {
  std::vector<Matrix6d> covariances;
  covariances.reserve(loops.size());
  for (const LoopConstraint& loop : loops) covariances.push_back(loop_covariance(loop));
  return covariances;
}

AdjacencyMatrix consistency_graph(std::span<const LoopConstraint> loops,
                                  std::span<const Matrix6d> covariances, const SessionPath& query,
                                  const SessionPath& match, double threshold) {
  AdjacencyMatrix graph(loops.size());
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t j = i + 1; j < loops.size(); ++j) {
      if (cycle_chi2(loops[i], covariances[i], loops[j], covariances[j], query, match) <=
          threshold) {
        graph.connect(i, j);
      }
    }
  }
  return graph;
}

/// Of two hypotheses that differ by less than drift over the whole way each loop of one agrees with
/// the far loops of the other. Near loops tell them apart: so a loop sides with the inliers if it
/// agrees with the one of their side to which odometry and both loops tie it most surely.
class Allegiance {
 public:
  Allegiance(std::span<const LoopConstraint> loops, std::span<const Matrix6d> covariances,
             const AdjacencyMatrix& graph, const SessionPath& query, const SessionPath& match)
      : loops_(loops), covariances_(covariances), graph_(graph), query_(query), match_(match) {}

  /// Loops that do not side with the inliers, ascending.
  [[nodiscard]] std::vector<std::size_t> competing(std::vector<std::size_t> side) const {
    std::vector<std::pair<double, std::size_t>> others;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (std::binary_search(side.begin(), side.end(), i)) continue;
      others.emplace_back(variance(i, nearest(i, side)), i);
    }
    // From near to far, so that the side grows along the path however odometry drifts.
    std::sort(others.begin(), others.end());
    std::vector<std::size_t> competing;
    for (const auto& [ignored, i] : others) {
      (graph_.connected(i, nearest(i, side)) ? side : competing).push_back(i);
    }
    std::sort(competing.begin(), competing.end());
    return competing;
  }

 private:
  [[nodiscard]] double variance(std::size_t a, std::size_t b) const {
    return drift_between(loops_[a], loops_[b], query_, match_) +
           covariances_[a].topLeftCorner<3, 3>().trace() +
           covariances_[b].topLeftCorner<3, 3>().trace();
  }

  [[nodiscard]] std::size_t nearest(std::size_t i, const std::vector<std::size_t>& side) const {
    return *std::min_element(side.begin(), side.end(), [&](std::size_t a, std::size_t b) {
      return variance(i, a) < variance(i, b);
    });
  }

  std::span<const LoopConstraint> loops_;
  std::span<const Matrix6d> covariances_;
  const AdjacencyMatrix& graph_;
  const SessionPath& query_;
  const SessionPath& match_;
};

/// Distinct loops of the set that know the position along the direction of which the set as a whole
/// knows least. In a tunnel that is the bore, along which most loops know nothing.
std::size_t votes_on_weakest_axis(std::span<const LoopConstraint> loops,
                                  std::span<const Matrix6d> covariances, const ConsistencySet& set,
                                  const SessionPath& query, const SessionPath& match,
                                  const AcceptanceConfig& config) {
  std::vector<Eigen::Matrix3d> in_session;
  Eigen::Matrix3d known = Eigen::Matrix3d::Zero();
  for (const std::size_t i : set.inliers) {
    const Eigen::Matrix3d& r = match[loops[i].match.keyframe].rotation;
    in_session.push_back(r * covariances[i].topLeftCorner<3, 3>() * r.transpose());
    known += in_session.back().inverse();
  }
  const Eigen::Vector3d axis = symmetric_eigen<double>(known).vectors.col(0);
  std::vector<std::size_t> votes;
  for (std::size_t k = 0; k < set.inliers.size(); ++k) {
    const double variance = axis.dot(in_session[k] * axis);
    if (variance <= config.vote_sigma_m * config.vote_sigma_m) votes.push_back(set.inliers[k]);
  }
  return count_distinct(loops, votes, query, match, config.distinct_m);
}

constexpr const char* kShortPath = "loops span too short a path";

/// Why a set connects no maps by itself; empty if it may.
std::string reason_to_refuse_set(std::span<const LoopConstraint> loops, const ConsistencySet& set,
                                 const SessionPath& query, const SessionPath& match,
                                 const AcceptanceConfig& config) {
  const bool strong = set.distinct >= config.min_strong_loops &&
                      std::all_of(set.inliers.begin(), set.inliers.end(), [&](std::size_t i) {
                        return loops[i].overlap >= AcceptanceConfig::kStrongOverlap;
                      });
  if (set.distinct < config.min_loops && !strong) {
    return "too few consistent loops: " + std::to_string(set.distinct) + " of " +
           std::to_string(loops.size());
  }
  const double needed = strong ? 0.5 * config.min_span_m : config.min_span_m;
  if (span_m(loops, set.inliers, query, match) < needed) return kShortPath;
  return {};
}

/// The sets that contradict the inliers and each other, the largest first. Provisional: it is so
/// large that the pair is ambiguous; a set counts more if it could connect the maps itself. Ends
/// with the first that is not, or with one more than `kMostCompeting`.
std::vector<ConsistencySet> find_competing_sets(std::span<const LoopConstraint> loops,
                                                std::span<const Matrix6d> covariances,
                                                const ConsistencySet& set,
                                                const AdjacencyMatrix& graph,
                                                const SessionPath& query, const SessionPath& match,
                                                const AcceptanceConfig& config) {
  const Allegiance allegiance(loops, covariances, graph, query, match);
  std::vector<ConsistencySet> competing;
  std::vector<std::size_t> explained = set.inliers;
  while (competing.size() <= kMostCompeting) {
    ConsistencySet other;
    other.inliers = max_clique(graph, allegiance.competing(explained));
    other.distinct = count_distinct(loops, other.inliers, query, match, config.distinct_m);
    // One outlier is no hypothesis: it takes two or more that agree to compete.
    if (other.distinct < 2) break;
    const bool sufficient = reason_to_refuse_set(loops, other, query, match, config).empty();
    const double margin = sufficient ? config.sufficient_margin : config.margin;
    other.state = static_cast<double>(set.distinct) >= margin * static_cast<double>(other.distinct)
                      ? PairState::kRefused
                      : PairState::kProvisional;
    other.T_match_session_query_session = fit_session_transform(loops, other.inliers, query, match);
    explained.insert(explained.end(), other.inliers.begin(), other.inliers.end());
    std::sort(explained.begin(), explained.end());
    competing.push_back(std::move(other));
    if (competing.back().state == PairState::kRefused) break;
  }
  return competing;
}

/// All loops of the set lie where keyframes see the same structure.
bool lies_in_one_place(std::span<const LoopConstraint> loops, const ConsistencySet& set,
                       const SessionPath& query, const SessionPath& match,
                       const AcceptanceConfig& config) {
  return span_m(loops, set.inliers, query, match) < config.place_span_m;
}

/// Chi square of the cycle of a loop and the way from its match to its query, by odometry.
double odometry_chi2(const LoopConstraint& loop, const Matrix6d& covariance,
                     const SessionPath& path) {
  LoopConstraint by_odometry = loop;
  by_odometry.T_match_query = path[loop.match.keyframe].inverse() * path[loop.query.keyframe];
  return cycle_chi2(loop, bounded_by_start(covariance), by_odometry,
                    odometry_covariance(path, loop.match.keyframe, loop.query.keyframe), path,
                    path);
}

}  // namespace

AcceptanceConfig scaled_to_extent(AcceptanceConfig config, double extent_m) {
  if (extent_m <= 0.0) return config;
  const double scale =
      std::clamp(extent_m / AcceptanceConfig::kFullExtentM, AcceptanceConfig::kSmallestScale, 1.0);
  config.min_span_m *= scale;
  config.distinct_m *= scale;
  config.place_span_m *= scale;
  return config;
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
    set.reason = "no loops found";
    return set;
  }
  const std::vector<Matrix6d> covariances = loop_covariances(loops);
  const AdjacencyMatrix graph =
      consistency_graph(loops, covariances, query, match, config.consistency_chi2);
  std::vector<std::size_t> all(loops.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  set.inliers = max_clique(graph, all);
  set.distinct = count_distinct(loops, set.inliers, query, match, config.distinct_m);
  set.is_one_place = lies_in_one_place(loops, set, query, match, config);
  set.T_match_session_query_session = fit_session_transform(loops, set.inliers, query, match);
  set.reason = reason_to_refuse_set(loops, set, query, match, config);
  const bool is_short = set.reason == kShortPath;
  if (!set.reason.empty() && !is_short) return set;
  std::vector<ConsistencySet> competing =
      find_competing_sets(loops, covariances, set, graph, query, match, config);
  if (!competing.empty()) set.competing = competing.front().distinct;
  std::erase_if(competing,
                [](const ConsistencySet& other) { return other.state != PairState::kProvisional; });
  const std::size_t votes = votes_on_weakest_axis(loops, covariances, set, query, match, config);
  const bool is_weak = votes < config.min_strong_loops;
  if (is_short) {
    set.is_short = competing.empty() && !is_weak;
    return set;
  }
  set.state = PairState::kProvisional;
  if (!competing.empty()) {
    set.reason = "ambiguous: " + std::to_string(set.competing) + " loops contradict " +
                 std::to_string(set.distinct);
    if (competing.size() <= kMostCompeting && !is_weak) set.competing_sets = std::move(competing);
    return set;
  }
  set.is_weak_along_axis = is_weak;
  if (is_weak) {
    set.reason = "the position along one direction is known to " + std::to_string(votes) + " of " +
                 std::to_string(set.distinct) + " loops";
    return set;
  }
  set.state = PairState::kConfirmed;
  return set;
}

std::string reason_to_wait(const ConsistencySet& set, const PlacementEvidence& evidence,
                           const AcceptanceConfig& config) {
  if (!evidence.aliasing.empty()) return evidence.aliasing;
  if (evidence.competing_excluded < set.competing_sets.size())
    return "nothing excludes the other placement";
  // A placement is rigid: where odometry drifts, keyframes far from its loops lie aside. In right
  // pairs up to 1.7 times as many differ as agree (docs/design/loop-acceptance.md).
  if (evidence.contradicting > 2 * evidence.supporting) {
    return "keyframes beside each other see different structure: " +
           std::to_string(evidence.contradicting) + " of " +
           std::to_string(evidence.contradicting + evidence.supporting);
  }
  // Other loops cannot tell: surroundings that agree must.
  if (set.is_short && (evidence.supporting < config.min_loops ||
                       evidence.supporting < 2 * evidence.contradicting)) {
    return "too few keyframes confirm them: " + std::to_string(evidence.supporting) + " of " +
           std::to_string(evidence.contradicting + evidence.supporting);
  }
  if (set.is_one_place && evidence.supporting < config.min_loops) {
    return "all loops lie in one place, and nothing confirms them elsewhere";
  }
  return {};
}

bool is_confirmed(std::span<const LoopConstraint> loops, std::span<const std::size_t> set,
                  std::size_t i, const SessionPath& path, const AcceptanceConfig& config) {
  const double spacing = 0.5 * config.min_span_m;
  const double limit = AcceptanceConfig::kConfirmingSigmaM * AcceptanceConfig::kConfirmingSigmaM;
  return std::any_of(set.begin(), set.end(), [&](std::size_t j) {
    const auto apart = [&](std::size_t a, std::size_t b) {
      return std::abs(path.path_m(a) - path.path_m(b)) >= spacing;
    };
    return apart(loops[i].query.keyframe, loops[j].query.keyframe) &&
           apart(loops[i].match.keyframe, loops[j].match.keyframe) &&
           drift_between(loops[i], loops[j], path, path) <= limit;
  });
}

double drift_by_refused(std::span<const LoopConstraint> refused, std::size_t accepted,
                        const SessionPath& path, const AcceptanceConfig& config) {
  if (refused.size() <= accepted) return 1.0;
  const std::vector<Matrix6d> covariances = loop_covariances(refused);
  std::vector<std::size_t> all(refused.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<std::size_t> set =
      max_clique(consistency_graph(refused, covariances, path, path, config.consistency_chi2), all);
  if (set.size() <= accepted) return 1.0;
  if (count_distinct(refused, set, path, path, config.distinct_m) < config.min_loops) return 1.0;
  double sum = 0.0;
  for (const std::size_t i : set) sum += odometry_chi2(refused[i], covariances[i], path);
  const double scale = std::sqrt(sum / (6.0 * static_cast<double>(set.size())));
  return scale <= kMostDrift ? std::max(1.0, scale) : 1.0;
}

IntraSessionLoops intra_session_consistency(std::span<const LoopConstraint> loops,
                                            const SessionPath& path,
                                            const AcceptanceConfig& config) {
  const std::vector<Matrix6d> covariances = loop_covariances(loops);
  std::vector<std::size_t> plausible;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (odometry_chi2(loops[i], covariances[i], path) <= config.consistency_chi2) {
      plausible.push_back(i);
    }
  }
  const AdjacencyMatrix graph =
      consistency_graph(loops, covariances, path, path, config.consistency_chi2);
  const std::vector<std::size_t> clique = max_clique(graph, plausible);
  IntraSessionLoops found;
  for (const std::size_t i : clique) {
    (is_confirmed(loops, clique, i, path, config) ? found.accepted : found.waiting).push_back(i);
  }
  return found;
}

}  // namespace unimapper::merge
