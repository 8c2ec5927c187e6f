// Scaling benchmark: search time and recall over the size of the place database.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/places/description.hpp"
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

/// A place that is not in the scene of the queries, and its session.
struct Distractor {
  OwnedPlace place;
  std::uint32_t session = 0;
};
/// The i-th distractor.
using Distractors = std::function<Distractor(std::uint32_t)>;

/// The places of real drives one after another, one session each. Throws std::out_of_range beyond
/// the last.
[[nodiscard]] Distractors real_places(const std::vector<DescribedDrive>& drives);
/// Any number of synthetic places from halves of real ones, a thousand to a session.
[[nodiscard]] Distractors synthetic_places(const std::vector<DescribedDrive>& drives,
                                           std::uint32_t seed);

/// Measurements at one size of the database.
struct ScalingStep {
  std::uint32_t places = 0;
  double insert_ms = 0.0;  ///< mean since the step before
  double query_p50_ms = 0.0;
  double query_p99_ms = 0.0;
  double found_share = 0.0;     ///< positive queries whose top candidate is right
  double accepted_share = 0.0;  ///< and accepted
  std::size_t wrong = 0;        ///< accepted candidates that are wrong
  std::uint64_t dropped = 0;
};

/// Reference drive and queries of a scaling measurement.
struct ScalingTask {
  DescribedDrive known;
  std::vector<DescribedDrive> queries;
  /// By query drive and keyframe: whether `known` has a common view.
  std::vector<std::vector<bool>> has_answer;
};

[[nodiscard]] ScalingTask make_task(const std::filesystem::path& known,
                                    const std::vector<std::filesystem::path>& queries);

struct ScalingResult {
  std::vector<ScalingStep> steps;
  std::size_t bytes = 0;
};

/// Inserts the reference places, then distractors up to each of `sizes`, and searches all queries
/// at each size. Unreachable sizes are left out.
[[nodiscard]] ScalingResult measure_scaling(const ScalingTask& task, const Distractors& distractors,
                                            const std::vector<std::uint32_t>& sizes,
                                            const LoopSearchConfig& config);

}  // namespace unimapper::bench
