#include "ports/spool/sequence_set.hpp"

#include <algorithm>
#include <iterator>

namespace unimapper::spool {

void SequenceSet::insert(wire::SequenceRange range) {
  if (range.begin >= range.end) return;
  auto run = runs_.upper_bound(range.begin);
  if (run != runs_.begin() && std::prev(run)->second >= range.begin) --run;
  while (run != runs_.end() && run->first <= range.end) {
    range.begin = std::min(range.begin, run->first);
    range.end = std::max(range.end, run->second);
    run = runs_.erase(run);
  }
  runs_.emplace(range.begin, range.end);
}

bool SequenceSet::contains(std::uint64_t sequence) const {
  const auto after = runs_.upper_bound(sequence);
  return after != runs_.begin() && std::prev(after)->second > sequence;
}

std::vector<wire::SequenceRange> SequenceSet::ranges() const {
  std::vector<wire::SequenceRange> all;
  all.reserve(runs_.size());
  for (const auto& [begin, end] : runs_) all.push_back({begin, end});
  return all;
}

std::uint64_t SequenceSet::count() const {
  std::uint64_t sum = 0;
  for (const auto& [begin, end] : runs_) sum += end - begin;
  return sum;
}

}  // namespace unimapper::spool
