#include "session_pairs.hpp"

#include <map>
#include <utility>

#include "site_frame.hpp"
#include "src/merge/loops/person_links.hpp"

namespace unimapper::merge {
namespace {

class PairForming {
 public:
  explicit PairForming(AlignmentProblem& problem) : problem_(problem) {}

  std::vector<SessionPair> form() {
    std::vector<SessionPair> pairs;
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> loops;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      const LoopConstraint& loop = problem_.loops[i];
      if (!loop.is_intra_session()) loops[{loop.match.session, loop.query.session}].push_back(i);
    }
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) {
      paths_.push_back(problem_.state.odometry[s].with_poses(problem_.state.T_session_keyframe[s]));
    }
    for (std::size_t match = 0; match < problem_.sessions.size(); ++match) {
      for (std::size_t query = match + 1; query < problem_.sessions.size(); ++query) {
        SessionPair pair = form_pair(query, match, std::move(loops[{match, query}]));
        reject(problem_, pair, pair.open ? kOutsideConsistencySet : pair.set.reason);
        pairs.push_back(std::move(pair));
      }
    }
    return pairs;
  }

 private:
  [[nodiscard]] SessionPair form_pair(std::size_t query, std::size_t match,
                                      std::vector<std::size_t> of_pair) {
    SessionPair pair;
    pair.query = query;
    pair.match = match;
    pair.loops = std::move(of_pair);
    pair.linked = has_person_link(problem_.select(pair.loops));
    remove_contradicting(pair);
    pair.set = set_of(pair);
    complete_by_positions(pair);
    pair.open = pair.set.state == PairState::kConfirmed;
    return pair;
  }

  [[nodiscard]] ConsistencySet set_of(const SessionPair& pair) const {
    const std::vector<LoopConstraint> loops = problem_.select(pair.loops);
    const AcceptanceConfig rules =
        scaled_to_extent(problem_.config.acceptance, extent_m(pair.query, pair.match));
    const SessionPath& query = paths_[pair.query];
    const SessionPath& match = paths_[pair.match];
    return pair.linked ? linked_consistency(loops, query, match, rules)
                       : inter_session_consistency(loops, query, match, rules);
  }

  /// Visible extent of the session which sees farther, metres; 0 if either is unknown.
  [[nodiscard]] double extent_m(std::size_t a, std::size_t b) const {
    const auto [nearer, farther] =
        std::minmax(problem_.sessions[a].extent_m, problem_.sessions[b].extent_m);
    return nearer > 0.0 ? farther : 0.0;
  }

  /// Removes loops that contradict the positions of both sessions from those of the pair: whole
  /// sets that stand or fall with the loop of which positions know most, then single ones.
  void remove_contradicting(SessionPair& pair) {
    constexpr int kMaxSets = 4;
    const auto& query = problem_.sites[pair.query];
    const auto& match = problem_.sites[pair.match];
    if (!query || !match || pair.linked) return;
    for (int i = 0; i < kMaxSets; ++i) {
      pair.set = set_of(pair);
      const std::vector<std::size_t> inliers = pair.inliers();
      const auto off_m = set_contradiction_m(problem_.select(inliers), *query, *match);
      if (!off_m) break;
      for (const std::size_t loop : inliers) remove_loop(pair, loop, *off_m);
    }
    for (const std::size_t loop : std::vector(pair.loops)) {
      const SiteComparison found = compare_with_sites(problem_.loops[loop], *query, *match);
      if (found.chi2 > kPositionChi2) remove_loop(pair, loop, found.discrepancy_m.norm());
    }
  }

  void remove_loop(SessionPair& pair, std::size_t loop, double off_m) {
    std::erase(pair.loops, loop);
    problem_.decisions[loop] = {false, kContradictsPositions};
    pair.off_site_m.push_back(off_m);
  }

  /// What positions tell of a pair beyond its loops: where it is refused, that most of them
  /// contradict positions; where nothing but its place is uncertain, whether that is known.
  void complete_by_positions(SessionPair& pair) {
    const auto& query = problem_.sites[pair.query];
    const auto& match = problem_.sites[pair.match];
    ConsistencySet& set = pair.set;
    if (set.state == PairState::kRefused && pair.off_site_m.size() > pair.loops.size()) {
      set.reason = contradiction_text(pair.off_site_m, pair.off_site_m.size() + pair.loops.size());
    }
    if (!query || !match || set.state == PairState::kRefused) return;
    pair.beyond = excluded_beyond(problem_.select(pair.inliers()), *query, *match);
    const double near = AliasingConfig::kMinShiftM;
    if (!(pair.beyond.horizontal_m < near && pair.beyond.vertical_m < near)) return;
    set.is_one_place = false;
    if (!set.is_weak_along_axis) return;
    set.state = PairState::kConfirmed;
    set.reason.clear();
  }

  AlignmentProblem& problem_;
  std::vector<SessionPath> paths_;  ///< by session, with the poses of its own loops
};

}  // namespace

std::vector<SessionPair> form_pairs(AlignmentProblem& problem) {
  return PairForming(problem).form();
}

void reject(AlignmentProblem& problem, const SessionPair& pair, const std::string& reason) {
  for (const std::size_t i : pair.loops) problem.decisions[i] = {false, reason};
}

}  // namespace unimapper::merge
