// Provisional pairs of sessions, in words.
#include "src/apps/report/waiting_pairs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

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

/// How far apart two placements put a keyframe that are one placement, metres: as far as a
/// candidate of a loop may be moved by registration.
constexpr double kSamePlacementM = 4.0;

/// A loop of a pair, and where it puts the query session in the match session.
struct PlacingLoop {
  KeyframeId match;  ///< of the pair's match session
  KeyframeId query;
  Pose T_match_query;  ///< of the sessions
  Eigen::Vector3d at;  ///< the query keyframe in its session

  [[nodiscard]] double distance_m(const Pose& other) const {
    return (T_match_query * at - other * at).norm();
  }
};

/// The loops of a pair that waits.
std::vector<PlacingLoop> placing_loops(const PairOutcome& pair, const MergeResult& result) {
  std::vector<PlacingLoop> loops;
  for (const LoopConstraint& loop : result.loops) {
    const auto [low, high] = std::minmax(loop.query, loop.match);
    if (low.session != pair.match || high.session != pair.query) continue;
    if (loop.decision.reason != pair.reason) continue;
    loops.push_back({low, high, placement_by(loop, result), in_session(result, high).translation});
  }
  return loops;
}

/// The one that agrees best with the pair's placement; null where there is none.
const PlacingLoop* best_loop(const std::vector<PlacingLoop>& loops, const PairOutcome& pair) {
  const auto best = std::min_element(loops.begin(), loops.end(), [&](const auto& a, const auto& b) {
    return a.distance_m(pair.T_match_session_query_session) <
           b.distance_m(pair.T_match_session_query_session);
  });
  return best == loops.end() ? nullptr : &*best;
}

/// Another placement: of the loops that contradict the pair's, the one that most of them agree
/// with. Null where no two agree.
const PlacingLoop* other_placement(std::vector<PlacingLoop>& loops, const PairOutcome& pair) {
  std::erase_if(loops, [&](const PlacingLoop& loop) {
    return loop.distance_m(pair.T_match_session_query_session) <= kSamePlacementM;
  });
  const PlacingLoop* other = nullptr;
  std::ptrdiff_t most = 1;
  for (const PlacingLoop& loop : loops) {
    const auto agreeing = std::count_if(loops.begin(), loops.end(), [&](const PlacingLoop& one) {
      return loop.distance_m(one.T_match_query) <= kSamePlacementM;
    });
    if (agreeing > most) other = &loop;
    most = std::max(most, agreeing);
  }
  return other;
}

/// A shorter way of the map beyond the loops shows nothing new, metres.
constexpr double kWorthDrivingM = 10.0;

/// Length of a session's way between two of its keyframes, metres.
double way_m(const MergeResult& result, std::size_t session, std::size_t first, std::size_t last) {
  const auto at = [&](std::size_t k) { return in_session(result, {session, k}).translation; };
  double length = 0.0;
  for (std::size_t k = first; k < last; ++k) length += (at(k + 1) - at(k)).norm();
  return length;
}

std::string keyframe_name(const std::vector<SessionData>& sessions, KeyframeId id) {
  const SessionData& session = sessions[id.session];
  return session.info.name + ':' + std::to_string(session.keyframes[id.keyframe].sequence);
}

std::string metres(double distance, int decimals) {
  return fmt::format("{:.{}f} m", distance, decimals);
}

