// Agreement of the sessions of a merged map, by pair.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "src/evaluate/map_quality.hpp"
#include "src/merge/placements/wall_distance.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

struct SessionReference;

/// How two clouds lie to each other.
struct CloudQuality {
  evaluate::CloudAgreement within_5m;   ///< agreement within 5 m, the paper's threshold
  evaluate::CloudAgreement within_05m;  ///< agreement within 0.5 m
  merge::WallDistance walls;
};

/// Two sessions of the map that loops connect.
struct PairQuality {
  std::size_t first = 0;   ///< index of the session
  std::size_t second = 0;  ///< index of the other one
  CloudQuality merged;     ///< where the merge puts them
  /// Where the ground truth puts them: what the two LiDARs see differently, and no merge betters.
  std::optional<CloudQuality> at_truth;
  double entropy = std::numeric_limits<double>::quiet_NaN();  ///< MME of both, 5 m, nats
};

/// Of the twelve pairs with most accepted loops, from static points 0.4 m apart. Figures are NaN
/// where a session has more than six million. O(n log n) a pair, twice with ground truth.
/// `references`: one per session, or none.
[[nodiscard]] std::vector<PairQuality> pair_qualities(
    const std::vector<SessionData>& sessions, const merge::MergeResult& result,
    const std::vector<SessionReference>& references);

/// Writes quality.json (docs/export.md). Throws std::runtime_error naming `path`.
void write_pair_qualities(const std::filesystem::path& path,
                          const std::vector<SessionData>& sessions,
                          const std::vector<PairQuality>& pairs);

/// The section of a report; empty without pairs.
[[nodiscard]] std::string quality_section(const std::vector<SessionData>& sessions,
                                          const std::vector<PairQuality>& pairs);

/// Pairs whose walls lie too far apart for a right merge, in words, a line each; empty where there
/// is none. Two places that look alike are merged so, or a place that was rebuilt.
[[nodiscard]] std::string walls_apart_text(const std::vector<SessionData>& sessions,
                                           const std::vector<PairQuality>& pairs);

/// Says the same on stderr.
void warn_of_walls_apart(const std::vector<SessionData>& sessions,
                         const std::vector<PairQuality>& pairs);

/// A line a pair for a terminal.
[[nodiscard]] std::string quality_lines(const std::vector<SessionData>& sessions,
                                        const std::vector<PairQuality>& pairs);

}  // namespace unimapper::apps
