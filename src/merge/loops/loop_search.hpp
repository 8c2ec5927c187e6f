// Search for loop candidates by descriptor, intra-session and inter-session.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "src/merge/in_arena.hpp"
#include "src/merge/sessions/plane_restorer.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::merge {

/// Candidates verified per keyframe and other session.
inline constexpr std::uint32_t kCandidatesPerKeyframe = 3;

/// Search parameters of the base for a database of `places`. It has more time than a robot. It
/// stores fewer triangles of each, since the comparisons grow with the square of their number, and
/// verifies more candidates instead: among many places, some get as many votes by chance as the
/// right one.
LoopSearchConfig base_search_config(std::uint32_t places);

/// Search parameters of the base where the best `per_session` candidates of each of `others`
/// sessions are wanted.
LoopSearchConfig search_config_of(std::size_t places, std::size_t others,
                                  std::uint32_t per_session);

/// Candidates within each session: keyframes in their order, only earlier ones searched.
std::vector<LoopCandidate> find_intra_session_candidates(const std::vector<SessionData>& sessions,
                                                         const LoopConfig& config,
                                                         unsigned threads);

/// Candidates between sessions from one database of all places. Per keyframe and other session
/// the best few, per pair of sessions the best `max_candidates_per_pair`; each pair of
/// keyframes once.
std::vector<LoopCandidate> find_inter_session_candidates(const std::vector<SessionData>& sessions,
                                                         const LoopConfig& config);

/// Search among the keyframes of sessions that do not change.
class PlaceSearch {
 public:
  /// Stores all places of `sessions`; a query meets up to `others` of them. Throws std::bad_alloc.
  PlaceSearch(const std::vector<SessionData>& sessions, std::size_t others);

  /// Candidates of keyframe `query`, which is in `session`: of each session but its own the best
  /// `kCandidatesPerKeyframe`. Bounded work.
  std::vector<LoopCandidate> search(const SessionData& session, KeyframeId query);

 private:
  InArena<PlaceDatabase> database_;
  PlaneRestorer planes_;
};

}  // namespace unimapper::merge
