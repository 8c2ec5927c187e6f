// Agreement of the sessions of a merged map, by pair.
#include "src/apps/report/pair_quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "src/apps/report.hpp"
#include "src/apps/report/format.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/session_clouds.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {
namespace {

using Cloud = std::vector<Eigen::Vector3f>;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPairs = 12;
constexpr std::size_t kMostPoints = 6'000'000;
constexpr std::size_t kMostQueries = 100'000;
constexpr float kSpacingM = 0.4F;
constexpr std::array<double, 2> kThresholdsM = {5.0, 0.5};

/// Pairs of sessions in the map with accepted inter-session loops, those with most of them first.
std::vector<std::pair<std::size_t, std::size_t>> connected_pairs(const merge::MergeResult& result) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> loops;
  for (const merge::LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted || loop.is_intra_session()) continue;
    const auto [first, second] = std::minmax(loop.query.session, loop.match.session);
    const bool in_map = merge::is_in_map(result.sessions[first].status) &&
                        merge::is_in_map(result.sessions[second].status);
    if (in_map) ++loops[{first, second}];
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  pairs.reserve(loops.size());
  for (const auto& [pair, count] : loops) pairs.push_back(pair);
  std::stable_sort(pairs.begin(), pairs.end(),
                   [&](const auto& a, const auto& b) { return loops.at(a) > loops.at(b); });
  pairs.resize(std::min(pairs.size(), kMostPairs));
  return pairs;
}

/// The session with the true poses of its keyframes; none where one is not known.
std::optional<merge::MergedSession> at_truth(const SessionData& session,
                                             const merge::MergedSession& merged,
                                             const std::vector<evaluate::StampedPose>& truth) {
  merge::MergedSession moved = merged;
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    const KeyframeRecord& keyframe = session.keyframes[k];
    const std::int64_t stamp_ns = keyframe.scans[keyframe.reference_scan].stamp_ns;
    const auto found = std::lower_bound(truth.begin(), truth.end(), stamp_ns,
                                        [](const evaluate::StampedPose& pose, std::int64_t stamp) {
                                          return pose.stamp_ns < stamp;
                                        });
    if (found == truth.end() || found->stamp_ns != stamp_ns) return std::nullopt;
    moved.T_map_keyframe[k] =
        found->T_world_sensor * merge::reference_sensor_pose(keyframe).inverse();
  }
  return moved;
}

/// Empty where a session has too many points to compare in seconds.
Cloud cloud_of(const SessionData& session, const merge::MergedSession& merged,
               const std::shared_ptr<merge::ScratchFile>& file) {
  const merge::ExternalVector<Eigen::Vector3f> cloud =
      session_cloud(session, merged, file, kSpacingM);
  if (cloud.size() > kMostPoints) return {};
  return {cloud.begin(), cloud.end()};
}

CloudQuality quality_of(const Cloud& first, const Cloud& second) {
  const auto agreements = evaluate::compare_clouds(first, second, kThresholdsM, kMostQueries);
  return {agreements[0], agreements[1], merge::wall_distance(first, second)};
}

double entropy_of(Cloud first, const Cloud& second) {
  first.insert(first.end(), second.begin(), second.end());
  evaluate::EntropyConfig config;
  config.radius_m = kThresholdsM[0];
  config.max_queries = 2'000;
  return evaluate::map_entropy(first, config).mean;
}

Json number(double value) {
  return std::isfinite(value) ? Json(std::round(value * 1e4) / 1e4) : Json(nullptr);
}

Json described(const CloudQuality& quality) {
  Json json;
  json["walls_median_m"] = number(quality.walls.median_m);
  json["walls_p90_m"] = number(quality.walls.p90_m);
  json["wall_points"] = quality.walls.points;
  json["AC_5m"] = number(quality.within_5m.ac_rmse_m);
  json["CD_5m"] = number(quality.within_5m.cd_l2_squared_m2);
  json["AC_0.5m"] = number(quality.within_05m.ac_rmse_m);
  json["CD_0.5m"] = number(quality.within_05m.cd_l2_squared_m2);
  return json;
}

/// Right merges have 0.10 to 0.19 m, mirrored courtyards that were taken for one 0.28 to 0.40 m
/// (docs/export.md).
constexpr double kWallsApartM = 0.24;
constexpr std::size_t kFewestWallPoints = 500;

bool has_walls_apart(const CloudQuality& quality) {
  return quality.walls.points >= kFewestWallPoints && quality.walls.p90_m > kWallsApartM;
}

std::string names_of(const std::vector<SessionData>& sessions, const PairQuality& pair) {
  return sessions[pair.first].info.name + " and " + sessions[pair.second].info.name;
}

std::vector<std::string> cells_of(const CloudQuality& quality) {
  return {fixed(quality.walls.median_m, 3), fixed(quality.walls.p90_m, 3),
          fixed(quality.within_05m.ac_rmse_m, 3), fixed(quality.within_5m.ac_rmse_m, 3),
          fixed(quality.within_5m.cd_l2_squared_m2, 3)};
}

}  // namespace

