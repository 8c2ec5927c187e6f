// Loop search in a fixed-capacity triangle hash table.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/place.hpp"
#include "unimapper/place/plane_overlap.hpp"
#include "unimapper/place/rigid_fit.hpp"
#include "unimapper/place/triangle_table.hpp"
#include "unimapper/place/triangles.hpp"

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
  std::uint32_t votes = 0;     ///< of triangles that agree on the pose, weighted by their normals
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

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Places that made room for newer ones.
  [[nodiscard]] std::uint64_t forgotten() const noexcept { return forgotten_; }
  /// Triangles refused because a bucket or the table was full, keypoints and planes of places
  /// larger than configured, and matches that did not fit a search.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr std::uint32_t kYawBins = 32;
  static constexpr std::uint32_t kMatchesPerPlace = 256;
  static constexpr std::uint32_t kHypothesesPerPlace = 3;
  static constexpr std::int32_t kRivalReach = 60;  // in steps of 0.5 m: 30 m
  static constexpr std::uint16_t kOutOfScope = 0;
  static constexpr std::uint16_t kInScope = 1;
  static constexpr std::uint16_t kCandidate = 2;

  // A keypoint of the place under examination.
  struct Target {
    Eigen::Vector3f position;
    std::uint64_t code;
  };
  // A plane in 10 bytes: centimetres and 1/127.
  struct StoredPlane {
    std::int16_t center_cm[3];
    std::int8_t normal[3];
    std::int8_t reserved;
  };
  struct Place {
    PlaceId id;
    std::uint16_t keypoints;
    std::uint16_t planes;
    std::uint16_t triangles;
    std::uint16_t role;  // in the search under way: kOutOfScope, kInScope, kCandidate + index
  };
  // A query triangle that equals a stored one.
  struct Match {
    std::uint16_t place;
    std::uint8_t yaw_bin;
    std::uint8_t query[3];
    std::uint8_t stored[3];
    std::uint8_t weight;
  };
  struct Candidate {
    std::uint32_t place;
    std::uint32_t yaw_bin;
    std::uint32_t matches;  // gathered so far, at most kMatchesPerPlace
    float score;
  };
  // What one matched triangle says about the pose.
  struct Shift {
    PlanarPose pose;
    Eigen::Vector2f center;  // of the query's triangle
    std::uint32_t weight;
    std::uint32_t support;
    std::uint32_t taken;
  };
  struct Hypothesis {
    std::uint32_t place;
    std::uint32_t votes;
    float evidence;  // of the keypoints, see `consensus`
    PlanarPose pose;
  };

  [[nodiscard]] bool in_scope(const Place& place, PlaceId query,
                              const SearchScope& scope) const noexcept;
  void forget(std::uint32_t slot) noexcept;
  void vote(const PlaceView& query, PlaceId query_id, const SearchScope& scope) noexcept;
  void choose_candidates() noexcept;
  [[nodiscard]] float mean_similarity(const Match& match) const noexcept;
  void gather_matches() noexcept;
  void form_hypotheses(std::uint32_t candidate) noexcept;
  void load_targets(std::uint32_t slot) noexcept;
  float consensus(const PlanarPose& pose, float radius_m) noexcept;
  void improve(Hypothesis& hypothesis) noexcept;
  bool verify(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  bool examine(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  Hypothesis strongest_rival(const Hypothesis& hypothesis, const PlanarPose& pose) noexcept;
  void load_planes(std::uint32_t slot) noexcept;
  void keep(const LoopCandidate& result) noexcept;
  [[nodiscard]] static bool comes_before(const PlaceId& a, const PlaceId& b) noexcept;

  LoopSearchConfig config_{};
  TriangleTable table_;
  Place* places_ = nullptr;
  Eigen::Vector3f* vertices_ = nullptr;  // positions of keypoints, max_keypoints per place
  std::uint64_t* codes_ = nullptr;       // their occupancy, likewise
  StoredPlane* planes_ = nullptr;        // max_planes per place
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t next_ = 0;  // slot of the next insertion, the oldest when full
  std::uint64_t forgotten_ = 0;
  std::uint64_t dropped_ = 0;

  // Scratch of one search or insertion.
  FixedVector<Keypoint> keypoints_;  // the finite ones of the place at hand
  FixedVector<Triangle> triangles_;
  FixedVector<Match> matches_;
  std::uint16_t* votes_ = nullptr;  // kYawBins per place
  FixedVector<Candidate> candidates_;
  Match* gathered_ = nullptr;  // kMatchesPerPlace per candidate
  FixedVector<Shift> shifts_;
  FixedVector<Hypothesis> hypotheses_;
  FixedVector<Target> targets_;  // of the place under examination, ascending in x
  FixedVector<PlanePatch> match_planes_;
  FixedVector<PointPair> pairs_;
  float* rival_votes_ = nullptr;  // a square of shifts
  PlaneOverlap overlap_;
  FixedVector<LoopCandidate> results_;
};

}  // namespace unimapper
