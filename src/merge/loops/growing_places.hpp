// Search for loop candidates among places that become more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "src/merge/in_arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::merge {

/// A `PlaceDatabase` that is made anew, twice as large, where it would be full, with copies of the
/// places in it for that. The numbers of keyframes are the caller's.
class GrowingPlaces {
 public:
  /// `per_session`: candidates of each session that a search is for.
  explicit GrowingPlaces(std::uint32_t per_session) : per_session_(per_session) {}

  /// Searches meet so many sessions. Throws std::bad_alloc.
  void expect_sessions(std::size_t others);

  /// Stores a place, or stores it anew where it has changed. Throws std::bad_alloc. Cost: that of
  /// `PlaceDatabase::insert`, and of all of them each time their number has doubled.
  void insert(const PlaceView& place, KeyframeId id, const Pose& T_session_place);

  /// As `PlaceDatabase::search`.
  [[nodiscard]] std::span<const LoopCandidate> search(const PlaceView& query, KeyframeId id,
                                                      const SearchScope& scope);

 private:
  struct Place {
    std::vector<Keypoint> keypoints;
    std::vector<PlanePatch> planes;
    KeyframeUp up;
    Pose T_session_place;
  };
  void make_anew();

  std::uint32_t per_session_;
  std::size_t others_ = 1;
  std::size_t capacity_ = 0;
  PlaceShape shape_;
  std::map<KeyframeId, Place> places_;
  std::unique_ptr<InArena<PlaceDatabase>> database_;
};

}  // namespace unimapper::merge
