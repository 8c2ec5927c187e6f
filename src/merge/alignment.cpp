// Incremental joining of maps: intra-session optimisation, then pairs of sessions in batches.
#include "unimapper/merge/alignment.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "alignment_problem.hpp"
#include "loop_acceptance.hpp"
#include "person_links.hpp"
#include "unimapper/core/union_find.hpp"

namespace unimapper::merge {
namespace {

constexpr const char* kContradictsMap = "contradicts the maps merged before";

/// The loops of two sessions, the lower index as match, and their consistency set.
struct SessionPair {
  std::size_t query = 0;
  std::size_t match = 0;
  std::vector<std::size_t> loops;  ///< indices into the problem's loops
  ConsistencySet set;              ///< inliers are positions in `loops`
  bool open = false;               ///< confirmed by its loops, not yet joined or rolled back
  bool linked = false;             ///< by a person
  bool is_checked = false;         ///< the sensor data have been asked

  /// The inliers as indices into the problem's loops.
  [[nodiscard]] std::vector<std::size_t> inliers() const {
    std::vector<std::size_t> indices;
    for (const std::size_t i : set.inliers) indices.push_back(loops[i]);
    return indices;
  }
};

class SessionAligner {
 public:
  SessionAligner(AlignmentProblem& problem, const PlacementCheck& check)
      : problem_(problem), check_(check) {}

  void run() {
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) close_intra_session_loops(s);
    form_pairs();
    check_spanning_pairs();
    choose_central();
    join_pairs();
    explain_unconnected();
    record_pairs();
  }

 private:
  void close_intra_session_loops(std::size_t session) {
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      const LoopConstraint& loop = problem_.loops[i];
      if (loop.query.session != session || loop.match.session != session) continue;
      own.push_back(i);
      problem_.decisions[i] = {false, "disagrees with odometry or with the session's other loops"};
    }
    if (own.empty()) return;
    IntraSessionLoops found = intra_session_consistency(
        problem_.select(own), problem_.state.odometry[session],
        scaled_to_extent(problem_.config.acceptance, problem_.sessions[session].extent_m));
    for (const std::size_t i : found.waiting) problem_.decisions[own[i]] = {false, kWaits};
    choose_person_links(problem_.select(own), found.accepted);
    std::vector<std::size_t> chosen;
    for (const std::size_t i : found.accepted) chosen.push_back(own[i]);
    if (chosen.empty()) return;
    MapState trial = problem_.state;
    trial.central = session;
    const std::size_t only[] = {session};
    if (!problem_.optimize_rejecting_outliers(trial, only, chosen)) return;
    if (!problem_.all_plausible(trial, only)) return;
    problem_.state.T_session_keyframe[session] = trial.T_session_keyframe[session];
    for (const std::size_t i : chosen) problem_.decisions[i] = {true, {}};
  }

