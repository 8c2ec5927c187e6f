#include "growing_places.hpp"

#include <algorithm>
#include <utility>

#include "loop_search.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kFewestPlaces = 128;

}  // namespace

void GrowingPlaces::expect_sessions(std::size_t others) {
  if (others <= others_) return;
  others_ = 2 * others;
  if (database_ != nullptr) make_anew();
}

void GrowingPlaces::insert(const PlaceView& place, KeyframeId id, const Pose& T_session_place) {
  const bool is_new = places_.find(id) == places_.end();
  places_[id] = {{place.keypoints.begin(), place.keypoints.end()},
                 {place.planes.begin(), place.planes.end()},
                 place.up,
                 T_session_place};
  const auto keypoints =
      static_cast<std::uint32_t>(std::min<std::size_t>(place.keypoints.size(), 255));
  if (!is_new || places_.size() > capacity_ || keypoints > shape_.max_keypoints) {
    shape_.max_keypoints = std::max(shape_.max_keypoints, keypoints);
    return make_anew();
  }
  (*database_)->insert(place, id, T_session_place);
}

std::span<const LoopCandidate> GrowingPlaces::search(const PlaceView& query, KeyframeId id,
                                                     const SearchScope& scope) {
  if (database_ == nullptr) return {};
  return (*database_)->search(query, id, scope);
}

void GrowingPlaces::make_anew() {
  if (places_.size() > capacity_) capacity_ = std::max(kFewestPlaces, 2 * places_.size());
  database_ = std::make_unique<InArena<PlaceDatabase>>(
      search_config_of(capacity_, others_, per_session_), shape_);
  for (const auto& [id, place] : places_) {
    (*database_)->insert({place.keypoints, place.planes, place.up}, id, place.T_session_place);
  }
}

}  // namespace unimapper::merge
