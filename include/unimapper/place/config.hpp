// Parameters of description and loop search.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <string_view>

#include "unimapper/core/executor.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/grid_size.hpp"
#include "unimapper/core/parameter_table.hpp"

namespace unimapper {

/// Parameters of `PlaceDescriber` (paper section V-A).
struct DescriptorConfig {
  std::uint32_t max_keypoints = 128;
  std::uint32_t max_planes = 1024;
  std::uint32_t max_voxels = 1U << 14U;
  float range_m = 50.0F;
  float column_size_m = 0.3F;
  float window_m = 0.7F;
  float suppression_radius_m = 2.0F;
  /// Corner candidates considered before suppression, no fewer than `max_keypoints`.
  std::uint32_t max_candidates = 4096;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<DescriptorConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::max_keypoints>("[8, 255]", "", "choice", "Keypoints kept of a place."),
      parameter<&C::max_planes>("[1, 65535]", "", "choice", "Plane patches kept of a place."),
      parameter<&C::max_voxels>("[16, 1048576]", "", "choice",
                                "Capacity: coarse voxels within range of one keyframe."),
      parameter<&C::range_m>("[10, 120]", "m", "measured",
                             "Only cells within this horizontal distance of the keyframe's origin "
                             "are described."),
      parameter<&C::column_size_m>("[0.2, 1]", "m", "about 1.5 fine cells",
                                   "Grid step of the map of vertical structure."),
      parameter<&C::window_m>(
          "[0.2, 1]", "m", "measured",
          "Neighbourhood over which a corner is evaluated, standard deviation."),
      parameter<&C::suppression_radius_m>("[0.5, 10]", "m", "STD",
                                          "No two keypoints lie closer than this."),
      internal_parameter<&C::max_candidates>("[8, 65535]"));
}

/// What the cells are like that `PlaceDescriber` is given: follows from the stage before.
struct DescriptorInput {
  float voxel_size_m = kCoarseVoxelSizeM;  ///< L_c, edge of the coarse voxels planes are fitted in
  std::uint32_t max_cells = 1U << 17U;     ///< most static cells of one keyframe
  Executor executor = {};                  ///< who shares the work
};

/// What the places are like that `PlaceDatabase` stores and compares: follows from their
/// description.
struct PlaceShape {
  std::uint32_t max_keypoints = DescriptorConfig{}.max_keypoints;  ///< keypoints of a place at most
  std::uint32_t max_planes = DescriptorConfig{}.max_planes;  ///< plane patches of a place at most
  float voxel_size_m = kCoarseVoxelSizeM;  ///< L_c, edge of the coarse voxels planes were fitted in
};

/// Which triangles are formed from the keypoints of a place.
struct TriangleConfig {
  std::uint32_t neighbours = 12;
  float min_side_m = 4.0F;
  float max_side_m = 40.0F;
  std::uint32_t max_triangles = 500;
};

template <std::same_as<TriangleConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::neighbours>("[2, 32]", "", "STD: 10 to 20",
                                "Every keypoint pairs up its so many nearest ones."),
      parameter<&C::min_side_m>("[0.5, 20]", "m", "measured", "Shortest side."),
      parameter<&C::max_side_m>("[0.5, 300]", "m", "measured",
                                "Longest side, no shorter than min_side_m."),
      parameter<&C::max_triangles>("[16, 20000]", "", "measured", "Triangles kept of a place."));
}

/// Parameters of `PlaceDatabase` (paper section V-B).
struct LoopSearchConfig {
  std::uint32_t max_places = 2000;
  std::uint32_t max_results = 8;  ///< candidates returned per search
  TriangleConfig triangles;       ///< triangles of keypoints
  /// Two sides are equal within this; absolute, because it comes from the keypoints' noise and not
  /// from the side's length.
  float side_tolerance_m = 0.2F;
  /// Two dot products of normals are equal within this; measured.
  static constexpr float kDotTolerance = 0.35F;
  std::uint32_t max_code_difference = 6;
  std::uint32_t max_bucket = 4096;
  std::uint32_t max_compared = 220000;
  std::uint32_t max_matches = 1U << 16U;  ///< matched triangles kept per search
  std::uint32_t max_candidates = 32;
  /// Most poses of one session examined after voting: one that resembles everything keeps no others
  /// out; 0: no limit.
  std::uint32_t max_per_session = 0;
  std::uint32_t max_verified = 4;  ///< candidates whose planes are compared
  float accept_confidence = 0.97F;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<LoopSearchConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::max_places>("[1, 1048576]", "", "choice",
                                "Capacity: stored places; the most redundant one makes room."),
      internal_parameter<&C::max_results>("[1, 256]"), parameters_in<&C::triangles>(),
      internal_parameter<&C::side_tolerance_m>("[0.05, 1.2]", "m"),
      parameter<&C::max_code_difference>("[0, 24]", "", "measured",
                                         "Bands of height, of 24, in which the columns at the "
                                         "three vertices may differ."),
      parameter<&C::max_bucket>("[5, 16777216]", "", "choice",
                                "Triangles kept in one hash bucket."),
      parameter<&C::max_compared>("[1000, 1073741824]", "", "measured",
                                  "Stored triangles a search compares: bounds its time however "
                                  "many places there are. Beyond, the query's triangles of farther "
                                  "neighbours are left out."),
      internal_parameter<&C::max_matches>("[64, 16777216]"),
      parameter<&C::max_candidates>("[1, 256]", "", "measured", "Poses examined after voting."),
      internal_parameter<&C::max_per_session>("[0, 256]"),
      internal_parameter<&C::max_verified>("[1, 256]"),
      parameter<&C::accept_confidence>("[0, 1]", "", "measured",
                                       "Candidates that are right with at least this probability "
                                       "are accepted."));
}

/// Which places a search may answer with.
struct SearchScope {
  /// Keyframes of which sessions may be answered.
  enum class Sessions : std::uint8_t { kAll, kOnlySame, kOnlyOther };
  Sessions sessions = Sessions::kAll;
  std::uint32_t min_keyframe_gap = 0;
};

/// Names of the values of `SearchScope::Sessions`, in their order.
inline constexpr std::array<std::string_view, 3> kSearchSessions = {"all", "only_same",
                                                                    "only_other"};
consteval std::span<const std::string_view> choices_of(const SearchScope::Sessions*) {
  return kSearchSessions;
}

template <std::same_as<SearchScope> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::sessions>("choice", "Sessions whose places a search may answer with."),
      parameter<&C::min_keyframe_gap>("[0, 4294967295]", "keyframes", "choice",
                                      "Places of the query's own session must be at least this "
                                      "far away."));
}

}  // namespace unimapper
