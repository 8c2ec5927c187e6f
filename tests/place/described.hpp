// Descriptions that own their memory.
#pragma once

#include "synthetic_place.hpp"
#include "tests/test.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::test {

constexpr KeyframeId kQuery{9, 0};
inline const Pose kOrigin;

struct Description {
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  KeyframeUp up;

  Description() = default;
  explicit Description(const PlaceView& place)
      : keypoints(place.keypoints.begin(), place.keypoints.end()),
        planes(place.planes.begin(), place.planes.end()),
        up(place.up) {}
  [[nodiscard]] PlaceView view() const { return {keypoints, planes, up}; }
};

inline Description describe(const std::vector<FineCell>& cells,
                            const DescriptorConfig& config = {}) {
  Owned<PlaceDescriber> describer(config);
  return Description(describer->describe(cells));
}

/// A database of few places.
inline LoopSearchConfig small_search(std::uint32_t places = 40) {
  LoopSearchConfig config;
  config.max_places = places;
  return config;
}

/// Copies of what a search finds.
inline std::vector<LoopCandidate> search(PlaceDatabase& database, const Description& query,
                                         KeyframeId id = kQuery, const SearchScope& scope = {}) {
  const auto found = database.search(query.view(), id, scope);
  return {found.begin(), found.end()};
}

}  // namespace unimapper::test
