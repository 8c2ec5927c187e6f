#include "session_site.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "map_level.hpp"
#include "site_frame.hpp"
#include "src/core/quantile.hpp"
#include "src/merge/loops/loop_cycle.hpp"
#include "src/merge/loops/max_clique.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kMostCompared = 200;
constexpr int kMaxRounds = 4;
// Of a heading of which nothing is known: it lies anywhere on the circle.
constexpr double kAnyHeadingVariance = std::numbers::pi * std::numbers::pi / 3.0;

double square(double value) { return value * value; }

/// Whether distance and height between two positions are those of odometry; both do not depend on
/// where the site lies.
bool agree(const KnownPosition& a, const KnownPosition& b, const MapState& state,
           const SessionPath& path, const Eigen::Matrix3d& level) {
  const std::size_t s = a.keyframe.session;
  const auto in_session = [&](const KnownPosition& p) -> Eigen::Vector3d {
    return level * (state.T_session_keyframe[s][p.keyframe.keyframe] * p.point);
  };
  const Eigen::Vector3d between = in_session(b) - in_session(a);
  const Eigen::Vector3d known = b.position - a.position;
  const double drift = path.variance(a.keyframe.keyframe, b.keyframe.keyframe).translation;
  const double up = square(kUpSigmaRad) * between.head<2>().squaredNorm();
  double chi2 =
      square(known.z() - between.z()) / (square(a.sigma_z_m) + square(b.sigma_z_m) + drift + up);
  if (a.is_horizontal() && b.is_horizontal()) {
    chi2 += square(known.head<2>().norm() - between.head<2>().norm()) /
            (square(a.sigma_xy_m) + square(b.sigma_xy_m) + drift);
  }
  return chi2 <= kPositionChi2;
}

/// Indices of the largest set of which every two agree, if it is more than half of those compared.
struct Majority {
  std::vector<std::size_t> members;
  /// Of two that contradict each other, and of which the set would be as large with either.
  std::vector<std::size_t> disputed;
};

Majority find_majority(const MapState& state, std::size_t session,
                       const std::vector<KnownPosition>& positions) {
  std::vector<std::size_t> compared;
  const std::size_t count = std::min(kMostCompared, positions.size());
  for (std::size_t i = 0; i < count; ++i) compared.push_back(i * positions.size() / count);
  const SessionPath path = state.odometry[session].with_poses(state.T_session_keyframe[session]);
  const Eigen::Matrix3d level = rotation_to_z(state.up[session]);
  AdjacencyMatrix graph(count);
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back(i);
    for (std::size_t j = i + 1; j < count; ++j) {
      if (agree(positions[compared[i]], positions[compared[j]], state, path, level)) {
        graph.connect(i, j);
      }
    }
  }
  const std::vector<std::size_t> set = max_clique(graph, all);
  Majority majority;
  if (count > 1 && 2 * set.size() <= count) return majority;
  std::vector<bool> is_disputed(count, false);
  for (const std::size_t i : all) {
    if (std::binary_search(set.begin(), set.end(), i)) continue;
    std::vector<std::size_t> opponents;
    for (const std::size_t j : set) {
      if (!graph.connected(i, j)) opponents.push_back(j);
    }
    if (opponents.size() == 1) is_disputed[i] = is_disputed[opponents.front()] = true;
  }
  for (const std::size_t i : all) {
    if (is_disputed[i]) {
      majority.disputed.push_back(compared[i]);
    } else if (std::binary_search(set.begin(), set.end(), i)) {
      majority.members.push_back(compared[i]);
    }
  }
  return majority;
}

/// Drift from a keyframe to the nearest position in use, square metres.
double nearest_drift(const SessionPath& path, std::span<const KnownPosition> used,
                     std::size_t keyframe) {
  double least = std::numeric_limits<double>::infinity();
  for (const KnownPosition& position : used) {
    least = std::min(least, path.variance(position.keyframe.keyframe, keyframe).translation);
  }
  return least;
}

