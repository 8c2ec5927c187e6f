// Pose graph optimisation with Ceres.
#include "unimapper/merge/pose_graph.hpp"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace unimapper::merge {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using RowMatrix67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

/// A pose as the solver holds it: translation, then quaternion x y z w.
using PoseBlock = std::array<double, 7>;

PoseBlock to_block(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {
      pose.translation.x(), pose.translation.y(), pose.translation.z(), q.x(), q.y(), q.z(), q.w()};
}

Pose from_block(const double* block) {
  return {Eigen::Quaterniond(block[6], block[3], block[4], block[5]),
          Eigen::Vector3d(block[0], block[1], block[2])};
}

/// t <- t + dt, R <- R exp(theta). Cost functions hand over their derivatives by (dt, theta) in
/// the first six columns, so the derivative of `Plus` is the identity over a row of zeros.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    for (int i = 0; i < 3; ++i) result[i] = x[i] + delta[i];
    const Eigen::Vector3d theta(delta[3], delta[4], delta[5]);
    const double half = 0.5 * theta.norm();
    const double scale = half < 1e-8 ? 0.5 : 0.5 * std::sin(half) / half;
    Eigen::Quaterniond step;
    step.w() = std::cos(half);
    step.vec() = scale * theta;
    const Eigen::Quaterniond q = (Eigen::Quaterniond(x[6], x[3], x[4], x[5]) * step).normalized();
    result[3] = q.x();
    result[4] = q.y();
    result[5] = q.z();
    result[6] = q.w();
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    j.topRows<6>().setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    for (int i = 0; i < 3; ++i) difference[i] = y[i] - x[i];
    Eigen::Quaterniond q = Eigen::Quaterniond(x[6], x[3], x[4], x[5]).conjugate() *
                           Eigen::Quaterniond(y[6], y[3], y[4], y[5]);
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    const double scale = sine < 1e-8 ? 2.0 : 2.0 * std::atan2(sine, q.w()) / sine;
    for (int i = 0; i < 3; ++i) difference[3 + i] = scale * q.vec()[i];
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<RowMatrix67> j(jacobian);
    j.setZero();
    j.leftCols<6>().setIdentity();
    return true;
  }
};

/// Residual of an edge between two poses of the unified frame, and its derivatives by
/// translations added in that frame and rotations applied on the right.
struct EdgeResidual {
  Vector6d value;
  Matrix6d by_from;
  Matrix6d by_to;
};

Vector6d edge_residual(const Pose& from, const Pose& to, const Pose& measured,
                       EdgeResidual* derivatives) {
  const Eigen::Vector3d between = from.rotation.transpose() * (to.translation - from.translation);
  const Eigen::Matrix3d relative = from.rotation.transpose() * to.rotation;
  Eigen::Quaterniond error(Eigen::Matrix3d(measured.rotation.transpose() * relative));
  if (error.w() < 0.0) error.coeffs() = -error.coeffs();
  Vector6d residual;
  residual << between - measured.translation, 2.0 * error.vec();
  if (derivatives == nullptr) return residual;

  const Eigen::Matrix3d by_right = error.w() * Eigen::Matrix3d::Identity() + skew(error.vec());
  derivatives->value = residual;
  derivatives->by_from.setZero();
  derivatives->by_from.topLeftCorner<3, 3>() = -from.rotation.transpose();
  derivatives->by_from.topRightCorner<3, 3>() = skew(between);
  derivatives->by_from.bottomRightCorner<3, 3>() = -by_right * relative.transpose();
  derivatives->by_to.setZero();
  derivatives->by_to.topLeftCorner<3, 3>() = from.rotation.transpose();
  derivatives->by_to.bottomRightCorner<3, 3>() = by_right;
  return residual;
}

/// Derivative of the unified pose anchor * node by the anchor and by the node.
Matrix6d by_anchor(const Pose& anchor, const Pose& node) {
  Matrix6d j = Matrix6d::Identity();
  j.topRightCorner<3, 3>() = -anchor.rotation * skew(node.translation);
  j.bottomRightCorner<3, 3>() = node.rotation.transpose();
  return j;
}

Matrix6d by_node(const Pose& anchor) {
  Matrix6d j = Matrix6d::Identity();
  j.topLeftCorner<3, 3>() = anchor.rotation;
  return j;
}

/// Between factor of two nodes of one map (blocks: from, to), or anchor factor of nodes of two
/// maps (blocks: from, to, anchor of from, anchor of to).
class EdgeCost final : public ceres::CostFunction {
 public:
  EdgeCost(const PoseGraph::Edge& edge, bool anchored)
      : measured_(edge.T_from_to),
        whitener_(edge.information.llt().matrixU()),
        anchored_(anchored) {
    mutable_parameter_block_sizes()->assign(anchored ? 4 : 2, 7);
    set_num_residuals(6);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Pose from_node = from_block(blocks[0]);
    const Pose to_node = from_block(blocks[1]);
    const Pose from_anchor = anchored_ ? from_block(blocks[2]) : Pose{};
    const Pose to_anchor = anchored_ ? from_block(blocks[3]) : Pose{};
    EdgeResidual derivatives;
    const Vector6d residual = edge_residual(from_anchor * from_node, to_anchor * to_node, measured_,
                                            jacobians == nullptr ? nullptr : &derivatives);
    Eigen::Map<Vector6d>(residuals, 6) = whitener_ * residual;
    if (jacobians == nullptr) return true;
    const Matrix6d from = whitener_ * derivatives.by_from;
    const Matrix6d to = whitener_ * derivatives.by_to;
    write(jacobians[0], anchored_ ? Matrix6d(from * by_node(from_anchor)) : from);
    write(jacobians[1], anchored_ ? Matrix6d(to * by_node(to_anchor)) : to);
    if (anchored_) {
      write(jacobians[2], from * by_anchor(from_anchor, from_node));
      write(jacobians[3], to * by_anchor(to_anchor, to_node));
    }
    return true;
  }

