// Left-looking Cholesky factorisation by block columns (Davis 2006).
#include "block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>

namespace unimapper::merge {
namespace {

constexpr std::size_t kNoColumn = std::numeric_limits<std::size_t>::max();

}  // namespace

BlockCholesky::BlockCholesky(std::size_t size, std::span<const Pair> pairs)
    : position_(size),
      diagonal_(size),
      first_of_row_(size),
      next_column_(size),
      next_block_(size),
      place_of_row_(size) {
  order(pairs);
  find_structure(pairs);
  clear();
}

void BlockCholesky::order(std::span<const Pair> pairs) {
  const auto size = static_cast<int>(position_.size());
  std::vector<Eigen::Triplet<char>> entries;
  entries.reserve(position_.size() + 2 * pairs.size());
  for (int i = 0; i < size; ++i) entries.emplace_back(i, i, 1);
  for (const auto& [a, b] : pairs) {
    entries.emplace_back(static_cast<int>(a), static_cast<int>(b), 1);
    entries.emplace_back(static_cast<int>(b), static_cast<int>(a), 1);
  }
  Eigen::SparseMatrix<char> pattern(size, size);
  pattern.setFromTriplets(entries.begin(), entries.end(), [](char, char) { return char{1}; });
  Eigen::AMDOrdering<int>::PermutationType eliminated;
  Eigen::AMDOrdering<int>()(pattern, eliminated);
  for (int i = 0; i < size; ++i) {
    position_[static_cast<std::size_t>(eliminated.indices()[i])] = static_cast<std::size_t>(i);
  }
}

void BlockCholesky::find_structure(std::span<const Pair> pairs) {
  const std::size_t size = position_.size();
  // A column has the rows of its own pairs and those of its children in the elimination tree.
  std::vector<std::vector<std::size_t>> columns(size);
  for (const auto& [a, b] : pairs) {
    const auto [column, row] = std::minmax(position_[a], position_[b]);
    columns[column].push_back(row);
  }
  std::vector<std::vector<std::size_t>> children(size);
  begin_.assign(size + 1, 0);
  for (std::size_t column = 0; column < size; ++column) {
    std::vector<std::size_t>& rows = columns[column];
    for (const std::size_t child : children[column]) {
      const std::vector<std::size_t>& below = columns[child];
      std::copy_if(below.begin(), below.end(), std::back_inserter(rows),
                   [&](std::size_t row) { return row != column; });
    }
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (!rows.empty()) children[rows.front()].push_back(column);
    begin_[column + 1] = begin_[column] + rows.size();
  }
  rows_.reserve(begin_.back());
  for (const auto& rows : columns) rows_.insert(rows_.end(), rows.begin(), rows.end());
  blocks_.resize(rows_.size());
  for (const auto& [a, b] : pairs) {
    const auto [column, row] = std::minmax(position_[a], position_[b]);
    const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column]);
    const auto last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column + 1]);
    const auto found = std::lower_bound(first, last, row);
    places_.push_back({static_cast<std::size_t>(found - rows_.begin()), position_[a] == column});
  }
}

void BlockCholesky::clear() {
  std::fill(blocks_.begin(), blocks_.end(), Block::Zero());
  std::fill(diagonal_.begin(), diagonal_.end(), Block::Zero());
}

void BlockCholesky::add(std::size_t pair, const Block& block) {
  const Place& place = places_[pair];
  if (place.transposed) {
    blocks_[place.block] += block.transpose();
  } else {
    blocks_[place.block] += block;
  }
}

void BlockCholesky::scale_diagonal(double factor) {
  for (Block& block : diagonal_) block.diagonal() *= factor;
}

