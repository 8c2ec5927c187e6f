// What searching costs, and still finds, while a database grows.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/places/described.hpp"
#include "bench/places/drive.hpp"
#include "unimapper/merge/in_arena.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::bench {

/// A drive and its places.
struct DescribedDrive {
  Drive drive;
  std::vector<OwnedPlace> places;
};

[[nodiscard]] DescribedDrive read_and_describe(const std::filesystem::path& run, bool with_truth);

/// Where the places that crowd a database come from: the i-th of them, and where in which session.
struct Stranger {
  OwnedPlace place;
  std::uint32_t session = 0;
};
using Strangers = std::function<Stranger(std::uint32_t)>;

/// The places of real drives, one session for each, after one another. Beyond the last: none.
[[nodiscard]] Strangers drives_as_they_are(const std::vector<DescribedDrive>& drives);
/// Endlessly many, from halves of the places of real drives, a thousand to a session.
[[nodiscard]] Strangers mixed_halves(const std::vector<DescribedDrive>& drives, std::uint32_t seed);

/// The database at one size.
struct GrowthStep {
  std::uint32_t places = 0;
  double insert_ms = 0.0;  ///< mean since the step before
  double query_p50_ms = 0.0;
  double query_p99_ms = 0.0;
  double found_share = 0.0;     ///< queries with something to find whose best answer is right
  double accepted_share = 0.0;  ///< and accepted
  std::size_t wrong = 0;        ///< accepted answers that are wrong
  std::uint64_t dropped = 0;
};

/// What is known for sure in the crowd, and what is asked.
struct GrowthTask {
  DescribedDrive known;
  std::vector<DescribedDrive> queries;
  /// Of every query drive and keyframe: whether `known` shows what it shows.
  std::vector<std::vector<bool>> has_answer;
};

[[nodiscard]] GrowthTask make_task(const std::filesystem::path& known,
                                   const std::vector<std::filesystem::path>& queries);

struct Growth {
  std::vector<GrowthStep> steps;
  std::size_t bytes = 0;
};

/// Inserts what is known, then strangers up to each of `sizes`, and asks all queries there. Sizes
/// that cannot be reached are left out.
[[nodiscard]] Growth grow(const GrowthTask& task, const Strangers& strangers,
                          const std::vector<std::uint32_t>& sizes, const LoopSearchConfig& config);

}  // namespace unimapper::bench
