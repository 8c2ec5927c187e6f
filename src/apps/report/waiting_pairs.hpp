// Provisional pairs of sessions, in words: the proposed placement and what decides it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// A pair of sessions that waits.
struct WaitingPair {
  std::size_t match = 0;  ///< index of the session
  std::size_t query = 0;  ///< index of the other one
  std::string sentence;   ///< why it waits, and where the query would be
  /// "SESSION:NUMBER" of two keyframes to compare, of the loop that agrees best with the placement.
  std::string query_keyframe;
  std::string match_keyframe;
  /// "SESSION:NUMBER" of two keyframes of another placement that loops agree on; empty: there is
  /// none.
  std::string other_query_keyframe;
  std::string other_match_keyframe;
};

/// The provisional pairs of a result that have a proposed placement.
[[nodiscard]] std::vector<WaitingPair> waiting_pairs(const std::vector<SessionData>& sessions,
                                                     const merge::MergeResult& result);

/// The commands that decide on a pair, a line each; `store`: the project's folder, or a word for
/// it.
[[nodiscard]] std::vector<std::string> deciding_commands(const WaitingPair& pair,
                                                         const std::string& query_session,
                                                         const std::string& store);

/// Sentence and commands of each pair, as lines of text; empty where none waits.
[[nodiscard]] std::string waiting_text(const std::vector<SessionData>& sessions,
                                       const merge::MergeResult& result, const std::string& store);

/// Says on stderr what is wrong with sessions that are in the map: their odometry steps, or too few
/// loops hold them.
void warn_of_merged_sessions(const std::vector<SessionData>& sessions,
                             const merge::MergeResult& result);

}  // namespace unimapper::apps