/// The session alone with its loops and positions; those that disagree with the result are removed.
bool optimise_alone(MapState& placed, std::size_t session, std::span<const LoopConstraint> loops,
                    const MergeConfig& config) {
  const std::size_t only[] = {session};
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!optimize_maps(placed, only, loops, config.graph)) return false;
    const auto is_outlier = [&](const KnownPosition& position) {
      return position_chi2(position, position_residual(placed, position)) > kPositionChi2;
    };
    if (std::erase_if(placed.positions, is_outlier) == 0) break;
    if (placed.positions.empty()) return false;
  }
  return true;
}

bool is_among(const std::vector<KnownPosition>& positions, const KnownPosition& one) {
  return std::any_of(positions.begin(), positions.end(),
                     [&](const KnownPosition& other) { return other.keyframe == one.keyframe; });
}

std::string metres_off(const Eigen::Vector3d& residual, const KnownPosition& position) {
  char text[64];
  std::snprintf(text, sizeof text, "%.1f m off the others",
                position.is_horizontal() ? residual.norm() : std::abs(residual.z()));
  return text;
}

SessionPositions all_rejected(const std::vector<KnownPosition>& positions, const char* reason) {
  SessionPositions chosen;
  for (const KnownPosition& position : positions) {
    chosen.rejected.push_back({position, false, reason, Eigen::Vector3d::Zero()});
  }
  return chosen;
}

}  // namespace

SessionSite::SessionSite(const MapState& placed, std::size_t session,
                         std::vector<KnownPosition> used)
    : path_(placed.odometry[session].with_poses(placed.T_session_keyframe[session])),
      used_(std::move(used)),
      up_variance_(square(kUpSigmaRad)) {
  const Pose T_site_session = placed.T_map_site->inverse() * placed.T_map_session[session];
  for (const Pose& pose : placed.T_session_keyframe[session]) {
    T_site_keyframe_.push_back(T_site_session * pose);
  }
  const double information = fit_site(placed, used_).heading_information;
  heading_variance_ = std::min(1.0 / information, kAnyHeadingVariance);
}

SessionSite::Variance SessionSite::variance(std::size_t keyframe) const {
  Variance least;
  for (const KnownPosition& position : used_) {
    const std::size_t other = position.keyframe.keyframe;
    const double drift = path_.variance(other, keyframe).translation;
    const double distance2 =
        (pose(keyframe).translation - pose(other) * position.point).head<2>().squaredNorm();
    least.vertical =
        std::min(least.vertical, square(position.sigma_z_m) + drift + up_variance_ * distance2);
    if (!position.is_horizontal()) continue;
    least.horizontal = std::min(
        least.horizontal, square(position.sigma_xy_m) + drift + heading_variance_ * distance2);
  }
  return least;
}

SessionPositions choose_positions(const MapState& state, std::size_t session,
                                  const std::vector<KnownPosition>& positions,
                                  std::span<const LoopConstraint> loops, const MergeConfig& config,
                                  MapState& placed) {
  const Majority majority = find_majority(state, session, positions);
  if (majority.members.empty()) {
    return all_rejected(positions, "the positions of the session contradict each other");
  }
  placed = state;
  placed.central = session;
  placed.positions.clear();
  for (const std::size_t i : majority.members) placed.positions.push_back(positions[i]);
  if (!optimise_alone(placed, session, loops, config)) return all_rejected(positions, kNoSite);
  std::vector<KnownPosition> disputed;
  for (const std::size_t i : majority.disputed) disputed.push_back(positions[i]);
  std::vector<KnownPosition> agreeing;
  for (const KnownPosition& position : positions) {
    if (is_among(disputed, position)) continue;
    const double drift =
        nearest_drift(placed.odometry[session], placed.positions, position.keyframe.keyframe);
    if (position_chi2(position, position_residual(placed, position), drift) <= kPositionChi2) {
      agreeing.push_back(position);
    }
  }
  placed.positions = std::move(agreeing);
  if (!optimise_alone(placed, session, loops, config)) return all_rejected(positions, kNoSite);
  if (!deformation_is_plausible(state, placed, session, config.graph)) {
    return all_rejected(positions,
                        "the session would deform more than odometry allows to fit its positions");
  }
  SessionPositions chosen;
  chosen.used = placed.positions;
  for (const KnownPosition& position : positions) {
    if (is_among(chosen.used, position)) continue;
    const Eigen::Vector3d residual = position_residual(placed, position);
    const std::string reason = is_among(disputed, position)
                                   ? "contradicts another one, and nothing tells which is wrong"
                                   : metres_off(residual, position);
    chosen.rejected.push_back({position, false, reason, residual});
  }
  return chosen;
}

