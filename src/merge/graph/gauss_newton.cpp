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

  std::vector<Matrix6d> covariances() {
    linearize();
    if (!matrix_.factorize()) return {};
    const std::vector<Matrix6d> of_variables = matrix_.inverse_diagonal();
    std::vector<Matrix6d> of_nodes(graph_.nodes.size(), Matrix6d::Zero());
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      if (variables_[i] != kNoBlock) of_nodes[i] = of_variables[variables_[i]];
    }
    return of_nodes;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

std::vector<Matrix6d> node_covariances(PoseGraph graph) {
  check_one_map(graph);
  return GaussNewton(graph).covariances();
}

}  // namespace unimapper::merge
