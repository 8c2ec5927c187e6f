// Loop search in a fixed-capacity triangle hash table.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/place.hpp"

namespace unimapper {

/// Which keyframe a stored place belongs to. `session` is any number that tells sessions apart.
struct PlaceId {
  std::uint32_t session = 0;
  std::uint32_t keyframe = 0;  ///< running number within its session
};

/// Which places a search may answer with.
struct SearchScope {
  enum class Sessions : std::uint8_t { kAll, kOnlySame, kOnlyOther };
  Sessions sessions = Sessions::kAll;
  /// Places of the query's own session must be at least this many keyframes away.
  std::uint32_t min_keyframe_gap = 0;
};

/// A possible revisit. `confidence` in [0, 1] rises with the evidence; `accepted` tells whether
/// it passed the configured thresholds, otherwise it is reported for evaluation only.
struct LoopCandidate {
  PlaceId match;
  float confidence = 0.0F;
  bool accepted = false;
  std::uint32_t votes = 0;
  std::uint32_t inliers = 0;   ///< keypoints that agree with the pose
  float plane_overlap = 0.0F;  ///< share of commonly visible planes that coincide
  Pose T_match_query;          ///< between the two levelled keyframe frames
};

/// Stores places and finds those that look like a query (paper section V-B). Onboard it lives in
/// the arena of the pipeline; at the base the same class gets a larger configuration.
class PlaceDatabase {
 public:
  /// Takes all memory it will ever need from `arena`.
  void attach(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// Stores a place. When full, the oldest place makes room (counted by `forgotten()`).
  void insert(const PlaceView& place, PlaceId id) noexcept;

  /// At most `LoopSearchConfig::max_results` candidates, best first; ties are broken by id, so
  /// the answer is deterministic. The view stays valid until the next call. Bounded work:
  /// independent of how many places are stored beyond the configured bucket bounds.
  std::span<const LoopCandidate> search(const PlaceView& query, PlaceId query_id,
                                        const SearchScope& scope) noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept;
  [[nodiscard]] std::uint64_t forgotten() const noexcept;
  /// Triangles refused because a bucket or the table was full.
  [[nodiscard]] std::uint64_t dropped() const noexcept;
};

}  // namespace unimapper