  void form_pairs() {
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> loops;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      const LoopConstraint& loop = problem_.loops[i];
      if (!loop.is_intra_session()) loops[{loop.match.session, loop.query.session}].push_back(i);
    }
    std::vector<SessionPath> paths;
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) {
      paths.push_back(problem_.state.odometry[s].with_poses(problem_.state.T_session_keyframe[s]));
    }
    for (std::size_t match = 0; match < problem_.sessions.size(); ++match) {
      for (std::size_t query = match + 1; query < problem_.sessions.size(); ++query) {
        SessionPair pair = form_pair(query, match, std::move(loops[{match, query}]), paths);
        reject(pair, pair.open ? kOutsideConsistencySet : pair.set.reason);
        pairs_.push_back(std::move(pair));
      }
    }
  }

  [[nodiscard]] SessionPair form_pair(std::size_t query, std::size_t match,
                                      std::vector<std::size_t> of_pair,
                                      const std::vector<SessionPath>& paths) const {
    SessionPair pair;
    pair.query = query;
    pair.match = match;
    pair.loops = std::move(of_pair);
    const std::vector<LoopConstraint> loops = problem_.select(pair.loops);
    const AcceptanceConfig rules =
        scaled_to_extent(problem_.config.acceptance, extent_m(query, match));
    pair.linked = has_person_link(loops);
    pair.set = pair.linked ? linked_consistency(loops, paths[query], paths[match], rules)
                           : inter_session_consistency(loops, paths[query], paths[match], rules);
    pair.open = pair.set.state == PairState::kConfirmed;
    return pair;
  }

  /// That of the session which sees farther; 0 if either is unknown.
  [[nodiscard]] double extent_m(std::size_t a, std::size_t b) const {
    const auto [nearer, farther] =
        std::minmax(problem_.sessions[a].extent_m, problem_.sessions[b].extent_m);
    return nearer > 0.0 ? farther : 0.0;
  }

  void reject(const SessionPair& pair, const std::string& reason) {
    for (const std::size_t i : pair.loops) problem_.decisions[i] = {false, reason};
  }

  /// Its loops are consistent, the maps do not fit.
  void refuse(SessionPair& pair, const std::string& reason) {
    pair.set.state = PairState::kRefused;
    pair.set.reason = reason;
    reject(pair, reason);
  }

  /// Asks the sensor data about the pairs of a maximum spanning tree: all that it takes to connect
  /// sessions. Pairs that close a cycle of sessions must agree with these anyway.
  void check_spanning_pairs() {
    std::vector<std::size_t> order(pairs_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return pairs_[a].set.distinct > pairs_[b].set.distinct;
    });
    std::vector<std::size_t> parent(problem_.sessions.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto parent_of = [&](std::size_t s) -> std::size_t& { return parent[s]; };
    for (const std::size_t i : order) {
      SessionPair& pair = pairs_[i];
      if (!pair.open || find_root(pair.query, parent_of) == find_root(pair.match, parent_of)) {
        continue;
      }
      if (is_confirmed_by_data(pair)) join_sets(pair.query, pair.match, parent_of);
    }
  }

  /// False: the pair is provisional from now on.
  bool is_confirmed_by_data(SessionPair& pair) {
    if (pair.linked || pair.is_checked) return pair.open;
    pair.is_checked = true;
    pair.set.reason = reason_to_wait(pair.set, evidence_of(pair), problem_.config.acceptance);
    if (pair.set.reason.empty()) return true;
    pair.open = false;
    pair.set.state = PairState::kProvisional;
    reject(pair, pair.set.reason);
    return false;
  }

  [[nodiscard]] PlacementEvidence evidence_of(const SessionPair& pair) const {
    if (!check_) return {};
    const std::vector<LoopConstraint> loops = problem_.select(pair.inliers());
    const auto& poses = problem_.state.T_session_keyframe;
    return check_(
        {loops, poses[pair.query], poses[pair.match], pair.set.T_match_session_query_session});
  }

  /// The session with the best score in the largest group of connected sessions.
  void choose_central() {
    const auto& sessions = problem_.sessions;
    std::vector<std::size_t> parent(sessions.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto parent_of = [&](std::size_t s) -> std::size_t& { return parent[s]; };
    for (const auto& pair : pairs_) {
      if (pair.open) join_sets(pair.query, pair.match, parent_of);
    }
    std::vector<std::size_t> keyframes(sessions.size(), 0);
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      keyframes[find_root(s, parent_of)] += sessions[s].T_odometry_keyframe.size();
    }
    std::size_t best = 0;
    for (std::size_t s = 1; s < sessions.size(); ++s) {
      const auto rank = [&](std::size_t i) {
        return std::make_tuple(sessions[i].central_priority, keyframes[find_root(i, parent_of)],
                               sessions[i].central_score);
      };
      if (rank(s) > rank(best)) best = s;
    }
    problem_.state.central = best;
    if (sessions.empty()) return;
    problem_.state.connected[best] = !sessions[best].T_odometry_keyframe.empty();
  }

  /// Joins pairs in batches, each half as large as all that were joined before: a solve takes as
  /// long as everything that is connected is large, so the number of solves decides, and the first
  /// pairs, on which all others rest, are joined one by one. A batch that does not hold as a whole
  /// is halved; a pair is refused only alone.
  void join_pairs() {
    std::size_t joined = 0;
    std::size_t most = 1;
    for (;;) {
      const std::vector<SessionPair*> batch = next_pairs(most);
      if (batch.empty()) return;
      const char* failure = join(batch);
      for (SessionPair* pair : batch) {
        if (failure == nullptr || batch.size() == 1) pair->open = false;
      }
      if (failure != nullptr) {
        if (batch.size() == 1) refuse(*batch.front(), failure);
        most = std::max<std::size_t>(1, batch.size() / 2);
        continue;
      }
      joined += batch.size();
      most = std::max<std::size_t>(1, std::min(2 * most, joined / 2));
    }
  }

  /// The pairs to join next, one after the other: each is the strongest open one that touches what
  /// is connected by then; pairs that close a cycle of sessions come last, when both are connected
  /// already.
  std::vector<SessionPair*> next_pairs(std::size_t most) {
    std::vector<bool> connected = problem_.state.connected;
    std::vector<SessionPair*> next;
    while (next.size() < most) {
      SessionPair* best = nullptr;
      const auto rank = [&](const SessionPair& pair) {
        const bool extends = connected[pair.query] != connected[pair.match];
        return std::make_pair(extends, pair.set.distinct);
      };
      for (auto& pair : pairs_) {
        if (!pair.open || (!connected[pair.query] && !connected[pair.match])) continue;
        if (std::find(next.begin(), next.end(), &pair) != next.end()) continue;
        if (best == nullptr || rank(pair) > rank(*best)) best = &pair;
      }
      if (best == nullptr) break;
      const bool extends = connected[best->query] != connected[best->match];
      if (extends && !is_confirmed_by_data(*best)) continue;
      connected[best->query] = connected[best->match] = true;
      next.push_back(best);
    }
    return next;
  }

  /// Connects both sessions of a pair: an initial guess for the new one's anchor.
  static void connect(const SessionPair& pair, MapState& trial) {
    const Pose& T_match_query = pair.set.T_match_session_query_session;
    if (!trial.connected[pair.query]) {
      trial.T_map_session[pair.query] = trial.T_map_session[pair.match] * T_match_query;
    } else if (!trial.connected[pair.match]) {
      trial.T_map_session[pair.match] = trial.T_map_session[pair.query] * T_match_query.inverse();
    }
    trial.connected[pair.query] = trial.connected[pair.match] = true;
  }

  /// Optimises with the inliers of some pairs and all loops accepted before. Keeps the result, and
  /// returns null, if most loops of each pair survive and no map deforms implausibly; otherwise
  /// nothing is changed, and why is returned.
  const char* join(const std::vector<SessionPair*>& batch) {
    MapState trial = problem_.state;
    for (const SessionPair* pair : batch) connect(*pair, trial);
    const std::vector<std::size_t> sessions = trial.connected_sessions();
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      if (problem_.decisions[i].accepted && trial.connects(problem_.loops[i])) chosen.push_back(i);
    }
    const std::vector<std::size_t> earlier = chosen;
    for (const SessionPair* pair : batch) {
      const std::vector<std::size_t> added = pair->inliers();
      chosen.insert(chosen.end(), added.begin(), added.end());
    }
    std::sort(chosen.begin(), chosen.end());
    const std::vector<std::size_t> before = chosen;
    if (!problem_.optimize_rejecting_outliers(trial, sessions, chosen)) return kNoSolution;
    const auto survives = [&](std::size_t i) {
      return std::binary_search(chosen.begin(), chosen.end(), i);
    };
    const auto survivors = [&](const std::vector<std::size_t>& loops) {
      return static_cast<std::size_t>(std::count_if(loops.begin(), loops.end(), survives));
    };
    // As if one pair came after the other: each counts among the earlier ones of the next, with all
    // of its loops, for one that is lost may be lost to the next.
    std::size_t count = earlier.size();
    std::size_t count_left = survivors(earlier);
    for (const SessionPair* pair : batch) {
      const std::vector<std::size_t> added = pair->inliers();
      const std::size_t left = survivors(added);
      const std::size_t fewest = pair->linked ? 1 : problem_.config.acceptance.min_strong_loops;
      if (2 * left < added.size() || left < fewest) return kContradictsMap;
      if (10 * count_left < 9 * count) return kImplausibleDeformation;
      count += added.size();
      count_left += left;
    }
    if (!problem_.all_plausible(trial, sessions)) return kImplausibleDeformation;
    problem_.state = std::move(trial);
    for (const std::size_t i : before) {
      const bool accepted = survives(i);
      problem_.decisions[i] = {accepted, accepted ? "" : kDisagreesWithMap};
    }
    return nullptr;
  }

  void explain_unconnected() {
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) {
      if (problem_.state.connected[s]) continue;
      problem_.reasons[s] = problem_.sessions[s].T_odometry_keyframe.empty()
                                ? "no keyframes"
                                : reason_of_pair(strongest_pair_of(s));
    }
  }

  /// A provisional pair says more than one that is refused.
  [[nodiscard]] const SessionPair* strongest_pair_of(std::size_t session) const {
    const SessionPair* strongest = nullptr;
    const auto rank = [](const SessionPair& pair) {
      return std::make_pair(pair.set.state, pair.set.distinct);
    };
    for (const auto& pair : pairs_) {
      if (pair.query != session && pair.match != session) continue;
      if (strongest == nullptr || rank(pair) > rank(*strongest)) strongest = &pair;
    }
    return strongest;
  }

  [[nodiscard]] static std::string reason_of_pair(const SessionPair* pair) {
    return pair == nullptr ? "no other session" : pair->set.reason;
  }

  /// Pairs without any verified loop are left out: there is nothing to say about them.
  void record_pairs() {
    for (const SessionPair& pair : pairs_) {
      if (pair.loops.empty()) continue;
      problem_.pairs.push_back({pair.match, pair.query, pair.set.state, pair.set.reason,
                                pair.loops.size(), pair.set.distinct, pair.set.competing,
                                pair.set.T_match_session_query_session});
    }
  }

  AlignmentProblem& problem_;
  const PlacementCheck& check_;
  std::vector<SessionPair> pairs_;
};

}  // namespace

Alignment align_sessions(const std::vector<AlignmentSession>& sessions,
                         std::span<const LoopConstraint> loops, const MergeConfig& config,
                         const PlacementCheck& check) {
  AlignmentProblem problem(sessions, loops, config);
  SessionAligner(problem, check).run();
  return problem.result();
}

}  // namespace unimapper::merge
