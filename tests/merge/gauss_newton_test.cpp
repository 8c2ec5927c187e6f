// Gauss-Newton method with a sparse factorisation in blocks: against general solvers
#include "src/merge/graph/gauss_newton.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "src/merge/graph/block_cholesky.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "tests/merge/alignment_scene.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Block = BlockCholesky::Block;
using Vector = BlockCholesky::Vector;

namespace {

constexpr std::size_t kRows = 40;

/// A chain of block rows with shortcuts, some of them twice and some from the later row.
std::vector<BlockCholesky::Pair> pairs_of_a_chain(Random& random) {
  std::vector<BlockCholesky::Pair> pairs;
  for (std::size_t i = 1; i < kRows; ++i) pairs.emplace_back(i - 1, i);
  for (std::size_t i = 0; i < 30; ++i) {
    const std::size_t a = random.below(kRows);
    const std::size_t b = random.below(kRows);
    if (a != b) pairs.emplace_back(a, b);
  }
  pairs.push_back(pairs.back());
  pairs.emplace_back(pairs.back().second, pairs.back().first);
  return pairs;
}

/// Adds the same blocks to a sparse and to a dense matrix.
Eigen::MatrixXd fill(BlockCholesky& matrix, const std::vector<BlockCholesky::Pair>& pairs,
                     Random& random) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * kRows, 6 * kRows);
  matrix.clear();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const Block block = Block::NullaryExpr([&] { return random.normal(); });
    const auto row = static_cast<Eigen::Index>(6 * pairs[p].first);
    const auto column = static_cast<Eigen::Index>(6 * pairs[p].second);
    matrix.add(p, block);
    dense.block<6, 6>(row, column) += block;
    dense.block<6, 6>(column, row) += block.transpose();
  }
  for (std::size_t i = 0; i < kRows; ++i) {
    const auto row = static_cast<Eigen::Index>(6 * i);
    const Block diagonal = 60.0 * Block::Identity();
    matrix.add_diagonal(i, diagonal);
    dense.block<6, 6>(row, row) += diagonal;
  }
  return dense;
}

}  // namespace

TEST_CASE("A sparse system of blocks has the solution of the dense one", "[block_cholesky]") {
  Random random(5);
  const std::vector<BlockCholesky::Pair> pairs = pairs_of_a_chain(random);
  BlockCholesky matrix(kRows, pairs);
  // The structure is used twice.
  for (int round = 0; round < 2; ++round) {
    Eigen::MatrixXd dense = fill(matrix, pairs, random);
    matrix.scale_diagonal(1.5);
    dense.diagonal() *= 1.5;
    std::vector<Vector> x(kRows);
    Eigen::VectorXd right(6 * kRows);
    for (std::size_t i = 0; i < kRows; ++i) {
      x[i] = Vector::NullaryExpr([&] { return random.normal(); });
      right.segment<6>(static_cast<Eigen::Index>(6 * i)) = x[i];
    }
    REQUIRE(matrix.factorize());
    matrix.solve(x);
    const Eigen::VectorXd expected = dense.llt().solve(right);
    const Eigen::MatrixXd inverse = dense.inverse();
    const std::vector<Block> diagonal = matrix.inverse_diagonal();
    for (std::size_t i = 0; i < kRows; ++i) {
      const auto row = static_cast<Eigen::Index>(6 * i);
      CHECK((x[i] - expected.segment<6>(row)).norm() < 1e-12);
      CHECK((diagonal[i] - inverse.block<6, 6>(row, row)).norm() < 1e-12);
    }
  }
}

TEST_CASE("A matrix that is not positive definite or not finite has no factor",
          "[block_cholesky]") {
  const BlockCholesky::Pair pair{0, 1};
  BlockCholesky matrix(2, {&pair, 1});
  const auto has_factor = [&](double beside, double second) {
    matrix.clear();
    matrix.add_diagonal(0, Block::Identity());
    matrix.add_diagonal(1, second * Block::Identity());
    matrix.add(0, beside * Block::Identity());
    return matrix.factorize();
  };
  CHECK(has_factor(0.9, 1.0));
  CHECK_FALSE(has_factor(1.1, 1.0));
  CHECK_FALSE(has_factor(0.0, 0.0));
  CHECK_FALSE(has_factor(0.0, std::nan("")));
}

