// Maximum clique of an undirected graph.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace unimapper::merge {

/// An undirected graph as rows of bits.
class AdjacencyMatrix {
 public:
  explicit AdjacencyMatrix(std::size_t size)
      : size_(size), words_((size + 63) / 64), bits_(size * words_, 0) {}

  void connect(std::size_t a, std::size_t b) {
    set(a, b);
    set(b, a);
  }
  [[nodiscard]] bool connected(std::size_t a, std::size_t b) const {
    return ((bits_[a * words_ + b / 64] >> (b % 64)) & 1U) != 0;
  }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void set(std::size_t a, std::size_t b) {
    bits_[a * words_ + b / 64] |= std::uint64_t{1} << (b % 64);
  }

  std::size_t size_;
  std::size_t words_;
  std::vector<std::uint64_t> bits_;
};

/// The largest clique among `candidates`, ascending; of equal ones the first found, which
/// depends only on the graph. Branch and bound with colouring; after `max_steps` branchings the
/// best so far is returned, which is at least the greedy answer.
std::vector<std::size_t> max_clique(const AdjacencyMatrix& graph,
                                    std::vector<std::size_t> candidates,
                                    std::size_t max_steps = 200000);

}  // namespace unimapper::merge
