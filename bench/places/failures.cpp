#include "bench/places/failures.hpp"

#include <algorithm>

namespace unimapper::bench {
namespace {

/// Null if nothing is wrong.
const char* failure_cause(const TopCandidate& top) {
  if (is_false_loop(top)) {
    return top.view ? "accepted, but wrong" : "accepted, without a true match";
  }
  if (!top.view || (top.accepted && top.right)) return nullptr;
  if (!top.answered) return "no candidate";
  return top.right ? "right, but not accepted" : "another place has a higher confidence";
}

bool is_worse(const TopCandidate& a, const TopCandidate& b) {
  if (is_false_loop(a) != is_false_loop(b)) return is_false_loop(a);
  return is_false_loop(a) ? a.confidence > b.confidence : a.best_view > b.best_view;
}

}  // namespace

bool is_false_loop(const TopCandidate& top) { return top.accepted && !top.right; }

std::vector<Failure> failures_of(const std::vector<PairRow>& rows) {
  std::vector<Failure> failures;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const TopCandidate& top : rows[i].top) {
      const char* why = failure_cause(top);
      if (why != nullptr) failures.push_back({i, &top, why});
    }
  }
  std::stable_sort(failures.begin(), failures.end(),
                   [](const Failure& a, const Failure& b) { return is_worse(*a.top, *b.top); });
  return failures;
}

}  // namespace unimapper::bench