/// Which scans may decide: what the map saw beyond the loops of the placement is no part of any
/// of them yet.
std::string deciding_scans(const std::vector<PlacingLoop>& loops, const PairOutcome& pair,
                           const std::vector<SessionData>& sessions, const MergeResult& result) {
  std::size_t first = sessions[pair.match].keyframes.size();
  std::size_t last = 0;
  for (const PlacingLoop& loop : loops) {
    if (loop.distance_m(pair.T_match_session_query_session) > kSamePlacementM) continue;
    first = std::min<std::size_t>(first, loop.match.keyframe);
    last = std::max<std::size_t>(last, loop.match.keyframe);
  }
  if (first > last) return {};
  const std::size_t end = sessions[pair.match].keyframes.size() - 1;
  const double before_m = way_m(result, pair.match, 0, first);
  const double after_m = way_m(result, pair.match, last, end);
  const std::string& query = sessions[pair.query].info.name;
  if (std::max(before_m, after_m) < kWorthDrivingM) {
    return " Scans of both beyond what they share may decide.";
  }
  const bool goes_on = after_m >= before_m;
  return " Scans of " + query + " farther along the way of " + sessions[pair.match].info.name +
         " may decide: from " + keyframe_name(sessions, {pair.match, goes_on ? last : first}) +
         " towards " + keyframe_name(sessions, {pair.match, goes_on ? end : 0}) + ", " +
         metres(std::max(before_m, after_m), 0) + " of way.";
}

}  // namespace

std::vector<WaitingPair> waiting_pairs(const std::vector<SessionData>& sessions,
                                       const MergeResult& result) {
  std::vector<WaitingPair> waiting;
  for (const PairOutcome& pair : result.pairs) {
    if (pair.state != merge::PairState::kProvisional) continue;
    std::vector<PlacingLoop> loops = placing_loops(pair, result);
    const PlacingLoop* best = best_loop(loops, pair);
    if (best == nullptr) continue;
    const Pose between = in_session(result, best->match).inverse() *
                         pair.T_match_session_query_session * in_session(result, best->query);
    WaitingPair& one = waiting.emplace_back();
    one.match = pair.match;
    one.query = pair.query;
    one.query_keyframe = keyframe_name(sessions, best->query);
    one.match_keyframe = keyframe_name(sessions, best->match);
    one.sentence = sessions[pair.match].info.name + " and " + sessions[pair.query].info.name +
                   " wait: " + pair.reason + ". " + std::to_string(pair.distinct) +
                   (pair.distinct == 1 ? " loop places " : " loops place ") + one.query_keyframe +
                   ' ' + metres(between.translation.norm(), 1) + " from " + one.match_keyframe +
                   '.' + deciding_scans(loops, pair, sessions, result);
    const PlacingLoop* other = other_placement(loops, pair);
    if (other == nullptr) continue;
    one.other_query_keyframe = keyframe_name(sessions, other->query);
    one.other_match_keyframe = keyframe_name(sessions, other->match);
    one.sentence +=
        " Others place " + one.other_query_keyframe + " at " + one.other_match_keyframe + ", " +
        metres(other->distance_m(pair.T_match_session_query_session), 0) + " from there.";
  }
  return waiting;
}

std::vector<std::string> deciding_commands(const WaitingPair& pair,
                                           const std::string& query_session,
                                           const std::string& store) {
  const std::string keyframes = pair.query_keyframe + ' ' + pair.match_keyframe;
  std::vector<std::string> commands = {"unimapper map link --store " + store + ' ' + keyframes +
                                       "    # the same place"};
  if (!pair.other_query_keyframe.empty()) {
    commands.push_back("unimapper map link --store " + store + ' ' + pair.other_query_keyframe +
                       ' ' + pair.other_match_keyframe + "    # or these are");
  }
  commands.push_back("unimapper map forbid --store " + store + ' ' + keyframes +
                     "  # this loop is wrong");
  commands.push_back("unimapper map apart --store " + store + ' ' + query_session +
                     "  # it belongs to no other session");
  return commands;
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

void warn_of_merged_sessions(const std::vector<SessionData>& sessions,
                             const merge::MergeResult& result) {
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const merge::MergedSession& merged = result.sessions[s];
    if (!merge::is_in_map(merged.status) || merged.reason.empty()) continue;
    std::cerr << "unimapper: warning: session " << sessions[s].info.name << ": " << merged.reason
              << '\n';
  }
}

}  // namespace unimapper::apps
