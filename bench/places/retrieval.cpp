#include "bench/places/retrieval.hpp"

#include <algorithm>

#include "bench/places/stopwatch.hpp"
#include "src/merge/parallel.hpp"
#include "unimapper/merge/in_arena.hpp"

namespace unimapper::bench {
namespace {

constexpr std::uint32_t kReferenceDrive = 1;
constexpr std::uint32_t kQueryDrive = 2;
constexpr std::uint32_t kFirstDistractorDrive = 3;

using Drives = std::vector<std::vector<OwnedPlace>>;

std::size_t count_places(const Drives& drives) {
  std::size_t count = 0;
  for (const auto& drive : drives) count += drive.size();
  return count;
}

/// Every drive is a session. Positions within it affect only which places a full database forgets.
void insert_drives(const Drives& drives, PlaceDatabase& database) {
  for (std::uint32_t d = 0; d < drives.size(); ++d) {
    for (std::uint32_t i = 0; i < drives[d].size(); ++i) {
      Pose along;
      along.translation.x() = 7.0 * i;
      database.insert(drives[d][i].view(), {kFirstDistractorDrive + d, i}, along);
    }
  }
}

LoopSearchConfig fitting(const Variant& variant, std::size_t places) {
  LoopSearchConfig config = variant.config.loop_search;
  config.max_places = std::max(config.max_places, static_cast<std::uint32_t>(places));
  return config;
}

}  // namespace

DistractorPlaces read_distractors(const std::vector<std::filesystem::path>& runs,
                                  const std::vector<Variant>& variants) {
  std::size_t descriptions = 0;
  for (const Variant& variant : variants) {
    descriptions = std::max(descriptions, variant.described_as + 1);
  }
  DistractorPlaces distractors(runs.empty() ? 0 : descriptions, Drives(runs.size()));
  merge::parallel_for(runs.size(), 0, [&](std::size_t i) {
    const Drive drive = read_drive_without_truth(runs[i]);
    for (const Variant& variant : variants) {
      std::vector<OwnedPlace>& places = distractors[variant.described_as][i];
      if (places.empty()) {
        places = describe(drive, variant.config, variant.description);
      }
    }
  });
  return distractors;
}

RetrievalResult search_database(const SceneDrive& references, const SceneDrive& queries,
                                const Variant& variant, const DistractorPlaces& distractors) {
  static const Drives kNone;
  const Drives& others = distractors.empty() ? kNone : distractors.at(variant.described_as);
  const std::vector<OwnedPlace>& stored = references.described.at(variant.described_as);
  const std::vector<OwnedPlace>& query_places = queries.described.at(variant.described_as);
  merge::InArena<PlaceDatabase> database(fitting(variant, stored.size() + count_places(others)),
                                         variant.config.place_shape());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    database->insert(stored[i].view(), {kReferenceDrive, static_cast<std::uint32_t>(i)},
                     references.drive.keyframes[i].T_odometry_keyframe);
  }
  insert_drives(others, *database);
  RetrievalResult result;
  for (std::size_t i = 0; i < query_places.size(); ++i) {
    const double start = thread_milliseconds();
    const auto found =
        database->search(query_places[i].view(), {kQueryDrive, static_cast<std::uint32_t>(i)},
                         {SearchScope::Sessions::kOnlyOther, 0});
    result.search_ms.push_back(thread_milliseconds() - start);
    for (const LoopCandidate& candidate : found) {
      if (candidate.match.session != kReferenceDrive) {
        result.candidates.push_back(
            {i, kDistractor, rank_of(candidate, variant.rank), candidate.accepted, {}});
        continue;
      }
      const std::size_t match = candidate.match.keyframe;
      result.candidates.push_back({i, match, rank_of(candidate, variant.rank), candidate.accepted,
                                   stored[match].T_keyframe_place * candidate.T_match_query *
                                       query_places[i].T_keyframe_place.inverse()});
    }
  }
  return result;
}

RetrievalResult search_std(const SceneDrive& references, const SceneDrive& queries,
                           const StdConfig& config) {
  StdDatabase database(config);
  for (const StdKeyframe& keyframe : references.std_described) database.insert(keyframe.place);
  RetrievalResult result;
  result.triangles = database.triangles();
  for (std::size_t i = 0; i < queries.std_described.size(); ++i) {
    const double start = thread_milliseconds();
    const auto found = database.search(queries.std_described[i].place);
    result.search_ms.push_back(thread_milliseconds() - start);
    if (!found) continue;
    // STD's places are in the frames of the two odometries.
    const Pose T_match_query =
        references.drive.keyframes[found->match].T_odometry_keyframe.inverse() *
        found->T_match_query * queries.drive.keyframes[i].T_odometry_keyframe;
    result.candidates.push_back(
        {i, found->match, found->score, found->score >= config.accept_score, T_match_query});
  }
  return result;
}

}  // namespace unimapper::bench
