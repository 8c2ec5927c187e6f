// The site frame of known positions in the pose graph of maps.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "map_graph.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/pose_graph.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// A position, and a loop between sessions with positions, agrees with the others up to this chi
/// square: 99.9 % with 3 degrees of freedom.
inline constexpr double kPositionChi2 = 16.27;

/// How well the map's up is known without positions, radians.
inline constexpr double kUpSigmaRad = 0.01;

/// The site frame placed by positions at the current estimate of the map.
struct SiteFit {
  Pose T_map_site;
  double heading_information = 0.0;  ///< of the positions about the heading, 1 / radians squared
};

/// Closest fit of the site to the positions in use of the given sessions. Its z axis is the central
/// session's up; a heading or horizontal position that nothing determines is the map's.
[[nodiscard]] SiteFit fit_site(const MapState& state, std::span<const KnownPosition> positions);

/// The positions in use of the given sessions.
[[nodiscard]] std::vector<KnownPosition> positions_of(const MapState& state,
                                                      std::span<const std::size_t> sessions);

/// Estimate less position, site frame, metres. The state has a site.
[[nodiscard]] Eigen::Vector3d position_residual(const MapState& state,
                                                const KnownPosition& position);

/// Squares of a residual over variances; x and y only where the position has them.
[[nodiscard]] double position_chi2(const KnownPosition& position, const Eigen::Vector3d& residual,
                                   double more_variance = 0.0);

/// The node of the site in a graph, with a prior for up alone: the rest of its prior is so weak
/// that it only holds what no position determines.
class SiteNode {
 public:
  /// Adds the site and its positions to the graph; nothing without positions.
  SiteNode(const MapState& state, std::span<const std::size_t> sessions,
           std::span<const std::size_t> first_node, double cauchy_scale, PoseGraph& graph);

  /// After optimisation. Nothing without positions.
  [[nodiscard]] std::optional<Pose> T_map_site(const PoseGraph& graph) const;

 private:
  std::optional<std::size_t> node_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();  ///< of the positions: the node's origin
};

}  // namespace unimapper::merge
