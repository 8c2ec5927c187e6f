// Set of sequence numbers as runs.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "unimapper/wire/delivery.hpp"

namespace unimapper::spool {

/// Sequence numbers, small in memory where they follow each other.
class SequenceSet {
 public:
  /// Adds all numbers of a run.
  void insert(wire::SequenceRange range);
  /// Whether the number is there. O(log runs).
  [[nodiscard]] bool contains(std::uint64_t sequence) const;
  /// The runs, ascending, none touching the next.
  [[nodiscard]] std::vector<wire::SequenceRange> ranges() const;
  /// How many numbers there are. O(runs).
  [[nodiscard]] std::uint64_t count() const;
  /// Whether there is none.
  [[nodiscard]] bool empty() const { return runs_.empty(); }

 private:
  std::map<std::uint64_t, std::uint64_t> runs_;  ///< begin to end
};

}  // namespace unimapper::spool