std::vector<PairQuality> pair_qualities(const std::vector<SessionData>& sessions,
                                        const merge::MergeResult& result,
                                        const std::vector<SessionReference>& references) {
  std::map<std::size_t, Cloud> clouds;
  std::map<std::size_t, Cloud> true_clouds;
  std::vector<PairQuality> qualities;
  for (const auto& [first, second] : connected_pairs(result)) {
    for (const std::size_t s : {first, second}) {
      if (clouds.contains(s)) continue;
      clouds[s] = cloud_of(sessions[s], result.sessions[s], result.map.file());
      if (s >= references.size()) continue;
      const auto moved = at_truth(sessions[s], result.sessions[s], references[s].truth);
      if (moved) true_clouds[s] = cloud_of(sessions[s], *moved, result.map.file());
    }
    PairQuality& pair = qualities.emplace_back();
    pair.first = first;
    pair.second = second;
    pair.merged = quality_of(clouds[first], clouds[second]);
    pair.entropy = entropy_of(clouds[first], clouds[second]);
    if (true_clouds.contains(first) && true_clouds.contains(second)) {
      pair.at_truth = quality_of(true_clouds[first], true_clouds[second]);
    }
  }
  return qualities;
}

void write_pair_qualities(const std::filesystem::path& path,
                          const std::vector<SessionData>& sessions,
                          const std::vector<PairQuality>& pairs) {
  Json all = Json::array();
  for (const PairQuality& pair : pairs) {
    Json json;
    json["first"] = sessions[pair.first].info.name;
    json["second"] = sessions[pair.second].info.name;
    json.update(described(pair.merged));
    json["MME_5m"] = number(pair.entropy);
    json["walls_apart"] = has_walls_apart(pair.merged);
    if (pair.at_truth) json["at_truth"] = described(*pair.at_truth);
    all.push_back(std::move(json));
  }
  std::ofstream out(path, std::ios::trunc);
  out << Json{{"pairs", all}}.dump(2) << '\n';
  out.close();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
}

std::string quality_section(const std::vector<SessionData>& sessions,
                            const std::vector<PairQuality>& pairs) {
  if (pairs.empty()) return {};
  Table table({"Sessions", "#Walls apart, median, m", "#nine in ten within, m", "#AC 0.5 m",
               "#AC 5 m", "#CD 5 m, m\u00b2", "#MME"});
  for (const PairQuality& pair : pairs) {
    std::vector<std::string> cells = cells_of(pair.merged);
    cells.insert(cells.begin(), escaped(names_of(sessions, pair)));
    cells.push_back(fixed(pair.entropy, 2));
    table.row(cells);
    if (!pair.at_truth) continue;
    cells = cells_of(*pair.at_truth);
    cells.insert(cells.begin(), "<span class=\"soft\">at the truth</span>");
    cells.emplace_back("");
    table.row(cells);
  }
  const std::string apart = walls_apart_text(sessions, pairs);
  return "<h2>Agreement of sessions</h2>\n" + table.html() +
         (apart.empty() ? "" : "<p class=\"bad\">" + escaped(apart) + "</p>\n") +
         "<p class=\"soft\">How far a point of one session lies from the wall of the other: that "
         "says how good a merge is where no truth is known. AC, CD and MME are the paper's; with "
         "its threshold of 5 m they measure what two LiDARs see in common more than how far off "
         "the merge is.</p>\n";
}

std::string walls_apart_text(const std::vector<SessionData>& sessions,
                             const std::vector<PairQuality>& pairs) {
  std::string text;
  for (const PairQuality& pair : pairs) {
    if (!has_walls_apart(pair.merged)) continue;
    text +=
        "the walls of " + names_of(sessions, pair) + " lie up to " +
        fixed(pair.merged.walls.p90_m, 2) +
        " m apart (nine in ten points), more than in a right merge: they may be two places that "
        "look alike; compare their scans in the report, `unimapper map apart` or `forbid` parts "
        "them\n";
  }
  return text;
}

void warn_of_walls_apart(const std::vector<SessionData>& sessions,
                         const std::vector<PairQuality>& pairs) {
  std::istringstream lines(walls_apart_text(sessions, pairs));
  for (std::string line; std::getline(lines, line);) {
    std::cerr << "unimapper: warning: " << line << '\n';
  }
}

std::string quality_lines(const std::vector<SessionData>& sessions,
                          const std::vector<PairQuality>& pairs) {
  std::string text;
  for (const PairQuality& pair : pairs) {
    text += names_of(sessions, pair) + ": walls " + fixed(pair.merged.walls.median_m, 3) +
            " m apart (median)";
    if (pair.at_truth) text += ", " + fixed(pair.at_truth->walls.median_m, 3) + " m at the truth";
    text += ", AC " + fixed(pair.merged.within_05m.ac_rmse_m, 3) + " m within 0.5 m\n";
  }
  return text;
}

}  // namespace unimapper::apps