SiteComparison compare_with_sites(const LoopConstraint& loop, const SessionSite& query,
                                  const SessionSite& match) {
  SiteComparison comparison;
  const Pose& T_site_match = match.pose(loop.match.keyframe);
  const Eigen::Vector3d& between = loop.T_match_query.translation;
  comparison.discrepancy_m = T_site_match * between - query.pose(loop.query.keyframe).translation;
  const Eigen::Matrix3d covariance = T_site_match.rotation *
                                     loop_covariance(loop).topLeftCorner<3, 3>() *
                                     T_site_match.rotation.transpose();
  const SessionSite::Variance of_query = query.variance(loop.query.keyframe);
  const SessionSite::Variance of_match = match.variance(loop.match.keyframe);
  // Both horizontal axes by the larger of what is possible: their sum.
  comparison.variance.horizontal = of_query.horizontal + of_match.horizontal +
                                   covariance.topLeftCorner<2, 2>().trace() +
                                   match.heading_variance() * between.squaredNorm();
  comparison.variance.vertical = of_query.vertical + of_match.vertical + covariance(2, 2) +
                                 square(kUpSigmaRad) * between.squaredNorm();
  comparison.chi2 =
      comparison.discrepancy_m.head<2>().squaredNorm() / comparison.variance.horizontal +
      square(comparison.discrepancy_m.z()) / comparison.variance.vertical;
  return comparison;
}

std::optional<double> set_contradiction_m(std::span<const LoopConstraint> loops,
                                          const SessionSite& query, const SessionSite& match) {
  std::optional<SiteComparison> horizontal;
  std::optional<SiteComparison> vertical;
  for (const LoopConstraint& loop : loops) {
    const SiteComparison found = compare_with_sites(loop, query, match);
    if (!horizontal || found.variance.horizontal < horizontal->variance.horizontal) {
      horizontal = found;
    }
    if (!vertical || found.variance.vertical < vertical->variance.vertical) vertical = found;
  }
  for (const auto& found : {horizontal, vertical}) {
    if (found && found->chi2 > kPositionChi2) return found->discrepancy_m.norm();
  }
  return std::nullopt;
}

ExcludedBeyond excluded_beyond(std::span<const LoopConstraint> loops, const SessionSite& query,
                               const SessionSite& match) {
  ExcludedBeyond beyond;
  for (const LoopConstraint& loop : loops) {
    const SiteComparison found = compare_with_sites(loop, query, match);
    beyond.horizontal_m =
        std::min(beyond.horizontal_m, found.discrepancy_m.head<2>().norm() +
                                          std::sqrt(kPositionChi2 * found.variance.horizontal));
    beyond.vertical_m =
        std::min(beyond.vertical_m, std::abs(found.discrepancy_m.z()) +
                                        std::sqrt(kPositionChi2 * found.variance.vertical));
  }
  return beyond;
}

std::string contradiction_text(std::vector<double> distances_m, std::size_t loops) {
  char text[128];
  std::snprintf(text, sizeof text,
                "%zu of %zu loops contradict the known positions of both sessions, by %.1f m",
                distances_m.size(), loops, median(std::span(distances_m)));
  return text;
}

}  // namespace unimapper::merge
