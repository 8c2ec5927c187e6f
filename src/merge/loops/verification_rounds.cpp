#include "verification_rounds.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace unimapper::merge {
namespace {

/// Of two keyframes that of the session which was added later, and the session of the other.
struct Ends {
  KeyframeId later;
  std::size_t earlier_session;
};

template <typename Loop>
Ends ends_of(const Loop& loop) {
  const auto [earlier, later] = std::minmax(loop.query, loop.match);
  return {later, earlier.session};
}

/// A keyframe's candidates in earlier sessions.
struct Keyframe {
  /// By number of candidates of both sessions, most first, then by session: what was not tried yet.
  std::map<std::pair<std::int64_t, std::size_t>, std::vector<std::size_t>> untried;
  std::set<std::size_t> held_by;  ///< sessions with a verified loop
};

class Rounds {
 public:
  Rounds(std::span<const LoopCandidate> candidates, std::uint32_t enough) : enough_(enough) {
    std::map<std::pair<std::size_t, std::size_t>, std::int64_t> of_pair;
    for (const LoopCandidate& candidate : candidates) {
      const Ends ends = ends_of(candidate);
      --of_pair[{ends.later.session, ends.earlier_session}];
    }
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto [later, session] = ends_of(candidates[i]);
      keyframes_[later].untried[{of_pair[{later.session, session}], session}].push_back(i);
    }
  }

  /// Positions of the next candidates, ascending; none after the last round.
  std::vector<std::size_t> next() {
    std::vector<std::size_t> positions;
    for (auto& [id, keyframe] : keyframes_) {
      for (std::size_t held = keyframe.held_by.size(); held < enough_; ++held) {
        if (keyframe.untried.empty()) break;
        const auto first = keyframe.untried.begin();
        positions.insert(positions.end(), first->second.begin(), first->second.end());
        keyframe.untried.erase(first);
      }
    }
    std::sort(positions.begin(), positions.end());
    return positions;
  }

  void take(const LoopConstraint& verified) {
    if (!verified.decision.accepted) return;
    const Ends ends = ends_of(verified);
    keyframes_[ends.later].held_by.insert(ends.earlier_session);
  }

 private:
  std::size_t enough_;
  std::map<KeyframeId, Keyframe> keyframes_;
};

}  // namespace

std::vector<LoopConstraint> verify_in_rounds(std::span<const LoopCandidate> candidates,
                                             std::uint32_t enough, const Verification& verify) {
  Rounds rounds(candidates, enough);
  std::map<std::size_t, LoopConstraint> outcomes;
  for (;;) {
    const std::vector<std::size_t> positions = rounds.next();
    if (positions.empty()) break;
    std::vector<LoopCandidate> chosen;
    chosen.reserve(positions.size());
    for (const std::size_t i : positions) chosen.push_back(candidates[i]);
    std::vector<LoopConstraint> verified = verify(chosen);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      rounds.take(verified[i]);
      outcomes[positions[i]] = std::move(verified[i]);
    }
  }
  std::vector<LoopConstraint> loops;
  loops.reserve(outcomes.size());
  for (auto& [position, loop] : outcomes) loops.push_back(std::move(loop));
  return loops;
}

}  // namespace unimapper::merge
