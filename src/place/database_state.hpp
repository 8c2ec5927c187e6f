// State of the place database: stored places, triangle table, working memory of a search.
#pragma once

#include <cstdint>
#include <span>

#include "keypoint_grid.hpp"
#include "place_thinning.hpp"
#include "plane_overlap.hpp"
#include "pose_votes.hpp"
#include "src/core/fixed_vector.hpp"
#include "src/core/rigid_fit.hpp"
#include "triangle_table.hpp"
#include "triangles.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {

using namespace place;

/// What a `PlaceDatabase` stands for; its functions are documented there. A search goes from
/// matched triangles to hypotheses (loop_voting.cpp), from these to verified poses
/// (loop_verification.cpp), and checks those for perceptual aliasing (loop_ambiguity.cpp).
class PlaceDatabase::State {
 public:
  void allocate(Arena& arena, const LoopSearchConfig& config, const PlaceShape& shape) noexcept;
  void allocate_scratch(Arena& arena, const LoopSearchConfig& config) noexcept {
    votes_.allocate_scratch(arena, config);
  }
  void insert(const PlaceView& place, KeyframeId id, const Pose& T_session_place) noexcept;
  void begin_search(const PlaceView& query, KeyframeId query_id, const SearchScope& scope) noexcept;
  bool search_step() noexcept;
  [[nodiscard]] std::span<const LoopCandidate> found() const noexcept { return results_.view(); }

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint64_t evicted() const noexcept { return evicted_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  // Largest shift examined for ambiguity, in steps of 0.5 m: 30 m.
  static constexpr std::int32_t kShiftReach = 60;
  // Bounds of one step of a search.
  static constexpr std::uint32_t kComparedPerStep = 8192;
  static constexpr std::uint32_t kPosesPerStep = 8;
  // Two poses relative to one place are the same within this, metres.
  static constexpr float kSamePose = 1.6F;

  // A plane in 9 bytes: its centre in centimetres, and its normal in 1/127.
  struct StoredCenter {
    std::int16_t cm[3];
  };
  struct StoredNormal {
    std::int8_t of[3];
  };
  struct StoredPlace {
    KeyframeId id;
    PlanarPose T_session_place;
    std::uint16_t keypoints;
    std::uint16_t planes;
    std::uint16_t triangles;
    KeyframeUp up;
  };
  // A pose of the query relative to one stored place.
  struct Hypothesis {
    std::uint32_t slot;  // of the place
    std::uint32_t votes;
    float score;     // votes, relative to what the place could have given
    float evidence;  // of the keypoints, see `consensus`
    PlanarPose pose;
  };
  // Outcome of an ambiguity check, and where in its session the checked pose puts the query.
  struct AmbiguityCheck {
    std::uint32_t session;
    PlanarPose T_session_query;
    float distinctness;
  };

  /// What the next step of a search does.
  enum class Stage : std::uint8_t { kQuery, kVotes, kPeaks, kPoses, kPlanes, kRanking, kDone };
  /// A search from its query on.
  struct Search {
    PlaceView query;
    KeyframeId id;
    SearchScope scope;
    Stage stage = Stage::kDone;
    std::size_t next = 0;        // triangle or hypothesis
    std::uint64_t compared = 0;  // stored triangles
    std::size_t kept = 0;        // hypotheses
  };

  void go_to(Stage stage) noexcept {
    search_.stage = stage;
    search_.next = 0;
  }
  [[nodiscard]] bool in_scope(const StoredPlace& place) const noexcept;
  std::uint32_t free_slot() noexcept;
  void evict(std::uint32_t slot) noexcept;
  void load_query(const PlaceView& query) noexcept;
  bool vote_some() noexcept;
  void form_hypotheses() noexcept;
  bool refine_some() noexcept;
  void rank_hypotheses() noexcept;
  bool verify_next() noexcept;
  void rank_results() noexcept;
  void limit_candidates() noexcept;
  void load_targets(std::uint32_t slot) noexcept;
  float consensus(const PlanarPose& pose, float radius_m) noexcept;
  float consensus(const Pose& pose, float radius_m) noexcept;
  template <typename ToMatch>
  float pair_keypoints(const ToMatch& to_match, float radius_m) noexcept;
  void refine(Hypothesis& hypothesis) noexcept;
  bool verify(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  bool score_pose(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  void check_ambiguity(const Hypothesis& hypothesis, LoopCandidate& result) noexcept;
  Hypothesis best_shifted(const Hypothesis& hypothesis, const PlanarPose& pose) noexcept;
  [[nodiscard]] bool exclude_each_other(const Hypothesis& a, const Hypothesis& b) const noexcept;
  [[nodiscard]] float strongest_alternative(const Hypothesis& hypothesis) const noexcept;
  void load_planes(std::uint32_t slot) noexcept;
  void keep(const LoopCandidate& result) noexcept;

  LoopSearchConfig config_{};
  PlaceShape shape_{};
  TriangleTable table_;
  StoredPlace* places_ = nullptr;
  Eigen::Vector3f* vertices_ = nullptr;  // positions of keypoints, max_keypoints per place
  std::uint64_t* codes_ = nullptr;       // their occupancy, likewise
  StoredCenter* centers_ = nullptr;      // of planes, max_planes per place
  StoredNormal* normals_ = nullptr;      // likewise
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  PlaceThinning thinning_;
  std::uint64_t evicted_ = 0;
  std::uint64_t dropped_ = 0;

  // Working memory of one search or insertion.
  Search search_;
  FixedVector<Keypoint> keypoints_;  // the finite ones of the place at hand
  KeyframeUp query_up_;
  FixedVector<Triangle> triangles_;
  PoseVotes votes_;
  FixedVector<Hypothesis> hypotheses_;
  KeypointGrid targets_;  // of the place that is verified
  FixedVector<PlanePatch> match_planes_;
  FixedVector<PointPair> pairs_;
  float* shift_votes_ = nullptr;  // a square of shifts
  PlaneOverlap overlap_;
  float accept_score_ = 0.5F;  // what `accept_confidence` is as a score
  FixedVector<AmbiguityCheck> checks_;
  FixedVector<LoopCandidate> results_;
};

}  // namespace unimapper