namespace {

/// Two laps of a drive, tied to each other by loops of which every fifth is wrong.
PoseGraph two_laps(std::uint64_t seed) {
  Random random(seed);
  constexpr std::size_t kLap = 60;
  std::vector<Pose> truth = drive(random, kLap, yaw_pose(0.7, {300.0, -200.0, 5.0}));
  truth.insert(truth.end(), truth.begin(), truth.end());
  const SessionPath measured(odometry(random, truth), OdometryNoiseConfig{});
  PoseGraph graph;
  graph.anchors.push_back({yaw_pose(2.0, {50.0, 60.0, 7.0}), true});
  for (std::size_t i = 0; i < truth.size(); ++i) {
    graph.nodes.push_back({measured[i], 0, i == 0});
    if (i == 0) continue;
    graph.edges.push_back(
        {i - 1, i, measured[i - 1].inverse() * measured[i], measured.information(i - 1, i), 0.0});
  }
  for (std::size_t i = 0; i < kLap; i += 4) {
    Pose seen = random.pose(0.2, 0.01);
    if (i % 20 == 0) seen.translation.y() += 8.0;
    graph.edges.push_back({kLap + i, i, seen, 25.0 * Matrix6d::Identity(), 3.5});
  }
  return graph;
}

void move_nodes(PoseGraph& graph, std::uint64_t seed, double sigma_m, double sigma_rad) {
  Random random(seed);
  for (std::size_t i = 1; i < graph.nodes.size(); ++i) {
    graph.nodes[i].T_session_node = graph.nodes[i].T_session_node * random.pose(sigma_m, sigma_rad);
  }
}

double moved_m(const PoseGraph& from, const PoseGraph& to, std::size_t node) {
  return apart_m(from.nodes[node].T_session_node, to.nodes[node].T_session_node);
}

}  // namespace

TEST_CASE("The Gauss-Newton method finds the minimum that the general solver finds",
          "[pose_graph]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PoseGraph graph = two_laps(seed);
    PoseGraph expected = graph;
    REQUIRE(optimize(expected, 100).usable);
    const SolveSummary summary = optimize_one_map(graph, 100, 1e-9);
    REQUIRE(summary.usable);
    CHECK(summary.iterations < 30);
    CHECK(summary.final_cost < 0.7 * summary.initial_cost);
    CHECK(summary.final_cost == Approx(graph_cost(graph)));
    CHECK(summary.final_cost == Approx(graph_cost(expected)).epsilon(1e-6));
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      CHECK(moved_m(expected, graph, i) < 0.01);
    }
  }
}

TEST_CASE("A step that would raise the cost is damped", "[pose_graph]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PoseGraph graph = two_laps(seed);
    move_nodes(graph, seed, 20.0, 1.5);
    const double before = graph_cost(graph);
    const SolveSummary summary = optimize_one_map(graph, 200, 1e-9);
    REQUIRE(summary.usable);
    CHECK(summary.final_cost < 1e-3 * before);
    CHECK(summary.final_cost == Approx(graph_cost(graph)));
  }
}

TEST_CASE("A coarser tolerance ends earlier", "[pose_graph]") {
  PoseGraph fine = two_laps(8);
  PoseGraph coarse = fine;
  const SolveSummary first = optimize_one_map(coarse, 100, 1e-2);
  const SolveSummary last = optimize_one_map(fine, 100, 1e-9);
  CHECK(first.iterations < last.iterations);
  CHECK(first.final_cost < 1.05 * last.final_cost);
}

TEST_CASE("Fixed nodes and nodes that no edge reaches stay", "[pose_graph]") {
  PoseGraph graph = two_laps(9);
  graph.nodes[30].fixed = true;
  graph.nodes.push_back({yaw_pose(1.0, {1.0, 2.0, 3.0}), 0, false});
  const PoseGraph before = graph;
  REQUIRE(optimize_one_map(graph, 100, 1e-9).usable);
  for (const std::size_t i : {0U, 30U, 120U}) CHECK(moved_m(before, graph, i) == 0.0);
  CHECK(moved_m(before, graph, 31) > 0.0);
}

TEST_CASE("The Gauss-Newton method refuses graphs of several maps and what the general one does",
          "[pose_graph]") {
  PoseGraph graph = two_laps(10);
  graph.edges[3].information.setZero();
  CHECK_THROWS_AS(optimize_one_map(graph, 10, 1e-9), std::invalid_argument);
  graph = two_laps(10);
  graph.anchors.push_back({Pose{}, false});
  CHECK_THROWS_AS(optimize_one_map(graph, 10, 1e-9), std::invalid_argument);
}
