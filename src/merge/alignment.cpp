#include "unimapper/merge/alignment.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "map_graph.hpp"

namespace unimapper::merge {
namespace {

constexpr int kMaxAudits = 4;

/// Loops of one pair of sessions, all with the lower index as match, and what the vote said.
struct MapPair {
  std::size_t query = 0;
  std::size_t match = 0;
  std::vector<std::size_t> loops;  ///< indices into the aligner's loops
  LoopVote vote;                   ///< inliers are positions in `loops`
  bool open = false;               ///< accepted by the vote, not yet joined or rolled back
};

class Aligner {
 public:
  Aligner(const std::vector<AlignmentSession>& sessions, std::span<const LoopConstraint> loops,
          const MergeConfig& config)
      : config_(config), sessions_(sessions) {
    std::vector<SessionPath> odometry;
    odometry.reserve(sessions.size());
    for (const auto& session : sessions) {
      odometry.emplace_back(session.T_odometry_keyframe, config.odometry);
    }
    state_ = make_map_state(std::move(odometry));
    for (const auto& loop : loops) {
      check(loop);
      loops_.push_back(loop.query.session < loop.match.session ? flipped(loop) : loop);
    }
    verdicts_.resize(loops_.size());
    reasons_.resize(sessions.size());
  }

  Alignment run() {
    for (std::size_t s = 0; s < sessions_.size(); ++s) close_own_loops(s);
    vote_on_pairs();
    choose_central();
    while (join_strongest_pair()) {
    }
    explain_unconnected();
    return result();
  }

  Alignment refine(const Alignment& start) {
    state_.central = start.central;
    state_.connected = start.connected;
    state_.T_map_session = start.T_map_session;
    state_.T_session_keyframe = start.T_session_keyframe;
    reasons_ = start.reason;
    std::copy(start.verdicts.begin(), start.verdicts.end(), verdicts_.begin());
    const auto sessions = connected_sessions();
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (!joins_connected(i)) continue;
      if (i >= start.verdicts.size() || verdicts_[i].accepted) chosen.push_back(i);
    }
    MapState refined = state_;
    solve_and_audit(refined, sessions, chosen);
    const bool recalled = recall(refined, chosen);
    if (recalled) solve_and_audit(refined, sessions, chosen);
    if (all_plausible(refined, sessions)) {
      state_ = std::move(refined);
      for (std::size_t i = start.verdicts.size(); i < loops_.size(); ++i) {
        verdicts_[i] = {false, "disagrees with the merged maps"};
      }
      for (const std::size_t i : chosen) verdicts_[i] = {true, {}};
    } else {
      for (std::size_t i = start.verdicts.size(); i < loops_.size(); ++i) {
        verdicts_[i] = {false, "the maps would bend more than odometry allows"};
      }
    }
    return result();
  }

 private:
  void check(const LoopConstraint& loop) const {
    for (const KeyframeRef k : {loop.query, loop.match}) {
      if (k.session >= sessions_.size() ||
          k.keyframe >= sessions_[k.session].T_odometry_keyframe.size()) {
        throw std::invalid_argument("loop between keyframes that do not exist");
      }
    }
    if (loop.query == loop.match) throw std::invalid_argument("loop of a keyframe to itself");
  }

  [[nodiscard]] std::vector<LoopConstraint> select(std::span<const std::size_t> indices) const {
    std::vector<LoopConstraint> chosen;
    for (const std::size_t i : indices) chosen.push_back(loops_[i]);
    return chosen;
  }

  [[nodiscard]] std::vector<std::size_t> connected_sessions() const {
    std::vector<std::size_t> sessions;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (state_.connected[s]) sessions.push_back(s);
    }
    return sessions;
  }

  [[nodiscard]] bool joins_connected(std::size_t i) const {
    return state_.connected[loops_[i].query.session] && state_.connected[loops_[i].match.session];
  }

  /// Solves with the chosen loops, drops those that contradict the result, and repeats until
  /// none does. False if the solver failed.
  bool solve_and_audit(MapState& state, std::span<const std::size_t> sessions,
                       std::vector<std::size_t>& chosen) const {
    for (int audit = 0; audit < kMaxAudits; ++audit) {
      if (!optimize_maps(state, sessions, select(chosen), config_.graph)) return false;
      const auto bad = [&](std::size_t i) {
        return loop_chi2(state, loops_[i]) > config_.acceptance.loop_chi2;
      };
      if (std::erase_if(chosen, bad) == 0) break;
    }
    return true;
  }

