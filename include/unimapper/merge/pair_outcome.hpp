// Outcome for two maps: whether one is placed in the frame of the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "unimapper/core/pose.hpp"

namespace unimapper::merge {

/// Refused: there is no set of loops that could connect the maps. Provisional: there is one, and
/// something else would explain it as well; the maps stay apart until more is known. Confirmed:
/// the maps are merged.
enum class PairState : std::uint8_t { kRefused, kProvisional, kConfirmed };

/// "refused", "provisional" or "confirmed": the word in summary.json.
[[nodiscard]] const char* state_name(PairState state);

/// What is known of two sessions with verified inter-session loops.
struct PairOutcome {
  std::size_t match = 0;                  ///< the session with the lower index
  std::size_t query = 0;                  ///< the session with the higher index
  PairState state = PairState::kRefused;  ///< whether they are merged
  std::string reason;                     ///< why it is not confirmed, empty otherwise
  std::size_t loops = 0;                  ///< between the two sessions, verified by registration
  std::size_t distinct = 0;  ///< loops at distinct positions in the largest consistent set
  /// Loops at distinct positions in the largest set that contradicts the consistent one.
  std::size_t competing = 0;
  /// Where the consistent set places the query's odometry frame in the match's, metres. The
  /// identity without such a set.
  Pose T_match_session_query_session;
};

}  // namespace unimapper::merge
