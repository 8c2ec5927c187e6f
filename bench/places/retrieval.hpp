// Place retrieval: candidates for every keyframe of a query drive in a reference drive.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <vector>

#include "bench/places/scene.hpp"
#include "bench/places/std_baseline.hpp"

namespace unimapper::bench {

/// Match index of a candidate that is a distractor, a place of another scene.
inline constexpr std::size_t kDistractor = std::numeric_limits<std::size_t>::max();

/// One candidate for a revisit.
struct RetrievedPlace {
  std::size_t query = 0;  ///< index of the keyframe in its drive
  std::size_t match = 0;  ///< likewise, or `kDistractor`
  double confidence = 0.0;
  bool accepted = false;
  Pose T_match_query;  ///< between levelled keyframe frames
};

struct RetrievalResult {
  std::vector<RetrievedPlace> candidates;
  std::vector<double> search_ms;  ///< of every query, processor time
  std::size_t triangles = 0;      ///< stored triangles (STD only)
};

/// Places of drives through other scenes, by `Variant::described_as` and by drive.
using DistractorPlaces = std::vector<std::vector<std::vector<OwnedPlace>>>;

/// Reads and describes on all cores. Throws std::runtime_error.
[[nodiscard]] DistractorPlaces read_distractors(const std::vector<std::filesystem::path>& runs,
                                                const std::vector<Variant>& variants);

/// Searches every place of `queries` among those of `references` and the distractors with
/// `PlaceDatabase`.
[[nodiscard]] RetrievalResult search_database(const SceneDrive& references,
                                              const SceneDrive& queries, const Variant& variant,
                                              const DistractorPlaces& distractors = {});

/// The same with STD. Drives without STD descriptors give no candidates.
[[nodiscard]] RetrievalResult search_std(const SceneDrive& references, const SceneDrive& queries,
                                         const StdConfig& config = {});

}  // namespace unimapper::bench
