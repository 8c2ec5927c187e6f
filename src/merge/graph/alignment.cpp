// Incremental joining of maps: intra-session optimisation, then pairs of sessions in batches.
#include "unimapper/merge/alignment.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "alignment_problem.hpp"
#include "drift_scale.hpp"
#include "session_pairs.hpp"
#include "site_frame.hpp"
#include "src/core/union_find.hpp"
#include "src/merge/loops/loop_acceptance.hpp"
#include "src/merge/loops/person_links.hpp"

namespace unimapper::merge {
namespace {

constexpr int kMaxDriftRounds = 8;
constexpr const char* kContradictsMap = "contradicts the maps merged before";

class SessionAligner {
 public:
  SessionAligner(AlignmentProblem& problem, const PlacementCheck& check)
      : problem_(problem), check_(check) {}

  void run() {
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) close_intra_session_loops(s);
    place_by_positions();
    pairs_ = form_pairs(problem_);
    for (int round = 0; round < kMaxDriftRounds && adapt_drift(); ++round)
      pairs_ = form_pairs(problem_);
    check_spanning_pairs();
    choose_central();
    fit_central_to_positions();
    join_pairs();
    solve_all_keyframes();
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

  /// Sessions that drift farther than assumed get the noise that the confirmed pairs say, for good:
  /// more loops agree then, and these say more. True if there is any, and pairs are formed anew.
  bool adapt_drift() {
    std::vector<LoopConstraint> confirmed;
    for (const SessionPair& pair : pairs_) {
      if (!pair.open) continue;
      const std::vector<LoopConstraint> loops = problem_.select(pair.inliers());
      confirmed.insert(confirmed.end(), loops.begin(), loops.end());
    }
    const std::vector<double> scales = drift_scales(confirmed, modelled_);
    bool any = false;
    for (std::size_t s = 0; s < scales.size(); ++s) {
      if (scales[s] <= problem_.drift_scale[s]) continue;
      problem_.set_drift(s, scales[s]);
      problem_.state.T_session_keyframe[s] = modelled_[s].poses();
      close_intra_session_loops(s);
      any = true;
    }
    if (any) place_by_positions();
    return any;
  }

  /// The accepted loops within a session.
  [[nodiscard]] std::vector<std::size_t> accepted_within(std::size_t session) const {
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      const LoopConstraint& loop = problem_.loops[i];
      const bool is_own = loop.is_intra_session() && loop.query.session == session;
      if (is_own && problem_.decisions[i].accepted) own.push_back(i);
    }
    return own;
  }

  /// Each session alone in the site frame; positions that its others contradict are not used.
  void place_by_positions() {
    problem_.rejected.clear();
    problem_.state.positions.clear();
    for (std::size_t s = 0; s < problem_.sessions.size(); ++s) {
      const auto& positions = problem_.sessions[s].positions;
      if (positions.empty()) continue;
      MapState placed;
      SessionPositions chosen =
          choose_positions(problem_.state, s, positions, problem_.select(accepted_within(s)),
                           problem_.config, placed);
      auto& rejected = problem_.rejected;
      rejected.insert(rejected.end(), chosen.rejected.begin(), chosen.rejected.end());
      if (!chosen.used.empty()) {
        problem_.sites[s].emplace(placed, s, chosen.used);
      }
      auto& in_use = problem_.state.positions;
      in_use.insert(in_use.end(), chosen.used.begin(), chosen.used.end());
    }
  }

  /// Refuses a pair whose loops are consistent, but whose maps do not fit.
  void refuse(SessionPair& pair, const std::string& reason) {
    pair.set.state = PairState::kRefused;
    pair.set.reason = reason;
    reject(problem_, pair, reason);
  }

  /// Asks the sensor data about the pairs of a maximum spanning tree: all that it takes to connect
  /// sessions. Pairs that close a cycle of sessions must agree with these anyway.
  void check_spanning_pairs() {
    std::vector<std::size_t> order(pairs_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return pairs_[a].strength() > pairs_[b].strength();
    });
    std::vector<std::size_t> parent(problem_.sessions.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto parent_of = [&](std::size_t s) -> std::size_t& { return parent[s]; };
    for (const std::size_t i : order) {
      SessionPair& pair = pairs_[i];
      const bool may_connect = pair.open || pair.set.is_short || !pair.set.competing_sets.empty();
      if (!may_connect || find_root(pair.query, parent_of) == find_root(pair.match, parent_of)) {
        continue;
      }
      if (is_confirmed_by_data(pair)) join_sets(pair.query, pair.match, parent_of);
    }
  }

  /// False: the pair is provisional from now on. A pair whose loops bear out several placements is
  /// confirmed if the sensor data exclude all but one; one whose loops span too short a path, if
  /// they bear it out.
  bool is_confirmed_by_data(SessionPair& pair) {
    if (pair.linked || pair.is_checked) return pair.open;
    pair.is_checked = true;
    const std::string why = reason_to_wait(pair.set, evidence_of(pair), problem_.config.acceptance);
    pair.open = why.empty();
    pair.set.state = pair.open ? PairState::kConfirmed : PairState::kProvisional;
    if (!pair.open && !pair.set.reason.empty()) pair.set.reason += "; ";
    pair.set.reason = pair.open ? "" : pair.set.reason + why;
    reject(problem_, pair, pair.open ? kOutsideConsistencySet : pair.set.reason);
    return pair.open;
  }

