// Gauss-Newton method with iteratively reweighted edges and a sparse block Cholesky factorisation.
#include "gauss_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "block_cholesky.hpp"
#include "edge_residual.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kNoBlock = std::numeric_limits<std::size_t>::max();
/// Enough for maps that no edge ties to a fixed node.
constexpr double kLeastDamping = 1e-10;
constexpr double kMostDamping = 1e8;

class GaussNewton {
 public:
  explicit GaussNewton(PoseGraph& graph)
      : graph_(graph),
        variables_(number_variables(graph)),
        pairs_(find_pairs()),
        matrix_(count_, pairs_) {}

  SolveSummary run(std::uint32_t max_iterations, double tolerance) {
    SolveSummary summary;
    double cost = graph_cost(graph_);
    summary.initial_cost = cost;
    summary.usable = true;
    double damping = kLeastDamping;
    double raise = 2.0;
    while (summary.iterations < max_iterations && count_ > 0 && damping < kMostDamping) {
      ++summary.iterations;
      const std::vector<PoseGraph::Node> before = graph_.nodes;
      const double expected = step(damping);
      const double after = expected > 0.0 ? graph_cost(graph_) : kInfinity;
      const double lowered = cost - after;
      if (!(lowered > 0.0)) graph_.nodes = before;
      // At the minimum a step changes the cost by no more than rounding does.
      const bool converged = std::abs(lowered) <= tolerance * cost;
      if (lowered > 0.0) {
        // The closer a step comes to what its linearisation expects, the less it is damped.
        damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * lowered / expected - 1.0, 3.0));
        damping = std::max(damping, kLeastDamping);
        raise = 2.0;
        cost = after;
      } else {
        damping *= raise;
        raise *= 2.0;
      }
      if (converged) break;
    }
    summary.final_cost = cost;
    return summary;
  }

  /// Of horizontal positions less the motion that fits those of `frame` best: a linear map of the
  /// errors, so covariances with the motion are all it takes.
  std::vector<Eigen::Matrix2d> covariances(std::span<const std::size_t> frame) {
    linearize();
    if (!matrix_.factorize()) return {};
    const std::vector<Matrix6d> marginal = matrix_.inverse_diagonal();
    const Eigen::Vector2d centre = centre_of(frame);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    for (const std::size_t i : frame) {
      normal += by_motion(i, centre).transpose() * by_motion(i, centre);
    }
    // Of nodes in one place nothing but their edges tells the heading.
    if (normal(2, 2) < kLeastSpreadM2) normal(2, 2) = std::numeric_limits<double>::infinity();
    const Eigen::Matrix3d inverse = normal.diagonal().cwiseInverse().asDiagonal();
    const std::vector<Eigen::Matrix<double, 2, 3>> with_sums = covariances_with(frame, centre);
    Eigen::Matrix3d of_sums = Eigen::Matrix3d::Zero();
    for (const std::size_t i : frame) of_sums += by_motion(i, centre).transpose() * with_sums[i];
    std::vector<Eigen::Matrix2d> of_nodes(graph_.nodes.size());
    for (std::size_t i = 0; i < of_nodes.size(); ++i) {
      const Eigen::Matrix<double, 2, 3> moved = by_motion(i, centre) * inverse;
      const Eigen::Matrix2d crossed = with_sums[i] * moved.transpose();
      of_nodes[i] = moved * of_sums * moved.transpose() - crossed - crossed.transpose();
      if (variables_[i] != kNoBlock) {
        of_nodes[i] += marginal[variables_[i]].topLeftCorner<2, 2>();
      }
    }
    return of_nodes;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  static constexpr double kLeastSpreadM2 = 1.0;

  [[nodiscard]] Eigen::Vector2d centre_of(std::span<const std::size_t> nodes) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const std::size_t i : nodes) sum += graph_.T_map_node(i).translation.head<2>();
    return sum / static_cast<double>(nodes.size());
  }

  /// How a shift along x and y and a turn about the centre move a node.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> by_motion(std::size_t node,
                                                      const Eigen::Vector2d& centre) const {
    const Eigen::Vector2d at = graph_.T_map_node(node).translation.head<2>() - centre;
    Eigen::Matrix<double, 2, 3> by;
    by << 1.0, 0.0, -at.y(), 0.0, 1.0, at.x();
    return by;
  }

  /// By node the covariance of its position with the right side of the motion's normal equations.
  [[nodiscard]] std::vector<Eigen::Matrix<double, 2, 3>> covariances_with(
      std::span<const std::size_t> frame, const Eigen::Vector2d& centre) const {
    std::vector<Eigen::Matrix<double, 2, 3>> covariances(graph_.nodes.size(),
                                                         Eigen::Matrix<double, 2, 3>::Zero());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<Vector6d> sums(count_, Vector6d::Zero());
      for (const std::size_t i : frame) {
        if (variables_[i] != kNoBlock) {
          sums[variables_[i]].head<2>() += by_motion(i, centre).col(axis);
        }
      }
      matrix_.solve(sums);
      for (std::size_t i = 0; i < covariances.size(); ++i) {
        if (variables_[i] != kNoBlock) covariances[i].col(axis) = sums[variables_[i]].head<2>();
      }
    }
    return covariances;
  }

  std::vector<std::size_t> number_variables(const PoseGraph& graph) {
    std::vector<std::size_t> variables(graph.nodes.size(), kNoBlock);
    for (const auto& edge : graph.edges) {
      for (const std::size_t node : {edge.from, edge.to}) {
        if (!graph.nodes[node].fixed && variables[node] == kNoBlock) variables[node] = count_++;
      }
    }
    return variables;
  }

  [[nodiscard]] std::vector<BlockCholesky::Pair> find_pairs() const {
    std::vector<BlockCholesky::Pair> pairs;
    for (const auto& edge : graph_.edges) {
      const std::size_t from = variables_[edge.from];
      const std::size_t to = variables_[edge.to];
      if (from != kNoBlock && to != kNoBlock) pairs.emplace_back(from, to);
    }
    return pairs;
  }

  /// Normal equations at the current estimate.
  void linearize() {
    matrix_.clear();
    right_.assign(count_, Vector6d::Zero());
    std::size_t pair = 0;
    for (const auto& edge : graph_.edges) {
      EdgeResidual e;
      edge_residual(graph_.T_map_node(edge.from), graph_.T_map_node(edge.to), edge.T_from_to, &e);
      const Vector6d weighted = edge.information * e.value;
      const double weight = cauchy_weight(e.value.dot(weighted), edge.cauchy_scale);
      const Matrix6d information = weight * edge.information;
      const std::size_t from = variables_[edge.from];
      const std::size_t to = variables_[edge.to];
      const Matrix6d by_to = information.lazyProduct(e.by_to);
      if (from != kNoBlock) {
        const Matrix6d by_from = information.lazyProduct(e.by_from);
        matrix_.add_diagonal(from, e.by_from.transpose().lazyProduct(by_from));
        right_[from].noalias() -= weight * (e.by_from.transpose() * weighted);
      }
      if (to != kNoBlock) {
        matrix_.add_diagonal(to, e.by_to.transpose().lazyProduct(by_to));
        right_[to].noalias() -= weight * (e.by_to.transpose() * weighted);
      }
      if (from != kNoBlock && to != kNoBlock) {
        matrix_.add(pair++, e.by_from.transpose().lazyProduct(by_to));
      }
    }
  }

  static double cauchy_weight(double chi2, double scale) {
    return scale > 0.0 ? 1.0 / (1.0 + chi2 / (scale * scale)) : 1.0;
  }

  /// Moves the nodes. By how much the linearised cost decreases, without the damping's part; 0: not
  /// solvable, and nothing moved.
  double step(double damping) {
    linearize();
    matrix_.scale_diagonal(1.0 + damping);
    if (!matrix_.factorize()) return 0.0;
    std::vector<Vector6d> moved = right_;
    matrix_.solve(moved);
    double expected = 0.0;
    for (std::size_t i = 0; i < count_; ++i) expected += right_[i].dot(moved[i]);
    if (!std::isfinite(expected)) return 0.0;
    const Eigen::Matrix3d into_session = graph_.anchors[0].T_map_session.rotation.transpose();
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      if (variables_[i] == kNoBlock) continue;
      const Vector6d& by = moved[variables_[i]];
      Pose& pose = graph_.nodes[i].T_session_node;
      pose = {Eigen::Quaterniond(pose.quaternion() * rotation_by(by.tail<3>())),
              pose.translation + into_session * by.head<3>()};
    }
    return expected;
  }

  PoseGraph& graph_;
  std::size_t count_ = 0;
  std::vector<std::size_t> variables_;  ///< by node; kNoBlock: fixed, or without edges
  std::vector<BlockCholesky::Pair> pairs_;
  BlockCholesky matrix_;
  std::vector<Vector6d> right_;
};

void check_one_map(const PoseGraph& graph) {
  if (graph.anchors.size() != 1) throw std::invalid_argument("pose graph: not of one map");
  check_graph(graph);
}

}  // namespace

SolveSummary optimize_one_map(PoseGraph& graph, std::uint32_t max_iterations, double tolerance) {
  check_one_map(graph);
  return GaussNewton(graph).run(max_iterations, tolerance);
}

std::vector<Eigen::Matrix2d> position_covariances(PoseGraph graph,
                                                  std::span<const std::size_t> frame) {
  check_one_map(graph);
  return GaussNewton(graph).covariances(frame);
}

}  // namespace unimapper::merge
