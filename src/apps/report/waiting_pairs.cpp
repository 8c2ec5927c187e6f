// Provisional pairs of sessions, in words.
#include "src/apps/report/waiting_pairs.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

namespace unimapper::apps {
namespace {

using merge::LoopConstraint;
using merge::MergeResult;
using merge::PairOutcome;

/// A keyframe in its session's own frame.
Pose in_session(const MergeResult& result, KeyframeId id) {
  const merge::MergedSession& session = result.sessions[id.session];
  return session.T_map_session.inverse() * session.T_map_keyframe[id.keyframe];
}

/// The query session in the match session's frame, by one loop; the lower session is the match.
Pose placement_by(const LoopConstraint& loop, const MergeResult& result) {
  const Pose T_match_query = in_session(result, loop.match) * loop.T_match_query *
                             in_session(result, loop.query).inverse();
  return loop.match.session < loop.query.session ? T_match_query : T_match_query.inverse();
}

/// The loop of a pair whose own placement of the query keyframe is nearest to the pair's; null
/// where there is none.
const LoopConstraint* best_loop(const PairOutcome& pair, const MergeResult& result) {
  const LoopConstraint* best = nullptr;
  double least_m = std::numeric_limits<double>::infinity();
  for (const LoopConstraint& loop : result.loops) {
    const auto [low, high] = std::minmax(loop.query.session, loop.match.session);
    if (low != pair.match || high != pair.query || loop.decision.reason != pair.reason) continue;
    const KeyframeId of_query = loop.query.session == high ? loop.query : loop.match;
    const Eigen::Vector3d at = in_session(result, of_query).translation;
    const double off_m =
        (placement_by(loop, result) * at - pair.T_match_session_query_session * at).norm();
    if (off_m >= least_m) continue;
    least_m = off_m;
    best = &loop;
  }
  return best;
}

std::string keyframe_name(const std::vector<SessionData>& sessions, KeyframeId id) {
  const SessionData& session = sessions[id.session];
  return session.info.name + ':' + std::to_string(session.keyframes[id.keyframe].sequence);
}

}  // namespace

std::vector<WaitingPair> waiting_pairs(const std::vector<SessionData>& sessions,
                                       const MergeResult& result) {
  std::vector<WaitingPair> waiting;
  for (const PairOutcome& pair : result.pairs) {
    if (pair.state != merge::PairState::kProvisional) continue;
    const LoopConstraint* loop = best_loop(pair, result);
    if (loop == nullptr) continue;
    const bool is_swapped = loop->query.session < loop->match.session;
    const KeyframeId query = is_swapped ? loop->match : loop->query;
    const KeyframeId match = is_swapped ? loop->query : loop->match;
    const Pose between = in_session(result, match).inverse() * pair.T_match_session_query_session *
                         in_session(result, query);
    WaitingPair& one = waiting.emplace_back();
    one.match = pair.match;
    one.query = pair.query;
    one.query_keyframe = keyframe_name(sessions, query);
    one.match_keyframe = keyframe_name(sessions, match);
    char distance[32];
    std::snprintf(distance, sizeof distance, "%.1f m", between.translation.norm());
    one.sentence = sessions[pair.match].info.name + " and " + sessions[pair.query].info.name +
                   " wait: " + pair.reason + ". " + std::to_string(pair.distinct) +
                   (pair.distinct == 1 ? " loop places " : " loops place ") + one.query_keyframe +
                   ' ' + distance + " from " + one.match_keyframe + '.';
  }
  return waiting;
}

std::vector<std::string> deciding_commands(const WaitingPair& pair,
                                           const std::string& query_session,
                                           const std::string& store) {
  const std::string keyframes = pair.query_keyframe + ' ' + pair.match_keyframe;
  return {"unimapper map link --store " + store + ' ' + keyframes + "    # the same place",
          "unimapper map forbid --store " + store + ' ' + keyframes + "  # this loop is wrong",
          "unimapper map apart --store " + store + ' ' + query_session +
              "  # it belongs to no other session"};
}

std::string waiting_text(const std::vector<SessionData>& sessions, const MergeResult& result,
                         const std::string& store) {
  std::string text;
  for (const WaitingPair& pair : waiting_pairs(sessions, result)) {
    text += "unimapper: provisional: " + pair.sentence + " Look at both, and decide:\n";
    for (const std::string& command :
         deciding_commands(pair, sessions[pair.query].info.name, store)) {
      text += "  " + command + '\n';
    }
  }
  return text;
}

}  // namespace unimapper::apps
