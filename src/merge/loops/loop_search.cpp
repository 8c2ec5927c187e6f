// Search for loop candidates by descriptor, intra-session and inter-session.
#include "loop_search.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>

#include "src/core/voxel_key.hpp"
#include "src/merge/in_arena.hpp"
#include "src/merge/parallel.hpp"
#include "src/merge/sessions/plane_restorer.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::merge {
namespace {

// Among more places than these, tighter tolerances find more loops than comparing fewer of the
// query's triangles, because so many match by chance.
constexpr std::uint32_t kVeryManyPlaces = 50'000;

/// Robots may be configured to send more keypoints than usual.
PlaceShape place_shape(const std::vector<SessionData>& sessions) {
  PlaceShape shape;
  for (const auto& session : sessions) {
    for (const auto& keyframe : session.keyframes) {
      shape.max_keypoints = std::max(
          shape.max_keypoints,
          static_cast<std::uint32_t>(std::min<std::size_t>(keyframe.keypoints.size(), 255)));
    }
  }
  return shape;
}

std::size_t places_of(const std::vector<SessionData>& sessions) {
  std::size_t places = 0;
  for (const auto& session : sessions) places += session.keyframes.size();
  return places;
}

bool is_better(const LoopCandidate& a, const LoopCandidate& b) {
  return std::tuple(a.accepted, a.confidence, b.query, b.match) >
         std::tuple(b.accepted, b.confidence, a.query, a.match);
}

/// The place of a loop: so many metres of both keyframes' paths.
constexpr double kPlace_m = 20.0;

/// Paths of sessions, by keyframe.
using Paths = std::vector<std::vector<double>>;

/// Sorts candidates, the best first, and keeps `most` of them, spread over places: the best of
/// each, then the second best of each, and so on. A robot that waits at a crossing must not
/// displace what it saw elsewhere.
void choose(std::vector<LoopCandidate>& candidates, std::size_t most, const Paths& paths) {
  std::sort(candidates.begin(), candidates.end(), is_better);
  if (candidates.size() <= most) return;
  const auto place_of = [&](KeyframeId k) {
    return floor_to<std::int64_t>(paths[k.session][k.keyframe] / kPlace_m);
  };
  std::map<std::pair<std::int64_t, std::int64_t>, std::size_t> chosen_at;
  std::vector<std::pair<std::size_t, std::size_t>> order;  // rank at its place, position
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const auto [a, b] = std::minmax(candidates[i].query, candidates[i].match);
    order.emplace_back(chosen_at[{place_of(a), place_of(b)}]++, i);
  }
  std::sort(order.begin(), order.end());
  order.resize(most);
  std::vector<LoopCandidate> chosen;
  chosen.reserve(order.size());
  for (const auto& [rank, i] : order) chosen.push_back(candidates[i]);
  std::sort(chosen.begin(), chosen.end(), is_better);
  candidates = std::move(chosen);
}

std::vector<LoopCandidate> intra_session_loops(const std::vector<SessionData>& sessions,
                                               std::size_t session, const LoopConfig& config) {
  const auto& keyframes = sessions[session].keyframes;
  InArena<PlaceDatabase> database(search_config_of(keyframes.size(), 1, 1), place_shape(sessions));
  PlaneRestorer planes;
  Paths paths(sessions.size());
  const std::vector<double>& path = paths[session] = path_lengths_m(sessions[session]);
  std::vector<LoopCandidate> found;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const KeyframeId query{session, k};
    const PlaceView place = planes.place(sessions[session], k);
    std::uint32_t kept = 0;
    for (const auto& candidate : database->search(
             place, query, {SearchScope::Sessions::kOnlySame, config.min_keyframe_gap})) {
      if (kept == kCandidatesPerKeyframe) break;
      if (candidate.match.keyframe >= k ||
          path[k] - path[candidate.match.keyframe] < config.min_path_gap_m) {
        continue;
      }
      found.push_back(candidate);
      ++kept;
    }
    database->insert(place, query, keyframes[k].T_odometry_keyframe);
  }
  choose(found, config.max_candidates_per_pair, paths);
  return found;
}

}  // namespace

