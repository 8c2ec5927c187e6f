// Chordal initialisation of pose graphs (Martinec and Pajdla 2007, Carlone et al. 2015).
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <numeric>

#include "unimapper/core/nearest_rotation.hpp"
#include "unimapper/core/union_find.hpp"
#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Isotropic weights of an edge: rotation and translation are solved one after the other.
struct EdgeWeight {
  double rotation;
  double translation;
};

EdgeWeight edge_weight(const PoseGraph::Edge& edge) {
  return {edge.information.bottomRightCorner<3, 3>().trace() / 3.0,
          edge.information.topLeftCorner<3, 3>().trace() / 3.0};
}

bool is_connected(const PoseGraph& graph) {
  std::vector<std::size_t> parent(graph.nodes.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto parent_of = [&](std::size_t i) -> std::size_t& { return parent[i]; };
  std::size_t components = graph.nodes.size();
  for (const auto& edge : graph.edges) {
    if (join_sets(edge.from, edge.to, parent_of)) --components;
  }
  return components == 1;
}

/// Normal equations over all nodes but the root, `width` rows of three columns per node.
struct NormalEquations {
  NormalEquations(std::size_t nodes, std::size_t root_node, int rows_per_node)
      : root(root_node),
        width(rows_per_node),
        right(Eigen::MatrixXd::Zero(rows_per_node * static_cast<Eigen::Index>(nodes - 1), 3)) {}

  /// First row of `node`, which is not the root.
  [[nodiscard]] int row(std::size_t node) const {
    return width * static_cast<int>(node < root ? node : node - 1);
  }

  /// False if the matrix is not positive definite.
  bool solve(Eigen::MatrixXd& solution) const {
    Sparse matrix(right.rows(), right.rows());
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Sparse> factor(matrix);
    if (factor.info() != Eigen::Success) return false;
    solution = factor.solve(right);
    return factor.info() == Eigen::Success && solution.allFinite();
  }

  std::size_t root;
  int width;
  Eigen::MatrixXd right;
  std::vector<Eigen::Triplet<double>> entries;
};

/// Minimises sum w |R_to - R_from R_measured|^2 without the rotation constraint. Transposed, the
/// unknowns are the rows of R stacked as 3x3 blocks: R_to^T - R_measured^T R_from^T.
bool solve_rotations(const PoseGraph& graph, std::size_t root,
                     std::vector<Eigen::Matrix3d>& rotations) {
  NormalEquations system(graph.nodes.size(), root, 3);
  const Eigen::Matrix3d fixed = rotations[root].transpose();
  for (const auto& edge : graph.edges) {
    const double w = edge_weight(edge).rotation;
    const Eigen::Matrix3d m = edge.T_from_to.rotation.transpose();
    const bool from_free = edge.from != root;
    const bool to_free = edge.to != root;
    const int from = system.row(edge.from);
    const int to = system.row(edge.to);
    for (int i = 0; i < 3; ++i) {
      if (from_free) system.entries.emplace_back(from + i, from + i, w);
      if (to_free) system.entries.emplace_back(to + i, to + i, w);
      for (int j = 0; j < 3 && from_free && to_free; ++j) {
        system.entries.emplace_back(to + i, from + j, -w * m(i, j));
        system.entries.emplace_back(from + j, to + i, -w * m(i, j));
      }
    }
    if (!from_free) system.right.middleRows<3>(to) += w * m * fixed;
    if (!to_free) system.right.middleRows<3>(from) += w * m.transpose() * fixed;
  }
  Eigen::MatrixXd solution;
  if (!system.solve(solution)) return false;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (i == root) continue;
    rotations[i] = nearest_rotation(solution.middleRows<3>(system.row(i)).transpose()).rotation;
  }
  return true;
}

/// Minimises sum w |t_to - t_from - R_from t_measured|^2; the three axes share one matrix.
bool solve_translations(const PoseGraph& graph, std::size_t root,
                        const std::vector<Eigen::Matrix3d>& rotations,
                        std::vector<Eigen::Vector3d>& translations) {
  NormalEquations system(graph.nodes.size(), root, 1);
  for (const auto& edge : graph.edges) {
    const double w = edge_weight(edge).translation;
    const Eigen::Vector3d step = rotations[edge.from] * edge.T_from_to.translation;
    const bool from_free = edge.from != root;
    const bool to_free = edge.to != root;
    const int from = system.row(edge.from);
    const int to = system.row(edge.to);
    if (from_free) {
      system.entries.emplace_back(from, from, w);
      system.right.row(from) -= w * step.transpose();
      if (!to_free) system.right.row(from) += w * translations[root].transpose();
    }
    if (to_free) {
      system.entries.emplace_back(to, to, w);
      system.right.row(to) += w * step.transpose();
      if (!from_free) system.right.row(to) += w * translations[root].transpose();
    }
    if (from_free && to_free) {
      system.entries.emplace_back(from, to, -w);
      system.entries.emplace_back(to, from, -w);
    }
  }
  Eigen::MatrixXd solution;
  if (!system.solve(solution)) return false;
  for (std::size_t i = 0; i < translations.size(); ++i) {
    if (i != root) translations[i] = solution.row(system.row(i)).transpose();
  }
  return true;
}

}  // namespace

bool initialize_chordal(PoseGraph& graph) {
  if (graph.anchors.size() != 1 || graph.nodes.size() < 2 || !is_connected(graph)) return false;
  const auto fixed = std::find_if(graph.nodes.begin(), graph.nodes.end(),
                                  [](const PoseGraph::Node& node) { return node.fixed; });
  const std::size_t root =
      fixed == graph.nodes.end() ? 0 : static_cast<std::size_t>(fixed - graph.nodes.begin());
  std::vector<Eigen::Matrix3d> rotations;
  std::vector<Eigen::Vector3d> translations;
  for (const auto& node : graph.nodes) {
    rotations.push_back(node.T_session_node.rotation);
    translations.push_back(node.T_session_node.translation);
  }
  if (!solve_rotations(graph, root, rotations)) return false;
  if (!solve_translations(graph, root, rotations, translations)) return false;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!graph.nodes[i].fixed) graph.nodes[i].T_session_node = {rotations[i], translations[i]};
  }
  return true;
}

}  // namespace unimapper::merge
