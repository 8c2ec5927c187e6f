// Maximum clique by branch and bound with colouring (Tomita and Seki 2003).
#include "max_clique.hpp"

#include <algorithm>

namespace unimapper::merge {
namespace {

class Search {
 public:
  Search(const AdjacencyMatrix& graph, std::size_t max_steps)
      : graph_(graph), steps_left_(max_steps) {}

  std::vector<std::size_t> run(std::vector<std::size_t> candidates) {
    // Best connected first, so that the greedy first descent is already good.
    std::vector<std::size_t> degree(graph_.size(), 0);
    for (const std::size_t a : candidates) {
      for (const std::size_t b : candidates) degree[a] += graph_.connected(a, b) ? 1 : 0;
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](std::size_t a, std::size_t b) { return degree[a] > degree[b]; });
    expand(candidates);
    std::sort(best_.begin(), best_.end());
    return best_;
  }

 private:
  void expand(const std::vector<std::size_t>& candidates) {
    std::vector<std::size_t> order;
    std::vector<std::size_t> bound;
    colour(candidates, order, bound);
    for (std::size_t i = order.size(); i-- > 0;) {
      if (current_.size() + bound[i] <= best_.size() || steps_left_ == 0) return;
      --steps_left_;
      current_.push_back(order[i]);
      std::vector<std::size_t> next;
      for (std::size_t j = 0; j < i; ++j) {
        if (graph_.connected(order[i], order[j])) next.push_back(order[j]);
      }
      if (next.empty()) {
        if (current_.size() > best_.size()) best_ = current_;
      } else {
        expand(next);
      }
      current_.pop_back();
    }
  }

  /// Splits into classes without edges inside; a clique holds at most one item of each.
  void colour(const std::vector<std::size_t>& candidates, std::vector<std::size_t>& order,
              std::vector<std::size_t>& bound) const {
    std::vector<std::vector<std::size_t>> classes;
    for (const std::size_t item : candidates) {
      const auto fits = [&](const std::vector<std::size_t>& group) {
        return std::none_of(group.begin(), group.end(),
                            [&](std::size_t other) { return graph_.connected(item, other); });
      };
      const auto found = std::find_if(classes.begin(), classes.end(), fits);
      if (found != classes.end()) {
        found->push_back(item);
      } else {
        classes.push_back({item});
      }
    }
    for (std::size_t c = 0; c < classes.size(); ++c) {
      for (const std::size_t item : classes[c]) {
        order.push_back(item);
        bound.push_back(c + 1);
      }
    }
  }

  const AdjacencyMatrix& graph_;
  std::size_t steps_left_;
  std::vector<std::size_t> current_;
  std::vector<std::size_t> best_;
};

}  // namespace

std::vector<std::size_t> max_clique(const AdjacencyMatrix& graph,
                                    std::vector<std::size_t> candidates, std::size_t max_steps) {
  return Search(graph, max_steps).run(std::move(candidates));
}

}  // namespace unimapper::merge
