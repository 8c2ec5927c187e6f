// Pose graph optimisation with Ceres.
#include "unimapper/merge/pose_graph.hpp"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "edge_residual.hpp"

namespace unimapper::merge {
namespace {

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
    const Eigen::Quaterniond q =
        (Eigen::Quaterniond(x[6], x[3], x[4], x[5]) * rotation_by(theta)).normalized();
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

/// Estimated position of a point in the frame of the site.
Eigen::Vector3d in_site(const Pose& T_map_site, const Pose& T_map_node,
                        const PoseGraph::Position& position) {
  return T_map_site.inverse() * (T_map_node * position.point);
}

/// Position factor (blocks: node, anchor of node, site, anchor of site).
class PositionCost final : public ceres::SizedCostFunction<3, 7, 7, 7, 7> {
 public:
  explicit PositionCost(const PoseGraph::Position& position) : given_(position) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Pose node = from_block(blocks[0]);
    const Pose anchor = from_block(blocks[1]);
    const Pose site = from_block(blocks[2]);
    const Pose site_anchor = from_block(blocks[3]);
    const Pose T_map_node = anchor * node;
    const Pose T_map_site = site_anchor * site;
    const Eigen::Vector3d estimate = in_site(T_map_site, T_map_node, given_);
    const auto whitener = given_.inverse_sigma.asDiagonal();
    Eigen::Map<Eigen::Vector3d>(residuals, 3) = whitener * (estimate - given_.position);
    if (jacobians == nullptr) return true;
    Eigen::Matrix<double, 3, 6> of_node;
    of_node << Eigen::Matrix3d::Identity(), -T_map_node.rotation * skew(given_.point);
    of_node = whitener * T_map_site.rotation.transpose() * of_node;
    Eigen::Matrix<double, 3, 6> of_site;
    of_site << -T_map_site.rotation.transpose(), skew(estimate);
    of_site = whitener * of_site;
    write(jacobians[0], of_node * by_node(anchor));
    write(jacobians[1], of_node * by_anchor(anchor, node));
    write(jacobians[2], of_site * by_node(site_anchor));
    write(jacobians[3], of_site * by_anchor(site_anchor, site));
    return true;
  }

 private:
  static void write(double* jacobian, const Eigen::Matrix<double, 3, 6>& by_tangent) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> j(jacobian);
    j.leftCols<6>() = by_tangent;
    j.col(6).setZero();
  }

  PoseGraph::Position given_;
};

}  // namespace

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

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& vector) {
  const double half = 0.5 * vector.norm();
  const double scale = half < 1e-8 ? 0.5 : 0.5 * std::sin(half) / half;
  Eigen::Quaterniond rotation;
  rotation.w() = std::cos(half);
  rotation.vec() = scale * vector;
  return rotation;
}

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
  for (const auto& position : graph.positions) {
    if (position.node >= graph.nodes.size() || position.site >= graph.nodes.size() ||
        graph.nodes[position.node].anchor == graph.nodes[position.site].anchor) {
      throw std::invalid_argument("pose graph: position of an unknown node");
    }
    const bool is_finite = position.point.allFinite() && position.position.allFinite() &&
                           position.inverse_sigma.allFinite();
    if (!is_finite || !(position.inverse_sigma.minCoeff() >= 0.0)) {
      throw std::invalid_argument("pose graph: bad position");
    }
    if (!(position.cauchy_scale >= 0.0)) throw std::invalid_argument("pose graph: bad kernel");
  }
}

double robust(double chi2, double cauchy_scale) {
  if (cauchy_scale <= 0.0) return chi2;
  const double s = cauchy_scale * cauchy_scale;
  return s * std::log1p(chi2 / s);
}

double edge_chi2(const PoseGraph& graph, const PoseGraph::Edge& edge) {
  const Vector6d r = edge_residual(graph.T_map_node(edge.from), graph.T_map_node(edge.to),
                                   edge.T_from_to, nullptr);
  return r.dot(edge.information * r);
}

namespace {

/// The problem takes it; none: quadratic.
ceres::LossFunction* kernel(double cauchy_scale) {
  return cauchy_scale > 0.0 ? std::make_unique<ceres::CauchyLoss>(cauchy_scale).release() : nullptr;
}

}  // namespace

double position_chi2(const PoseGraph& graph, const PoseGraph::Position& position) {
  const Eigen::Vector3d estimate =
      in_site(graph.T_map_node(position.site), graph.T_map_node(position.node), position);
  return (estimate - position.position).cwiseProduct(position.inverse_sigma).squaredNorm();
}

double graph_cost(const PoseGraph& graph) {
  double cost = 0.0;
  for (const auto& edge : graph.edges) cost += robust(edge_chi2(graph, edge), edge.cauchy_scale);
  for (const auto& position : graph.positions) {
    cost += robust(position_chi2(graph, position), position.cauchy_scale);
  }
  return cost;
}

SolveSummary optimize(PoseGraph& graph, std::uint32_t max_iterations) {
  check_graph(graph);
  SolveSummary summary;
  summary.initial_cost = graph_cost(graph);
  summary.final_cost = summary.initial_cost;
  summary.usable = true;
  if (graph.edges.empty() && graph.positions.empty()) return summary;

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
    auto cost = std::make_unique<EdgeCost>(edge, a != b);
    std::vector<double*> blocks{nodes[edge.from].data(), nodes[edge.to].data()};
    if (a != b) blocks.insert(blocks.end(), {anchors[a].data(), anchors[b].data()});
    problem.AddResidualBlock(cost.release(), kernel(edge.cauchy_scale), blocks);
  }
  for (const auto& position : graph.positions) {
    const std::size_t a = graph.nodes[position.node].anchor;
    const std::size_t b = graph.nodes[position.site].anchor;
    auto cost = std::make_unique<PositionCost>(position);
    problem.AddResidualBlock(cost.release(), kernel(position.cauchy_scale),
                             nodes[position.node].data(), anchors[a].data(),
                             nodes[position.site].data(), anchors[b].data());
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
