// Place database: loop search by a fixed-capacity hash table of triangles.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/ids.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper {

/// First stage of a loop: two keyframes that may show the same structure, as a search found them;
/// once registration has verified it, it becomes a `merge::LoopConstraint`. `confidence` is the
/// probability that the pose is right, calibrated on recordings with truth: a threshold on it is a
/// precision. `accepted` tells whether it reaches the configured one, otherwise it is reported for
/// evaluation only.
struct LoopCandidate {
  KeyframeId query;            ///< the keyframe that was searched for
  KeyframeId match;            ///< the stored keyframe it looks like
  float confidence = 0.0F;     ///< [0, 1]
  bool accepted = false;       ///< `confidence` reaches the configured threshold
  std::uint32_t votes = 0;     ///< of triangles that agree on the pose, weighted by their normals
  std::uint32_t inliers = 0;   ///< keypoints that agree with the pose
  float plane_overlap = 0.0F;  ///< share of commonly visible planes that coincide
  Pose T_match_query;          ///< between the two levelled keyframe frames
};

/// Stores places and finds those that look like a query (paper section V-B). Onboard it lives in
/// the arena of the pipeline; at the base the same class gets a larger configuration. A handle:
/// copies stand for the same database.
class PlaceDatabase {
 public:
  /// Takes all memory it will ever need from `arena`, its state included. Stores nothing and
  /// answers nothing where the arena was measuring or too small. `shape`: what the places look like
  /// that will be stored and searched for.
  void allocate(Arena& arena, const LoopSearchConfig& config,
                const PlaceShape& shape = {}) noexcept;

  /// Takes the memory that is kept between searches, for callers with other uses for the rest.
  void allocate_kept(Arena& arena, const LoopSearchConfig& config,
                     const PlaceShape& shape) noexcept;
  /// Takes, after `allocate_kept`, what is in use only during a search.
  void allocate_scratch(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// Stores a place, recorded at `T_session_place` (the keyframe's pose in its session's odometry
  /// frame). When full, the most redundant place is evicted (counted by `evicted()`): of the two
  /// places of one session nearest to each other in position and heading, the older. Cost: linear
  /// in triangles and places.
  void insert(const PlaceView& place, KeyframeId id, const Pose& T_session_place) noexcept;

  /// At most `LoopSearchConfig::max_results` candidates, best first; ties are broken by id, so
  /// the answer is deterministic. The view stays valid until the next call. Bounded work,
  /// however many places are stored: at most `max_compared` triangles are compared.
  std::span<const LoopCandidate> search(const PlaceView& query, KeyframeId query_id,
                                        const SearchScope& scope) noexcept;

  /// Begins a search in steps with a bound, for callers who have little time at once. `search_step`
  /// follows until it returns false, then `found()`. What the query's spans point to stays valid
  /// until then, and nothing is inserted or searched for in between.
  void begin_search(const PlaceView& query, KeyframeId query_id, const SearchScope& scope) noexcept;
  /// The next step: 8,192 stored triangles compared and what one of the query adds, the peaks of
  /// all votes, eight poses fitted, or one verified. False once nothing is left.
  bool search_step() noexcept;
  /// What the last search found, once no step is left; valid until the next one begins.
  [[nodiscard]] std::span<const LoopCandidate> found() const noexcept;

  /// Places stored.
  [[nodiscard]] std::uint32_t size() const noexcept;
  /// Places evicted for newer ones.
  [[nodiscard]] std::uint64_t evicted() const noexcept;
  /// Triangles refused because a bucket or the table was full, keypoints and planes of places
  /// larger than configured, and matches that did not fit a search.
  [[nodiscard]] std::uint64_t dropped() const noexcept;

 private:
  class State;
  State* state_ = nullptr;
};

}  // namespace unimapper