  [[nodiscard]] PlacementEvidence evidence_of(const SessionPair& pair) const {
    if (!check_) return {};
    const std::vector<LoopConstraint> loops = problem_.select(pair.inliers());
    std::vector<CompetingPlacement> competing;
    for (const ConsistencySet& set : pair.set.competing_sets) {
      competing.push_back(
          {problem_.select(pair.at(set.inliers)), set.T_match_session_query_session});
    }
    const auto& poses = problem_.state.T_session_keyframe;
    return check_({loops, poses[pair.query], poses[pair.match],
                   pair.set.T_match_session_query_session, pair.beyond, competing,
                   pair.set.is_short});
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

  /// As the others will be when they are joined to it.
  void fit_central_to_positions() {
    const std::size_t central = problem_.state.central;
    if (problem_.sessions.empty() || !problem_.sites[central]) return;
    std::vector<std::size_t> chosen = accepted_within(central);
    MapState trial = problem_.state;
    const std::size_t only[] = {central};
    if (!problem_.optimize_rejecting_outliers(trial, only, chosen)) return;
    if (problem_.all_plausible(trial, only)) problem_.state = std::move(trial);
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
        return std::make_pair(extends, pair.strength());
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

  /// Accepted loops among connected sessions.
  [[nodiscard]] std::vector<std::size_t> accepted_loops(const MapState& state) const {
    std::vector<std::size_t> accepted;
    for (std::size_t i = 0; i < problem_.loops.size(); ++i) {
      if (problem_.decisions[i].accepted && state.connects(problem_.loops[i]))
        accepted.push_back(i);
    }
    return accepted;
  }

  /// Optimises with the inliers of some pairs and all loops accepted before. Keeps the result, and
  /// returns null, if most loops of each pair survive and no map deforms implausibly; otherwise
  /// nothing is changed, and why is returned.
  const char* join(const std::vector<SessionPair*>& batch) {
    MapState trial = problem_.state;
    for (const SessionPair* pair : batch) connect(*pair, trial);
    const std::vector<std::size_t> sessions = trial.connected_sessions();
    std::vector<std::size_t> chosen = accepted_loops(trial);
    const std::vector<std::size_t> earlier = chosen;
    for (const SessionPair* pair : batch) {
      const std::vector<std::size_t> added = pair->inliers();
      chosen.insert(chosen.end(), added.begin(), added.end());
    }
    std::sort(chosen.begin(), chosen.end());
    const std::vector<std::size_t> before = chosen;
    if (!problem_.optimize_rejecting_outliers(trial, sessions, chosen, Variables::kLoopEnds)) {
      return kNoSolution;
    }
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
    if (loses_positions(trial, sessions)) return kContradictsPositions;
    if (!problem_.all_plausible(trial, sessions)) return kImplausibleDeformation;
    problem_.state = std::move(trial);
    decide(before, chosen);
    return nullptr;
  }

  /// Joins of many sessions move keyframes with loops alone; in the end all are solved together.
  void solve_all_keyframes() {
    const std::vector<std::size_t> sessions = problem_.state.connected_sessions();
    if (sessions.size() <= kFewSessions) return;
    MapState solved = problem_.state;
    const std::vector<std::size_t> before = accepted_loops(solved);
    std::vector<std::size_t> chosen = before;
    if (!problem_.optimize_rejecting_outliers(solved, sessions, chosen)) return;
    if (loses_positions(solved, sessions) || !problem_.all_plausible(solved, sessions)) return;
    problem_.state = std::move(solved);
    decide(before, chosen);
  }

  /// Of the loops that an optimisation began with those it ended with are accepted.
  void decide(const std::vector<std::size_t>& before, const std::vector<std::size_t>& chosen) {
    for (const std::size_t i : before) {
      const bool accepted = std::binary_search(chosen.begin(), chosen.end(), i);
      problem_.decisions[i] = {accepted, accepted ? "" : kDisagreesWithMap};
    }
  }

  /// Whether any session has lost half of its positions.
  [[nodiscard]] bool loses_positions(const MapState& trial,
                                     const std::vector<std::size_t>& sessions) const {
    return std::any_of(sessions.begin(), sessions.end(), [&](std::size_t s) {
      const std::size_t only[] = {s};
      const std::size_t before = positions_of(problem_.state, only).size();
      return before > 0 && 2 * positions_of(trial, only).size() <= before;
    });
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
      const std::size_t loops = pair.loops.size() + pair.off_site_m.size();
      if (loops == 0) continue;
      problem_.pairs.push_back({pair.match, pair.query, pair.set.state, pair.set.reason, loops,
                                pair.set.distinct, pair.set.competing,
                                pair.set.T_match_session_query_session});
    }
  }

  AlignmentProblem& problem_;
  const PlacementCheck& check_;
  std::vector<SessionPair> pairs_;
  const std::vector<SessionPath> modelled_ = problem_.state.odometry;  ///< with the noise assumed
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