/// Subtracts what the columns before contribute.
void BlockCholesky::eliminate_column(std::size_t column) {
  for (std::size_t b = begin_[column]; b < begin_[column + 1]; ++b) place_of_row_[rows_[b]] = b;
  std::size_t earlier = first_of_row_[column];
  while (earlier != kNoColumn) {
    const std::size_t following = next_column_[earlier];
    const std::size_t here = next_block_[earlier]++;
    const Block transposed = blocks_[here].transpose();
    diagonal_[column].noalias() -= blocks_[here].lazyProduct(transposed);
    for (std::size_t b = here + 1; b < begin_[earlier + 1]; ++b) {
      blocks_[place_of_row_[rows_[b]]].noalias() -= blocks_[b].lazyProduct(transposed);
    }
    if (here + 1 < begin_[earlier + 1]) {
      next_column_[earlier] = first_of_row_[rows_[here + 1]];
      first_of_row_[rows_[here + 1]] = earlier;
    }
    earlier = following;
  }
}

bool BlockCholesky::factorize() {
  std::fill(first_of_row_.begin(), first_of_row_.end(), kNoColumn);
  for (std::size_t column = 0; column < position_.size(); ++column) {
    eliminate_column(column);
    const Eigen::LLT<Block> factor(diagonal_[column]);
    if (factor.info() != Eigen::Success || !diagonal_[column].allFinite()) return false;
    diagonal_[column] = factor.matrixL().solve(Block::Identity());
    const Block transposed = diagonal_[column].transpose();
    for (std::size_t b = begin_[column]; b < begin_[column + 1]; ++b) {
      blocks_[b] = (blocks_[b].lazyProduct(transposed)).eval();
    }
    if (begin_[column] == begin_[column + 1]) continue;
    next_block_[column] = begin_[column];
    const std::size_t row = rows_[begin_[column]];
    next_column_[column] = first_of_row_[row];
    first_of_row_[row] = column;
  }
  return true;
}

void BlockCholesky::solve(std::vector<Vector>& right) const {
  const std::size_t size = position_.size();
  std::vector<Vector> x(size);
  for (std::size_t i = 0; i < size; ++i) x[position_[i]] = right[i];
  for (std::size_t column = 0; column < size; ++column) {
    x[column] = (diagonal_[column] * x[column]).eval();
    for (std::size_t b = begin_[column]; b < begin_[column + 1]; ++b) {
      x[rows_[b]].noalias() -= blocks_[b] * x[column];
    }
  }
  for (std::size_t column = size; column-- > 0;) {
    for (std::size_t b = begin_[column]; b < begin_[column + 1]; ++b) {
      x[column].noalias() -= blocks_[b].transpose() * x[rows_[b]];
    }
    x[column] = (diagonal_[column].transpose() * x[column]).eval();
  }
  for (std::size_t i = 0; i < size; ++i) right[i] = x[position_[i]];
}

std::vector<BlockCholesky::Block> BlockCholesky::inverse_diagonal() const {
  const std::size_t size = position_.size();
  // Of the inverse: blocks on the diagonal, and below it where the factor has any.
  std::vector<Block> on(size);
  std::vector<Block> below(blocks_.size());
  const auto inverse_at = [&](std::size_t row, std::size_t column) -> Block {
    if (row == column) return on[row];
    const auto [low, high] = std::minmax(row, column);
    const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low]);
    const auto last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[low + 1]);
    const Block& block =
        below[static_cast<std::size_t>(std::lower_bound(first, last, high) - rows_.begin())];
    return row > column ? block : Block(block.transpose());
  };
  std::vector<Block> scaled;
  for (std::size_t column = size; column-- > 0;) {
    const std::size_t begin = begin_[column];
    const std::size_t end = begin_[column + 1];
    scaled.clear();
    for (std::size_t b = begin; b < end; ++b) {
      scaled.push_back(blocks_[b].lazyProduct(diagonal_[column]));
    }
    for (std::size_t a = begin; a < end; ++a) {
      below[a].setZero();
      for (std::size_t b = begin; b < end; ++b) {
        below[a] -= inverse_at(rows_[a], rows_[b]).lazyProduct(scaled[b - begin]);
      }
    }
    on[column] = diagonal_[column].transpose().lazyProduct(diagonal_[column]);
    for (std::size_t b = begin; b < end; ++b) {
      on[column] -= scaled[b - begin].transpose().lazyProduct(below[b]);
    }
  }
  std::vector<Block> inverse(size);
  for (std::size_t i = 0; i < size; ++i) inverse[i] = on[position_[i]];
  return inverse;
}

}  // namespace unimapper::merge
