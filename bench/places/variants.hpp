// Ablation variants: the default configuration and one change each.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/description.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::bench {

/// Score that candidates are ranked by. Verification cannot be switched off, but its result can be
/// ignored.
enum class Rank {
  kConfidence,
  kVotes,           ///< triangles alone: neither the keypoints' consensus nor planes
  kVotesOverlap,    ///< triangles and planes
  kWithoutOverlap,  ///< the confidence with its factor for planes taken out
};

[[nodiscard]] double rank_of(const LoopCandidate& candidate, Rank rank);

struct Variant {
  std::string name;
  PipelineConfig config;
  DescriptionVariant description;
  Rank rank = Rank::kConfidence;
  std::size_t described_as = 0;  ///< variants of one number have the same descriptions
};

/// Reads a JSON list of objects: `name`, and what is changed of `config` (as onboard's --config),
/// `with_dynamic`, `world_frame`, `rank` ("confidence", "votes", "votes_overlap",
/// "without_overlap"). All start from `base`. Throws std::runtime_error.
[[nodiscard]] std::vector<Variant> read_variants(const std::filesystem::path& file,
                                                 const PipelineConfig& base);

/// The default alone.
[[nodiscard]] std::vector<Variant> default_variant(const PipelineConfig& base);

}  // namespace unimapper::bench