  /// Loops refused before that the solution agrees with after all.
  bool recall(const MapState& state, std::vector<std::size_t>& chosen) const {
    std::vector<std::size_t> returning;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (!joins_connected(i) || std::binary_search(chosen.begin(), chosen.end(), i)) continue;
      if (loop_chi2(state, loops_[i]) < 0.5 * config_.acceptance.loop_chi2) returning.push_back(i);
    }
    chosen.insert(chosen.end(), returning.begin(), returning.end());
    std::sort(chosen.begin(), chosen.end());
    return !returning.empty();
  }

  [[nodiscard]] bool all_plausible(const MapState& after,
                                   std::span<const std::size_t> sessions) const {
    return std::all_of(sessions.begin(), sessions.end(), [&](std::size_t s) {
      return deformation_is_plausible(state_, after, s, config_.graph);
    });
  }

  void close_own_loops(std::size_t session) {
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (loops_[i].query.session == session && loops_[i].match.session == session) {
        own.push_back(i);
        verdicts_[i] = {false, "disagrees with odometry or with the session's other loops"};
      }
    }
    if (own.empty()) return;
    const LoopVote vote = vote_session(select(own), state_.odometry[session], config_.acceptance);
    std::vector<std::size_t> chosen;
    for (const std::size_t i : vote.inliers) chosen.push_back(own[i]);
    if (chosen.empty()) return;
    MapState trial = state_;
    trial.central = session;
    const std::size_t only[] = {session};
    if (!solve_and_audit(trial, only, chosen)) return;
    if (!deformation_is_plausible(state_, trial, session, config_.graph)) return;
    state_.T_session_keyframe[session] = trial.T_session_keyframe[session];
    for (const std::size_t i : chosen) verdicts_[i] = {true, {}};
  }

  void vote_on_pairs() {
    for (std::size_t match = 0; match < sessions_.size(); ++match) {
      for (std::size_t query = match + 1; query < sessions_.size(); ++query) {
        MapPair pair;
        pair.query = query;
        pair.match = match;
        for (std::size_t i = 0; i < loops_.size(); ++i) {
          if (loops_[i].query.session == query && loops_[i].match.session == match) {
            pair.loops.push_back(i);
          }
        }
        pair.vote = vote_pair(select(pair.loops),
                              state_.odometry[query].with_poses(state_.T_session_keyframe[query]),
                              state_.odometry[match].with_poses(state_.T_session_keyframe[match]),
                              config_.acceptance);
        pair.open = pair.vote.accepted;
        refuse(pair, pair.open ? "outvoted by the pair's other loops" : pair.vote.reason);
        pairs_.push_back(std::move(pair));
      }
    }
  }

  void refuse(const MapPair& pair, const std::string& reason) {
    for (const std::size_t i : pair.loops) verdicts_[i] = {false, reason};
  }

  /// The best map of the largest group of maps that hang together.
  void choose_central() {
    std::vector<std::size_t> group(sessions_.size());
    std::iota(group.begin(), group.end(), std::size_t{0});
    for (const auto& pair : pairs_) {
      if (!pair.open) continue;
      const std::size_t from = group[pair.query];
      const std::size_t to = group[pair.match];
      std::replace(group.begin(), group.end(), from, to);
    }
    std::vector<std::size_t> keyframes(sessions_.size(), 0);
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      keyframes[group[s]] += sessions_[s].T_odometry_keyframe.size();
    }
    std::size_t best = 0;
    for (std::size_t s = 1; s < sessions_.size(); ++s) {
      const auto rank = [&](std::size_t i) {
        return std::make_pair(keyframes[group[i]], sessions_[i].central_score);
      };
      if (rank(s) > rank(best)) best = s;
    }
    state_.central = best;
    if (!sessions_.empty()) state_.connected[best] = !sessions_[best].T_odometry_keyframe.empty();
  }

  /// Joins the strongest open pair that touches what is connected; pairs that close a cycle of
  /// maps come last, when their two maps already have places to agree with. False: none left.
  bool join_strongest_pair() {
    MapPair* best = nullptr;
    const auto rank = [&](const MapPair& pair) {
      const bool reaches_out = state_.connected[pair.query] != state_.connected[pair.match];
      return std::make_pair(reaches_out, pair.vote.distinct);
    };
    for (auto& pair : pairs_) {
      if (!pair.open || (!state_.connected[pair.query] && !state_.connected[pair.match])) continue;
      if (best == nullptr || rank(pair) > rank(*best)) best = &pair;
    }
    if (best == nullptr) return false;
    best->open = false;
    join(*best);
    return true;
  }

  void join(const MapPair& pair) {
    MapState trial = state_;
    const Pose& T_match_query = pair.vote.T_match_session_query_session;
    if (!trial.connected[pair.query]) {
      trial.T_map_session[pair.query] = trial.T_map_session[pair.match] * T_match_query;
    } else if (!trial.connected[pair.match]) {
      trial.T_map_session[pair.match] = trial.T_map_session[pair.query] * T_match_query.inverse();
    }
    trial.connected[pair.query] = trial.connected[pair.match] = true;
    std::vector<std::size_t> sessions;
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (trial.connected[s]) sessions.push_back(s);
    }
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (verdicts_[i].accepted && trial.connected[loops_[i].query.session] &&
          trial.connected[loops_[i].match.session]) {
        chosen.push_back(i);
      }
    }
    const std::size_t earlier = chosen.size();
    for (const std::size_t i : pair.vote.inliers) chosen.push_back(pair.loops[i]);
    const std::size_t added = chosen.size() - earlier;
    std::sort(chosen.begin(), chosen.end());
    const std::vector<std::size_t> before = chosen;
    if (!solve_and_audit(trial, sessions, chosen)) {
      refuse(pair, "the pose graph found no solution");
      return;
    }
    const auto survives = [&](std::size_t i) {
      return std::binary_search(chosen.begin(), chosen.end(), i);
    };
    std::size_t survivors = 0;
    for (const std::size_t i : pair.vote.inliers) survivors += survives(pair.loops[i]) ? 1 : 0;
    const std::size_t earlier_survivors = chosen.size() - survivors;
    if (2 * survivors < added || survivors < config_.acceptance.min_strong_loops) {
      refuse(pair, "contradicts the maps merged before");
      return;
    }
    if (10 * earlier_survivors < 9 * earlier || !all_plausible(trial, sessions)) {
      refuse(pair, "the maps would bend more than odometry allows");
      return;
    }
    state_ = std::move(trial);
    for (const std::size_t i : before) {
      verdicts_[i].accepted = survives(i);
      verdicts_[i].reason = verdicts_[i].accepted ? "" : "disagrees with the merged maps";
    }
  }

  void explain_unconnected() {
    for (std::size_t s = 0; s < sessions_.size(); ++s) {
      if (state_.connected[s]) continue;
      if (sessions_[s].T_odometry_keyframe.empty()) {
        reasons_[s] = "no keyframes";
        continue;
      }
      // The pair that came closest says most.
      const MapPair* closest = nullptr;
      for (const auto& pair : pairs_) {
        if (pair.query != s && pair.match != s) continue;
        if (closest == nullptr || pair.vote.distinct > closest->vote.distinct) closest = &pair;
      }
      reasons_[s] = closest == nullptr        ? "no other session"
                    : !closest->vote.accepted ? closest->vote.reason
                    : closest->loops.empty()
                        ? "no loops found"
                        : verdicts_[closest->loops[closest->vote.inliers[0]]].reason;
    }
  }

  Alignment result() const {
    Alignment alignment;
    alignment.central = state_.central;
    alignment.connected = state_.connected;
    alignment.reason = reasons_;
    alignment.T_map_session = state_.T_map_session;
    alignment.T_session_keyframe = state_.T_session_keyframe;
    alignment.verdicts = verdicts_;
    return alignment;
  }

  const MergeConfig& config_;
  const std::vector<AlignmentSession>& sessions_;
  std::vector<LoopConstraint> loops_;
  std::vector<LoopVerdict> verdicts_;
  std::vector<std::string> reasons_;
  std::vector<MapPair> pairs_;
  MapState state_;
};

}  // namespace

Alignment align_sessions(const std::vector<AlignmentSession>& sessions,
                         std::span<const LoopConstraint> loops, const MergeConfig& config) {
  return Aligner(sessions, loops, config).run();
}

Alignment refine_alignment(const Alignment& start, const std::vector<AlignmentSession>& sessions,
                           std::span<const LoopConstraint> loops, const MergeConfig& config) {
  if (start.verdicts.size() > loops.size()) {
    throw std::invalid_argument("refinement needs all earlier loops");
  }
  return Aligner(sessions, loops, config).refine(start);
}

}  // namespace unimapper::merge