LoopSearchConfig base_search_config(std::uint32_t places) {
  LoopSearchConfig config;
  config.max_places = places;
  config.triangles.max_triangles = 350;
  config.max_compared = 3'500'000;
  config.max_matches = 1U << 20U;
  config.max_bucket = 1U << 24U;
  config.max_candidates = 100;
  if (places > kVeryManyPlaces) {
    config.side_tolerance_m = 0.15F;
    config.max_code_difference = 5;
  }
  return config;
}

LoopSearchConfig search_config_of(std::size_t places, std::size_t others,
                                  std::uint32_t per_session) {
  LoopSearchConfig config =
      base_search_config(static_cast<std::uint32_t>(std::clamp<std::size_t>(places, 1, 1U << 20U)));
  // No session may displace the candidates of another.
  config.max_per_session = std::max(per_session, config.max_verified);
  const auto wanted =
      static_cast<std::uint32_t>(std::min<std::size_t>(others * config.max_per_session, 256));
  config.max_results = std::max(config.max_results, wanted);
  config.max_verified = std::max(config.max_verified, wanted);
  config.max_candidates = std::max(config.max_candidates, wanted);
  return config;
}

std::vector<LoopCandidate> find_intra_session_candidates(const std::vector<SessionData>& sessions,
                                                         const LoopConfig& config,
                                                         unsigned threads) {
  std::vector<std::vector<LoopCandidate>> found(sessions.size());
  parallel_for(sessions.size(), threads,
               [&](std::size_t s) { found[s] = intra_session_loops(sessions, s, config); });
  std::vector<LoopCandidate> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::vector<LoopCandidate> find_inter_session_candidates(const std::vector<SessionData>& sessions,
                                                         const LoopConfig& config) {
  if (sessions.size() < 2 || places_of(sessions) == 0) return {};
  PlaceSearch search(sessions, sessions.size() - 1);
  // By (lower, higher) session, then by (lower, higher) keyframe: of the two directions of a pair
  // the better one is kept.
  std::map<std::pair<std::size_t, std::size_t>,
           std::map<std::pair<KeyframeId, KeyframeId>, LoopCandidate>>
      by_pair;
  const auto keep = [&](const LoopCandidate& candidate) {
    const auto keyframes = std::minmax(candidate.query, candidate.match);
    auto& pair = by_pair[{keyframes.first.session, keyframes.second.session}];
    const auto [entry, inserted] = pair.try_emplace(keyframes, candidate);
    if (!inserted && is_better(candidate, entry->second)) entry->second = candidate;
  };
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const auto& keyframes = sessions[s].keyframes;
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      for (const LoopCandidate& candidate : search.search(sessions[s], {s, k})) keep(candidate);
    }
  }

  Paths paths;
  for (const SessionData& session : sessions) paths.push_back(path_lengths_m(session));
  std::vector<LoopCandidate> all;
  for (const auto& [sessions_pair, pair] : by_pair) {
    std::vector<LoopCandidate> found;
    for (const auto& [keyframes, candidate] : pair) found.push_back(candidate);
    choose(found, config.max_candidates_per_pair, paths);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

PlaceSearch::PlaceSearch(const std::vector<SessionData>& sessions, std::size_t others)
    : database_(search_config_of(places_of(sessions), others, kCandidatesPerKeyframe),
                place_shape(sessions)) {
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const auto& keyframes = sessions[s].keyframes;
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      database_->insert(planes_.place(sessions[s], k), {s, k}, keyframes[k].T_odometry_keyframe);
    }
  }
}

std::vector<LoopCandidate> PlaceSearch::search(const SessionData& session, KeyframeId query) {
  std::map<std::size_t, std::uint32_t> kept;
  std::vector<LoopCandidate> found;
  for (const auto& candidate : database_->search(planes_.place(session, query.keyframe), query,
                                                 {SearchScope::Sessions::kOnlyOther, 0})) {
    if (++kept[candidate.match.session] > kCandidatesPerKeyframe) continue;
    found.push_back(candidate);
  }
  return found;
}

}  // namespace unimapper::merge
