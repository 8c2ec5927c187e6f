// Loop search in a fixed-capacity triangle hash table.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/keypoint_grid.hpp"
#include "unimapper/place/place_thinning.hpp"
#include "unimapper/place/plane_overlap.hpp"
#include "unimapper/place/pose_votes.hpp"
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

/// A possible revisit. `confidence` is the probability that the pose is right (see
/// `probability_of`): a threshold on it is a precision. `accepted` tells whether it reaches the
/// configured one, otherwise it is reported for evaluation only.
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
  void allocate(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// Stores a place, recorded at `T_session_place` (the keyframe's pose in its session's odometry
  /// frame). When full, the place that another one stands in for best makes room (see
  /// `PlaceThinning`; counted by `forgotten()`). Cost: linear in triangles and places.
  void insert(const PlaceView& place, PlaceId id, const Pose& T_session_place) noexcept;

  /// At most `LoopSearchConfig::max_results` candidates, best first; ties are broken by id, so
  /// the answer is deterministic. The view stays valid until the next call. Bounded work,
  /// however many places are stored: at most `max_compared` triangles are compared.
  std::span<const LoopCandidate> search(const PlaceView& query, PlaceId query_id,
                                        const SearchScope& scope) noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Places that made room for newer ones.
  [[nodiscard]] std::uint64_t forgotten() const noexcept { return forgotten_; }
  /// Triangles refused because a bucket or the table was full, keypoints and planes of places
  /// larger than configured, and matches that did not fit a search.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr std::int32_t kRivalReach = 60;  // in steps of 0.5 m: 30 m
  // Two poses in one place are the same within this, metres.
  static constexpr float kSamePose = 1.6F;

  // A plane in 10 bytes: centimetres and 1/127.
  struct StoredPlane {
    std::int16_t center_cm[3];
    std::int8_t normal[3];
    std::int8_t reserved;
  };
  struct Place {
    PlaceId id;
    PlanarPose T_session_place;
    std::uint16_t keypoints;
    std::uint16_t planes;
    std::uint16_t triangles;
  };
  struct Hypothesis {
    std::uint32_t place;
    std::uint32_t votes;
    float score;     // votes, relative to what the place could have given
    float evidence;  // of the keypoints, see `consensus`
    PlanarPose pose;
  };

  // How certain a verified pose is, and where in its session it puts the query.
  struct Doubt {
    std::uint32_t session;
    PlanarPose T_session_query;
    float certainty;
  };

  [[nodiscard]] bool in_scope(const Place& place, PlaceId query,
                              const SearchScope& scope) const noexcept;
  std::uint32_t free_slot() noexcept;
  void forget(std::uint32_t slot) noexcept;
  void load_query(const PlaceView& query) noexcept;
  void vote(PlaceId query_id, const SearchScope& scope) noexcept;
  void form_hypotheses() noexcept;
  void limit_candidates() noexcept;
  void load_targets(std::uint32_t slot) noexcept;
  float consensus(const PlanarPose& pose, float radius_m) noexcept;
  void improve(Hypothesis& hypothesis) noexcept;
  bool verify(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  bool examine(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  void doubt(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  Hypothesis shifted_rival(const Hypothesis& hypothesis, const PlanarPose& pose) noexcept;
  [[nodiscard]] bool contradict(const Hypothesis& a, const Hypothesis& b) const noexcept;
  [[nodiscard]] float strongest_rival(const Hypothesis& hypothesis) const noexcept;
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
  PlaceThinning thinning_;
  std::uint64_t forgotten_ = 0;
  std::uint64_t dropped_ = 0;

  // Scratch of one search or insertion.
  FixedVector<Keypoint> keypoints_;  // the finite ones of the place at hand
  FixedVector<Triangle> triangles_;
  PoseVotes votes_;
  FixedVector<Hypothesis> hypotheses_;
  KeypointGrid targets_;  // of the place under examination
  FixedVector<PlanePatch> match_planes_;
  FixedVector<PointPair> pairs_;
  float* rival_votes_ = nullptr;  // a square of shifts
  PlaneOverlap overlap_;
  float accept_score_ = 0.5F;  // what `accept_confidence` is as a score
  FixedVector<Doubt> doubts_;  // of the search under way
  FixedVector<LoopCandidate> results_;
};

}  // namespace unimapper
