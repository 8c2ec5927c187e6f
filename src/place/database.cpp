// Place database: storage, insertion and search.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "database_state.hpp"
#include "loop_confidence.hpp"

namespace unimapper {
namespace {

std::int16_t centimetres(float metres) noexcept {
  return static_cast<std::int16_t>(std::lround(std::clamp(metres * 100.0F, -32767.0F, 32767.0F)));
}

std::int8_t unit_fraction(float value) noexcept {
  return static_cast<std::int8_t>(std::lround(std::clamp(value * 127.0F, -127.0F, 127.0F)));
}

/// A keypoint or a plane is so if its two vectors are.
[[gnu::always_inline]] inline bool are_finite(const Eigen::Vector3f& at,
                                              const Eigen::Vector3f& normal) noexcept {
  return at.allFinite() && normal.allFinite();
}

}  // namespace

void PlaceDatabase::State::allocate(Arena& arena, const LoopSearchConfig& config,
                                    const PlaceShape& shape) noexcept {
  config_ = config;
  shape_ = shape;
  accept_score_ = score_of(config.accept_confidence);
  const std::size_t places = config.max_places;
  table_.allocate(arena, config);
  places_ = arena.allocate<StoredPlace>(places);
  thinning_.allocate(arena, config.max_places);
  vertices_ = arena.allocate<Eigen::Vector3f>(places * shape.max_keypoints);
  codes_ = arena.allocate<std::uint64_t>(places * shape.max_keypoints);
  centers_ = arena.allocate<StoredCenter>(places * shape.max_planes);
  normals_ = arena.allocate<StoredNormal>(places * shape.max_planes);
  keypoints_.allocate(arena, shape.max_keypoints);
  triangles_.allocate(arena, config.triangles.max_triangles);
  votes_.allocate_kept(arena, config);
  hypotheses_.allocate(arena, PoseVotes::max_peaks(config));
  match_planes_.allocate(arena, shape.max_planes);
  pairs_.allocate(arena, shape.max_keypoints);
  constexpr std::size_t kShiftWidth = 2 * kShiftReach + 1;
  shift_votes_ = arena.allocate<float>(kShiftWidth * kShiftWidth);
  overlap_.allocate(arena, shape.max_planes, shape.voxel_size_m);
  checks_.allocate(arena, config.max_verified);
  results_.allocate(arena, std::max(config.max_results, config.max_verified));
  const bool ready = results_.capacity() > 0;
  capacity_ = ready ? config.max_places : 0;
  size_ = 0;
  evicted_ = 0;
  dropped_ = 0;
}

std::uint32_t PlaceDatabase::State::free_slot() noexcept {
  if (size_ < capacity_) return size_++;
  const std::uint32_t slot = thinning_.most_redundant();
  evict(slot);
  ++evicted_;
  return slot;
}

void PlaceDatabase::State::insert(const PlaceView& place, KeyframeId id,
                                  const Pose& T_session_place) noexcept {
  if (capacity_ == 0) return;
  const std::uint32_t slot = free_slot();
  thinning_.add(slot, id.session, T_session_place);
  StoredPlace& stored = places_[slot];
  stored = {};
  stored.id = id;
  stored.up = place.up;
  stored.T_session_place = seen_from_above(T_session_place);
  keypoints_.clear();
  const std::size_t first = std::size_t{slot} * shape_.max_keypoints;
  for (const Keypoint& keypoint : place.keypoints) {
    if (!are_finite(keypoint.position, keypoint.normal) || !keypoints_.push_back(keypoint)) {
      ++dropped_;
      continue;
    }
    vertices_[first + stored.keypoints] = keypoint.position;
    codes_[first + stored.keypoints] = keypoint.occupancy;
    ++stored.keypoints;
  }
  const std::size_t first_plane = std::size_t{slot} * shape_.max_planes;
  for (const PlanePatch& patch : place.planes) {
    if (!are_finite(patch.center, patch.normal) || stored.planes >= shape_.max_planes) {
      ++dropped_;
      continue;
    }
    const std::size_t plane = first_plane + stored.planes++;
    for (int axis = 0; axis < 3; ++axis) {
      centers_[plane].cm[axis] = centimetres(patch.center(axis));
      normals_[plane].of[axis] = unit_fraction(patch.normal(axis));
    }
  }
  build_triangles(keypoints_.view(), config_.triangles, triangles_);
  for (const Triangle& triangle : triangles_) {
    if (table_.insert(triangle, slot)) {
      ++stored.triangles;
    } else {
      ++dropped_;
    }
  }
}

// The triangles follow from the stored positions just as they did when they were inserted.
void PlaceDatabase::State::evict(std::uint32_t slot) noexcept {
  thinning_.remove(slot);
  keypoints_.clear();
  const Eigen::Vector3f* vertices = vertices_ + std::size_t{slot} * shape_.max_keypoints;
  for (std::uint32_t i = 0; i < places_[slot].keypoints; ++i) {
    Keypoint keypoint{};
    keypoint.position = vertices[i];
    keypoint.normal = Eigen::Vector3f::UnitZ();
    keypoints_.push_back(keypoint);
  }
  build_triangles(keypoints_.view(), config_.triangles, triangles_);
  for (const Triangle& triangle : triangles_) table_.remove(triangle, slot);
}

bool PlaceDatabase::State::in_scope(const StoredPlace& place) const noexcept {
  const SearchScope& scope = search_.scope;
  const KeyframeId query = search_.id;
  const bool same = place.id.session == query.session;
  if (!same) return scope.sessions != SearchScope::Sessions::kOnlySame;
  if (scope.sessions == SearchScope::Sessions::kOnlyOther) return false;
  const std::uint32_t gap = place.id.keyframe > query.keyframe ? place.id.keyframe - query.keyframe
                                                               : query.keyframe - place.id.keyframe;
  return gap >= scope.min_keyframe_gap;
}

void PlaceDatabase::State::begin_search(const PlaceView& query, KeyframeId query_id,
                                        const SearchScope& scope) noexcept {
  results_.clear();
  search_ = {query, query_id, scope, capacity_ == 0 ? Stage::kDone : Stage::kQuery, 0, 0, 0};
}

bool PlaceDatabase::State::search_step() noexcept {
  switch (search_.stage) {
    case Stage::kQuery:
      load_query(search_.query);
      votes_.clear();
      go_to(Stage::kVotes);
      break;
    case Stage::kVotes:
      if (!vote_some()) go_to(Stage::kPeaks);
      break;
    case Stage::kPeaks:
      form_hypotheses();
      search_.kept = 0;
      go_to(Stage::kPoses);
      break;
    case Stage::kPoses:
      if (refine_some()) break;
      rank_hypotheses();
      overlap_.set_query(search_.query.planes);
      checks_.clear();
      go_to(Stage::kPlanes);
      break;
    case Stage::kPlanes:
      if (!verify_next()) go_to(Stage::kRanking);
      break;
    case Stage::kRanking:
      rank_results();
      go_to(Stage::kDone);
      break;
    case Stage::kDone:
      break;
  }
  return search_.stage != Stage::kDone;
}

// The next of the best hypotheses; false once enough are verified.
bool PlaceDatabase::State::verify_next() noexcept {
  if (search_.next == std::min<std::size_t>(hypotheses_.size(), config_.max_verified)) return false;
  LoopCandidate result;
  result.query = search_.id;
  if (verify(hypotheses_[search_.next++], result)) keep(result);
  return true;
}

void PlaceDatabase::State::rank_results() noexcept {
  for (LoopCandidate& result : results_) {
    result.accepted = result.confidence >= accept_score_;
    result.confidence = probability_of(result.confidence);
  }
  std::sort(results_.begin(), results_.end(), [](const LoopCandidate& a, const LoopCandidate& b) {
    if (a.confidence != b.confidence) return a.confidence > b.confidence;
    return a.match < b.match;
  });
  while (results_.size() > config_.max_results) results_.pop_back();
}

// One result per place: the more confident one.
void PlaceDatabase::State::keep(const LoopCandidate& result) noexcept {
  for (LoopCandidate& known : results_) {
    if (known.match != result.match) continue;
    if (result.confidence > known.confidence) known = result;
    return;
  }
  results_.push_back(result);
}

void PlaceDatabase::allocate(Arena& arena, const LoopSearchConfig& config,
                             const PlaceShape& shape) noexcept {
  allocate_kept(arena, config, shape);
  allocate_scratch(arena, config);
}

void PlaceDatabase::allocate_kept(Arena& arena, const LoopSearchConfig& config,
                                  const PlaceShape& shape) noexcept {
  state_ = create_in<State>(arena, config, shape);
}

void PlaceDatabase::allocate_scratch(Arena& arena, const LoopSearchConfig& config) noexcept {
  State measured;
  (state_ == nullptr ? measured : *state_).allocate_scratch(arena, config);
}

void PlaceDatabase::insert(const PlaceView& place, KeyframeId id,
                           const Pose& T_session_place) noexcept {
  if (state_ != nullptr) state_->insert(place, id, T_session_place);
}

std::span<const LoopCandidate> PlaceDatabase::search(const PlaceView& query, KeyframeId query_id,
                                                     const SearchScope& scope) noexcept {
  begin_search(query, query_id, scope);
  while (search_step()) {
  }
  return found();
}

void PlaceDatabase::begin_search(const PlaceView& query, KeyframeId query_id,
                                 const SearchScope& scope) noexcept {
  if (state_ != nullptr) state_->begin_search(query, query_id, scope);
}

bool PlaceDatabase::search_step() noexcept { return state_ != nullptr && state_->search_step(); }

std::span<const LoopCandidate> PlaceDatabase::found() const noexcept {
  return state_ == nullptr ? std::span<const LoopCandidate>{} : state_->found();
}

std::uint32_t PlaceDatabase::size() const noexcept {
  return state_ == nullptr ? 0 : state_->size();
}

std::uint64_t PlaceDatabase::evicted() const noexcept {
  return state_ == nullptr ? 0 : state_->evicted();
}

std::uint64_t PlaceDatabase::dropped() const noexcept {
  return state_ == nullptr ? 0 : state_->dropped();
}

}  // namespace unimapper
