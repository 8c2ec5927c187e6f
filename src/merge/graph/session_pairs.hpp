// Pairs of sessions: their loops, the consistency set of these, and what positions say of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <tuple>
#include <vector>

#include "alignment_problem.hpp"
#include "session_site.hpp"
#include "src/merge/loops/loop_acceptance.hpp"

namespace unimapper::merge {

/// The loops of two sessions, the lower index as match, and their consistency set.
struct SessionPair {
  std::size_t query = 0;
  std::size_t match = 0;
  std::vector<std::size_t> loops;  ///< indices into the problem's loops
  ConsistencySet set;              ///< inliers are positions in `loops`
  bool open = false;               ///< confirmed by its loops, not yet joined or rolled back
  bool linked = false;             ///< by a person
  bool is_checked = false;         ///< the sensor data have been asked
  std::vector<double> off_site_m;  ///< of loops that positions contradict: how far they are off
  ExcludedBeyond beyond;           ///< what positions exclude

  /// Order in which pairs connect sessions: by distinct loops up to as many as are plenty, then the
  /// session that was added earlier, then by all distinct loops. So a session that is added later
  /// takes no place of pairs that have plenty, and these need no check anew.
  [[nodiscard]] auto strength() const {
    // With so many distinct loops a pair is as good as one with more: no rule of acceptance asks
    // for half of them.
    constexpr std::size_t kPlenty = 10;
    return std::make_tuple(std::min(set.distinct, kPlenty), -static_cast<std::ptrdiff_t>(query),
                           set.distinct);
  }

  /// Positions in `loops` as indices into the problem's loops.
  [[nodiscard]] std::vector<std::size_t> at(const std::vector<std::size_t>& positions) const {
    std::vector<std::size_t> indices;
    indices.reserve(positions.size());
    for (const std::size_t i : positions) indices.push_back(loops[i]);
    return indices;
  }
  /// The inliers as indices into the problem's loops.
  [[nodiscard]] std::vector<std::size_t> inliers() const { return at(set.inliers); }
};

/// All pairs by the problem's loops and paths; its decisions say of each loop of a pair why it is
/// not accepted so far.
std::vector<SessionPair> form_pairs(AlignmentProblem& problem);

/// No loop of the pair is accepted, for this reason.
void reject(AlignmentProblem& problem, const SessionPair& pair, const std::string& reason);

}  // namespace unimapper::merge
