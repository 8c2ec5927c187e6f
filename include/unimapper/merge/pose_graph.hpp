// Pose graphs with anchor nodes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::merge {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A pose graph whose nodes live in the frames of their maps; one anchor per map puts that
/// frame in the unified one (paper section VI: delta). A single map is a graph with one anchor.
struct PoseGraph {
  /// Where the frame of one map lies in the unified one.
  struct Anchor {
    Pose T_map_session;  ///< frame of the map to the unified frame, metres
    bool fixed = false;  ///< held at its value
  };
  /// Pose of one keyframe in the frame of its map.
  struct Node {
    Pose T_session_node;     ///< keyframe frame to the frame of its map, metres
    std::size_t anchor = 0;  ///< index into `anchors`: its map
    bool fixed = false;      ///< held at its value
  };
  /// A measured relative pose. The residual is (translation in `from`'s frame, twice the vector
  /// part of the quaternion of T_from_to^-1 * estimate): for small errors the rotation vector,
  /// for any error the chordal distance. `information` is its inverse covariance.
  struct Edge {
    std::size_t from = 0;                         ///< index into `nodes`
    std::size_t to = 0;                           ///< index into `nodes`
    Pose T_from_to;                               ///< frame of `to` to that of `from`, metres
    Matrix6d information = Matrix6d::Identity();  ///< of the residual, translation first
    /// xi of the Cauchy kernel on the whitened residual (paper section V-C); 0: quadratic.
    double cauchy_scale = 0.0;
  };

  /// A measured position of a point of one node in the frame of another, the site. The residual is
  /// estimate less position, each axis divided by its standard deviation.
  struct Position {
    std::size_t node = 0;                                     ///< index into `nodes`
    std::size_t site = 0;                                     ///< index into `nodes`
    Eigen::Vector3d point = Eigen::Vector3d::Zero();          ///< frame of `node`, metres
    Eigen::Vector3d position = Eigen::Vector3d::Zero();       ///< frame of `site`, metres
    Eigen::Vector3d inverse_sigma = Eigen::Vector3d::Ones();  ///< 1 / metres; 0: axis not measured
    double cauchy_scale = 0.0;                                ///< as of an edge
  };

  std::vector<Anchor> anchors;      ///< one per map
  std::vector<Node> nodes;          ///< keyframes of all maps
  std::vector<Edge> edges;          ///< odometry and loops
  std::vector<Position> positions;  ///< of points of nodes

  /// The node's pose in the unified frame.
  [[nodiscard]] Pose T_map_node(std::size_t node) const {
    return anchors[nodes[node].anchor].T_map_session * nodes[node].T_session_node;
  }
};

/// Outcome of an optimisation.
struct SolveSummary {
  bool usable = false;           ///< false: nothing was changed
  double initial_cost = 0.0;     ///< as `final_cost`, before the first iteration
  double final_cost = 0.0;       ///< sum of rho(residual^2); no factor one half
  std::uint32_t iterations = 0;  ///< of the solver, its start counted
};

/// Squared whitened residual of one edge at the current estimate; no kernel.
double edge_chi2(const PoseGraph& graph, const PoseGraph::Edge& edge);

/// Squared whitened residual of one position at the current estimate; no kernel.
double position_chi2(const PoseGraph& graph, const PoseGraph::Position& position);

/// Sum over all edges and positions, kernels applied.
double graph_cost(const PoseGraph& graph);

/// Moves free anchors and nodes to a minimum of `graph_cost` (Levenberg-Marquardt, sparse
/// Cholesky, one thread, deterministic). Throws std::invalid_argument for indices out of range,
/// non-finite poses, or information that is not positive definite. Nodes no edge reaches stay.
SolveSummary optimize(PoseGraph& graph, std::uint32_t max_iterations);

}  // namespace unimapper::merge
