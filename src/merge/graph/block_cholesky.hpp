// Sparse Cholesky factorisation in blocks.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace unimapper::merge {

/// Cholesky factor of a sparse symmetric positive definite matrix of 6 x 6 blocks, one block row
/// for each pose of a pose graph. Blocks are ordered by approximate minimum degree, once for a
/// structure. Plain loops in a fixed order on one thread: the same bits whatever BLAS there is.
class BlockCholesky {
 public:
  using Block = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;
  using Pair = std::pair<std::size_t, std::size_t>;

  /// A matrix of `size` block rows, zero but for its diagonal and the blocks at `pairs` (in either
  /// order, any number of times; of different rows).
  BlockCholesky(std::size_t size, std::span<const Pair> pairs);

  /// Sets all blocks to zero.
  void clear();
  /// Adds to a block on the diagonal.
  void add_diagonal(std::size_t row, const Block& block) { diagonal_[position_[row]] += block; }
  /// Adds to the block at row `pairs[pair].first`, column `pairs[pair].second`.
  void add(std::size_t pair, const Block& block);
  /// Multiplies the diagonal.
  void scale_diagonal(double factor);

  /// Replaces the matrix by its factor. False, and the matrix is lost, if it is not positive
  /// definite.
  [[nodiscard]] bool factorize();
  /// x of matrix * x = right, in place, after `factorize`.
  void solve(std::vector<Vector>& right) const;
  /// Diagonal blocks of the matrix' inverse, by block row, after `factorize`. Costs about as much
  /// (Takahashi, Fagan and Chin 1973).
  [[nodiscard]] std::vector<Block> inverse_diagonal() const;

 private:
  void order(std::span<const Pair> pairs);
  void find_structure(std::span<const Pair> pairs);
  void eliminate_column(std::size_t column);

  std::vector<std::size_t> position_;  ///< by block row: when it is eliminated
  std::vector<std::size_t> begin_;     ///< by column: its first block below the diagonal
  std::vector<std::size_t> rows_;      ///< of the blocks below the diagonal, ascending by column
  std::vector<Block> blocks_;
  std::vector<Block> diagonal_;  ///< after `factorize`: the inverses of the factor's
  struct Place {
    std::size_t block;
    bool transposed;
  };
  std::vector<Place> places_;  ///< of the pairs

  // Of the factorisation: columns that have their next block in a row, as lists.
  std::vector<std::size_t> first_of_row_;
  std::vector<std::size_t> next_column_;
  std::vector<std::size_t> next_block_;
  std::vector<std::size_t> place_of_row_;
};

}  // namespace unimapper::merge
