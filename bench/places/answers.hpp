// What a place recogniser answers when a drive is looked for in another.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <vector>

#include "bench/places/scene.hpp"
#include "bench/places/std_baseline.hpp"

namespace unimapper::bench {

/// Instead of a match: a place of another scene.
inline constexpr std::size_t kStranger = std::numeric_limits<std::size_t>::max();

/// One possible revisit.
struct PlaceAnswer {
  std::size_t query = 0;  ///< index of the keyframe in its drive
  std::size_t match = 0;  ///< likewise, or `kStranger`
  double confidence = 0.0;
  bool accepted = false;
  Pose T_match_query;  ///< between levelled keyframe frames
};

struct PlaceAnswers {
  std::vector<PlaceAnswer> answers;
  std::vector<double> search_ms;  ///< of every query, processor time
  std::size_t triangles = 0;      ///< STD: stored ones
};

/// Places of drives elsewhere, to be taken for the wrong ones: of every `Variant::described_as`,
/// of every drive.
using Crowd = std::vector<std::vector<std::vector<OwnedPlace>>>;

/// Reads and describes on all cores. Throws std::runtime_error.
[[nodiscard]] Crowd read_crowd(const std::vector<std::filesystem::path>& runs,
                               const std::vector<Variant>& variants);

/// Looks for every place of `queries` among those of `references` and the crowd with our own
/// database.
[[nodiscard]] PlaceAnswers ask_database(const SceneDrive& references, const SceneDrive& queries,
                                        const Variant& variant, const Crowd& crowd = {});

/// The same with STD. Nothing is found in drives STD did not describe.
[[nodiscard]] PlaceAnswers ask_std(const SceneDrive& references, const SceneDrive& queries,
                                   const StdConfig& config = {});

}  // namespace unimapper::bench