 private:
  static void write(double* jacobian, const Matrix6d& by_tangent) {
    if (jacobian == nullptr) return;
    Eigen::Map<RowMatrix67> j(jacobian);
    j.leftCols<6>() = by_tangent;
    j.col(6).setZero();
  }

  Pose measured_;
  Matrix6d whitener_;
  bool anchored_;
};

// The solver aborts the process on misuse, so nothing reaches it unchecked.
void check_graph(const PoseGraph& graph) {
  for (const auto& anchor : graph.anchors) {
    if (!anchor.T_map_session.is_rigid()) throw std::invalid_argument("pose graph: bad anchor");
  }
  for (const auto& node : graph.nodes) {
    if (node.anchor >= graph.anchors.size()) {
      throw std::invalid_argument("pose graph: node of an unknown map");
    }
    if (!node.T_session_node.is_rigid()) throw std::invalid_argument("pose graph: bad pose");
  }
  for (const auto& edge : graph.edges) {
    if (edge.from >= graph.nodes.size() || edge.to >= graph.nodes.size() || edge.from == edge.to) {
      throw std::invalid_argument("pose graph: edge between unknown nodes");
    }
    if (!edge.T_from_to.is_rigid()) throw std::invalid_argument("pose graph: bad measurement");
    if (!edge.information.allFinite() || edge.information.llt().info() != Eigen::Success) {
      throw std::invalid_argument("pose graph: information is not positive definite");
    }
    if (!(edge.cauchy_scale >= 0.0)) throw std::invalid_argument("pose graph: bad kernel");
  }
}

double robust(double chi2, double cauchy_scale) {
  if (cauchy_scale <= 0.0) return chi2;
  const double s = cauchy_scale * cauchy_scale;
  return s * std::log1p(chi2 / s);
}

}  // namespace

double edge_chi2(const PoseGraph& graph, const PoseGraph::Edge& edge) {
  const Vector6d r = edge_residual(graph.T_map_node(edge.from), graph.T_map_node(edge.to),
                                   edge.T_from_to, nullptr);
  return r.dot(edge.information * r);
}

double graph_cost(const PoseGraph& graph) {
  double cost = 0.0;
  for (const auto& edge : graph.edges) cost += robust(edge_chi2(graph, edge), edge.cauchy_scale);
  return cost;
}

SolveSummary optimize(PoseGraph& graph, std::uint32_t max_iterations) {
  check_graph(graph);
  SolveSummary summary;
  summary.initial_cost = graph_cost(graph);
  summary.final_cost = summary.initial_cost;
  summary.usable = true;
  if (graph.edges.empty()) return summary;

  std::vector<PoseBlock> nodes;
  std::vector<PoseBlock> anchors;
  nodes.reserve(graph.nodes.size());
  anchors.reserve(graph.anchors.size());
  for (const auto& node : graph.nodes) nodes.push_back(to_block(node.T_session_node));
  for (const auto& anchor : graph.anchors) anchors.push_back(to_block(anchor.T_map_session));

  PoseManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  for (const auto& edge : graph.edges) {
    const std::size_t a = graph.nodes[edge.from].anchor;
    const std::size_t b = graph.nodes[edge.to].anchor;
    auto loss = edge.cauchy_scale > 0.0 ? std::make_unique<ceres::CauchyLoss>(edge.cauchy_scale)
                                        : std::unique_ptr<ceres::CauchyLoss>();
    auto cost = std::make_unique<EdgeCost>(edge, a != b);
    std::vector<double*> blocks{nodes[edge.from].data(), nodes[edge.to].data()};
    if (a != b) blocks.insert(blocks.end(), {anchors[a].data(), anchors[b].data()});
    problem.AddResidualBlock(cost.release(), loss.release(), blocks);
  }
  const auto prepare = [&](PoseBlock& block, bool fixed) {
    if (!problem.HasParameterBlock(block.data())) return;
    problem.SetManifold(block.data(), &manifold);
    if (fixed) problem.SetParameterBlockConstant(block.data());
  };
  for (std::size_t i = 0; i < nodes.size(); ++i) prepare(nodes[i], graph.nodes[i].fixed);
  for (std::size_t i = 0; i < anchors.size(); ++i) prepare(anchors[i], graph.anchors[i].fixed);

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Eigen's own factorisation: the same bits whatever BLAS the machine has.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = static_cast<int>(std::min(max_iterations, 1000U));
  options.initial_trust_region_radius = 1e10;
  options.function_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  ceres::Solver::Summary solved;
  ceres::Solve(options, &problem, &solved);
  summary.usable = solved.IsSolutionUsable();
  summary.iterations = static_cast<std::uint32_t>(solved.iterations.size());
  if (!summary.usable) return summary;

  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!graph.nodes[i].fixed) graph.nodes[i].T_session_node = from_block(nodes[i].data());
  }
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    if (!graph.anchors[i].fixed) graph.anchors[i].T_map_session = from_block(anchors[i].data());
  }
  summary.final_cost = graph_cost(graph);
  return summary;
}

}  // namespace unimapper::merge
