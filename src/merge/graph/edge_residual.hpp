// Residual of an edge of a pose graph and its derivatives.
#pragma once

#include <Eigen/Core>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Residual of an edge between two poses of the unified frame, and its derivatives by
/// translations added in that frame and rotations applied on the right.
struct EdgeResidual {
  Vector6d value;
  Matrix6d by_from;
  Matrix6d by_to;
};

/// The residual; `derivatives` may be null.
Vector6d edge_residual(const Pose& from, const Pose& to, const Pose& measured,
                       EdgeResidual* derivatives);

/// What a squared whitened residual costs under the Cauchy kernel of this scale; 0: itself.
[[nodiscard]] double robust(double chi2, double cauchy_scale);

/// The rotation by the angle and about the axis of `vector`.
[[nodiscard]] Eigen::Quaterniond rotation_by(const Eigen::Vector3d& vector);

/// Throws std::invalid_argument for what `optimize` refuses.
void check_graph(const PoseGraph& graph);

}  // namespace unimapper::merge
