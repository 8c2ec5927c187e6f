#include "bench/places/variants.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "unimapper/config/config_json.hpp"

namespace unimapper::bench {
namespace {

Rank rank_named(const std::string& name) {
  if (name == "confidence") return Rank::kConfidence;
  if (name == "votes") return Rank::kVotes;
  if (name == "votes_overlap") return Rank::kVotesOverlap;
  if (name == "without_overlap") return Rank::kWithoutOverlap;
  throw std::runtime_error("\"" + name + "\" is no rank");
}

Variant variant_of(const nlohmann::json& json, const std::filesystem::path& file,
                   const PipelineConfig& base) {
  Variant variant;
  variant.config = base;
  for (const auto& [key, value] : json.items()) {
    if (key == "name") {
      variant.name = value.get<std::string>();
    } else if (key == "config") {
      parse_config(value.dump(), file.string(), variant.config);
    } else if (key == "with_dynamic") {
      variant.description.with_dynamic = value.get<bool>();
    } else if (key == "world_frame") {
      variant.description.world_frame = value.get<bool>();
    } else if (key == "rank") {
      variant.rank = rank_named(value.get<std::string>());
    } else {
      throw std::runtime_error("\"" + key + "\" is not a member of a variant");
    }
  }
  return variant;
}

/// Key that is equal for variants with equal descriptors.
std::string description_key(const Variant& variant) {
  PipelineConfig config;
  config.voxel = variant.config.voxel;
  config.descriptor = variant.config.descriptor;
  return dump_config(config) + (variant.description.with_dynamic ? "d" : "") +
         (variant.description.world_frame ? "w" : "");
}

void number_descriptions(std::vector<Variant>& variants) {
  std::vector<std::string> keys;
  for (Variant& variant : variants) {
    const std::string key = description_key(variant);
    const auto known = std::find(keys.begin(), keys.end(), key);
    variant.described_as = static_cast<std::size_t>(known - keys.begin());
    if (known == keys.end()) keys.push_back(key);
  }
}

}  // namespace

double rank_of(const LoopCandidate& candidate, Rank rank) {
  const auto confidence = static_cast<double>(candidate.confidence);
  const auto votes = static_cast<double>(candidate.votes);
  const auto overlap = static_cast<double>(candidate.plane_overlap);
  switch (rank) {
    case Rank::kVotes:
      return votes;
    case Rank::kVotesOverlap:
      return votes * overlap;
    case Rank::kWithoutOverlap:
      return overlap > 0.0 ? confidence / overlap : 0.0;
    case Rank::kConfidence:
      break;
  }
  return confidence;
}

std::vector<Variant> read_variants(const std::filesystem::path& file, const PipelineConfig& base) {
  std::vector<Variant> variants;
  try {
    for (const auto& json : nlohmann::json::parse(datasets::read_file(file))) {
      variants.push_back(variant_of(json, file, base));
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  if (variants.empty()) throw std::runtime_error(file.string() + ": lists no variant");
  number_descriptions(variants);
  return variants;
}

std::vector<Variant> default_variant(const PipelineConfig& base) {
  std::vector<Variant> variants(1);
  variants.front().name = "default";
  variants.front().config = base;
  return variants;
}

}  // namespace unimapper::bench
