// Sparse Cholesky factorisation in blocks: against a dense one
#include "src/merge/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "tests/merge/random.hpp"

using namespace unimapper::merge;
using unimapper::merge::testing::Random;
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
