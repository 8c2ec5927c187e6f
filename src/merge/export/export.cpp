// Export of a merged map: folder, summary and timing.
#include "unimapper/merge/export.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "export_files.hpp"
#include "src/merge/graph/site_origin.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {

const char* status_name(SessionStatus status) {
  switch (status) {
    case SessionStatus::kCentral:
      return "central";
    case SessionStatus::kMerged:
      return "merged";
    case SessionStatus::kProvisional:
      return "provisional";
    case SessionStatus::kUnconnected:
      break;
  }
  return "unconnected";
}

const char* state_name(PairState state) {
  switch (state) {
    case PairState::kConfirmed:
      return "confirmed";
    case PairState::kProvisional:
      return "provisional";
    case PairState::kRefused:
      break;
  }
  return "refused";
}

namespace {

/// Names come from files and networks: what cannot be UTF-8 must not stop the export.
std::string dump(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

nlohmann::ordered_json session_summary(const SessionData& session, const MergedSession& merged) {
  std::uint64_t points_in = 0;
  std::uint64_t points_dynamic = 0;
  std::uint64_t up_known = 0;
  std::uint64_t contradicted = 0;
  for (const auto& keyframe : session.keyframes) {
    up_known += keyframe.up.known ? 1 : 0;
    contradicted += keyframe.odometry_contradicted ? 1 : 0;
    points_in += keyframe.points_in;
    points_dynamic += keyframe.points_dynamic;
  }
  nlohmann::ordered_json json;
  json["name"] = session.info.name;
  json["status"] = status_name(merged.status);
  json["keyframes"] = session.keyframes.size();
  json["keyframes_up_known"] = up_known;
  json["keyframes_odometry_contradicted"] = contradicted;
  json["sensor"] = session.info.sensor;
  json["complete"] = session.complete;
  json["keyframes_missing"] = session.keyframes_missing;
  json["keyframes_by_summary"] = std::count_if(session.keyframes.begin(), session.keyframes.end(),
                                               [](const auto& k) { return k.is_summary; });
  json["keyframes_damaged"] = session.keyframes_damaged;
  json["points_in"] = points_in;
  json["points_dynamic"] = points_dynamic;
  if (!merged.reason.empty()) json["reason"] = merged.reason;
  return json;
}

/// Pairs of sessions with inter-session loops; a provisional one with its proposed placement.
nlohmann::ordered_json pair_summaries(const std::vector<SessionData>& sessions,
                                      const MergeResult& result) {
  nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
  for (const PairOutcome& pair : result.pairs) {
    nlohmann::ordered_json json;
    json["match"] = sessions[pair.match].info.name;
    json["query"] = sessions[pair.query].info.name;
    json["state"] = state_name(pair.state);
    if (!pair.reason.empty()) json["reason"] = pair.reason;
    json["loops_verified"] = pair.loops;
    json["loops_consistent"] = pair.distinct;
    json["loops_competing"] = pair.competing;
    if (pair.state == PairState::kProvisional) {
      const Pose& T = pair.T_match_session_query_session;
      const Eigen::Quaterniond q = T.quaternion();
      json["T_match_query"] = {
          {"translation", {T.translation.x(), T.translation.y(), T.translation.z()}},
          {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
    }
    pairs.push_back(std::move(json));
  }
  return pairs;
}

nlohmann::ordered_json describe(const UprightBox& box) {
  return {{"centre", {box.centre.x(), box.centre.y(), box.centre.z()}},
          {"yaw", box.yaw_rad},
          {"size", {box.size.x(), box.size.y(), box.size.z()}}};
}

/// Where the map lies in the site frame.
nlohmann::ordered_json georeference_summary(const MergeResult& result,
                                            const CoordinateSystem& crs) {
  const Georeference& georeference = *result.georeference;
  const Eigen::Vector3d& origin = georeference.origin;
  nlohmann::ordered_json json;
  if (!crs.name.empty()) json["crs"] = crs.name;
  json["origin"] = {origin.x(), origin.y(), origin.z()};
  json["horizontal"] = georeference.is_horizontal;
  json["heading_sigma_rad"] = nullptr;
  if (std::isfinite(georeference.heading_sigma_rad)) {
    json["heading_sigma_rad"] = georeference.heading_sigma_rad;
  }
  json["positions_used"] =
      std::count_if(result.positions.begin(), result.positions.end(),
                    [](const PositionOutcome& position) { return position.used; });
  json["positions_known"] = result.positions.size();
  return json;
}

bool is_in_box(const Eigen::Vector3d& point, const ExportOptions& options) {
  const auto p = point.array();
  return !options.box ||
         ((p >= options.box->low.array()).all() && (p <= options.box->high.array()).all());
}

const Eigen::Vector3f& position_of(const Eigen::Vector3f& point) { return point; }
template <typename Point>
const Eigen::Vector3f& position_of(const Point& point) {
  return point.position;
}

template <typename Point>
std::vector<Point> empty_like(const std::vector<Point>& /*points*/) {
  return {};
}
/// In the same file.
template <typename Point>
ExternalVector<Point> empty_like(const ExternalVector<Point>& points) {
  return ExternalVector<Point>(points.file());
}

/// Points in the box; of the map, the first of each voxel.
template <typename Points>
Points chosen_points(const Points& points, const ExportOptions& options) {
  using Point = typename Points::value_type;
  const bool thins = std::is_same_v<Point, MapPoint> && options.voxel_m > 0.0;
  const auto inverse = static_cast<float>(thins ? 1.0 / options.voxel_m : 0.0);
  if (!options.box && !thins) return points;
  VoxelTable voxels;
  Points chosen = empty_like(points);
  for (const Point& point : points) {
    if (!is_in_box(position_of(point).template cast<double>(), options)) continue;
    if (thins) {
      const std::size_t before = voxels.size();
      voxels.find_or_insert(pack(voxel_index(position_of(point), inverse)));
      if (voxels.size() == before) continue;
    }
    chosen.push_back(point);
  }
  return chosen;
}

}  // namespace

void write_summary(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                   const MergeResult& result, const CoordinateSystem& crs) {
  nlohmann::ordered_json json;
  json["sessions"] = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    json["sessions"].push_back(session_summary(sessions[s], result.sessions[s]));
    const Eigen::Vector3d origin = trajectory_origin(sessions, result, s);
    if (origin.isZero()) continue;
    json["sessions"].back()["origin"] = {origin.x(), origin.y(), origin.z()};
  }
  json["pairs"] = pair_summaries(sessions, result);
  if (result.georeference) json["georeference"] = georeference_summary(result, crs);
  std::size_t intra = 0;
  std::size_t inter = 0;
  std::size_t rejected = 0;
  std::map<std::string, std::size_t> by_origin;
  for (const auto& loop : result.loops) {
    if (!loop.decision.accepted) {
      ++rejected;
      continue;
    }
    ++(loop.is_intra_session() ? intra : inter);
    ++by_origin[loop.decision.reason];
  }
  json["loops"] = {{"intra", intra}, {"inter", inter}, {"rejected", rejected}};
  for (const auto& [origin, count] : by_origin) json["loops"]["by_" + origin] = count;
  std::size_t shared = 0;
  for (const auto& point : result.map) shared += point.sessions_seen > 1 ? 1 : 0;
  json["map"] = {{"points", result.map.size()}, {"seen_by_several_sessions", shared}};
  const auto appeared = static_cast<std::size_t>(
      std::count_if(result.changes.begin(), result.changes.end(),
                    [](const ChangedPoint& point) { return point.appeared; }));
  json["changes"] = {{"appeared", appeared}, {"gone", result.changes.size() - appeared}};
  for (const ChangeKind kind : kChangeKinds) {
    json["changed_objects"][kind_name(kind)] =
        std::count_if(result.changed_objects.begin(), result.changed_objects.end(),
                      [kind](const ChangedObject& object) { return object.kind == kind; });
  }
  OutputFile file(path);
  file.stream() << dump(json);
  file.close();
}

void write_changed_objects(const std::filesystem::path& path,
                           const std::vector<SessionData>& sessions, const MergeResult& result,
                           const ExportOptions& options) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < result.changed_objects.size(); ++i) {
    const ChangedObject& object = result.changed_objects[i];
    if (!is_in_box(object.box.centre, options)) continue;
    nlohmann::ordered_json json = {{"object", i},
                                   {"kind", kind_name(object.kind)},
                                   {"session", sessions[object.session].info.name},
                                   {"free_in", sessions[object.free_in].info.name},
                                   {"box", describe(object.box)}};
    if (object.before) json["before"] = describe(*object.before);
    json["voxels"] = object.voxels;
    json["confidence"] = object.confidence;
    json["seen_through"] = object.seen_through;
    objects.push_back(std::move(json));
  }
  OutputFile file(path);
  file.stream() << dump({{"objects", std::move(objects)}});
  file.close();
}

void write_georeference(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                        const MergeResult& result, const CoordinateSystem& crs) {
  nlohmann::ordered_json json;
  if (result.georeference) json = georeference_summary(result, crs);
  json["positions"] = nlohmann::ordered_json::array();
  for (const PositionOutcome& position : result.positions) {
    const KnownPosition& given = position.given;
    const SessionData& session = sessions[given.keyframe.session];
    nlohmann::ordered_json one;
    one["keyframe"] = session.info.name + ":" +
                      std::to_string(session.keyframes[given.keyframe.keyframe].sequence);
    one["used"] = position.used;
    if (!position.used) one["reason"] = position.reason;
    const Eigen::Vector3d& off = position.residual_m;
    if (position.used && given.is_horizontal()) one["residual_m"] = {off.x(), off.y(), off.z()};
    if (position.used && !given.is_horizontal()) one["residual_z_m"] = off.z();
    json["positions"].push_back(std::move(one));
  }
  OutputFile file(path);
  file.stream() << dump(json);
  file.close();
}

void write_timing(const std::filesystem::path& path, const MergeResult& result) {
  nlohmann::ordered_json json;
  for (const auto& stage : result.timing) json[stage.stage] = stage.seconds;
  OutputFile file(path);
  file.stream() << dump(json);
  file.close();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
}

std::optional<NavigationGrid> export_map(const std::filesystem::path& folder,
                                         const std::vector<SessionData>& sessions,
                                         const MergeResult& result, const ExportOptions& options) {
  if (!options.crs.name.empty() && !(result.georeference && result.georeference->is_horizontal)) {
    throw std::runtime_error("no known position of x and y places the map in " + options.crs.name);
  }
  make_folder(folder / "trajectories");
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const bool connected = is_in_map(result.sessions[s].status);
    const auto trajectories = folder / (connected ? "trajectories" : "unconnected");
    make_folder(trajectories);
    write_trajectory(trajectories / (sessions[s].info.name + ".tum"),
                     trajectory_origin(sessions, result, s), sessions[s], result.sessions[s]);
  }
  write_pose_graph(folder / "graph.g2o", sessions, result);
  write_loops(folder / "loops.csv", sessions, result);
  const ExternalVector<MapPoint> points = chosen_points(result.map, options);
  write_map_points(folder / "map.ply", points);
  const LasFrame las{map_offset(sessions, result), options.crs.wkt, last_stamp_ns(sessions)};
  if (options.las) write_las(folder / "map.las", points, las);
  if (options.tile_m > 0.0) {
    write_tiles(folder / "tiles", points, options.tile_m, options.las ? &las : nullptr);
  }
  write_changed_points(folder / "changes.ply", chosen_points(result.changes, options));
  write_changed_objects(folder / "changes.json", sessions, result, options);
  write_positions(folder / "removed.ply", chosen_points(result.dynamic_points, options));
  std::optional<NavigationGrid> grid;
  if (options.grid) {
    grid = navigation_grid(sessions, result, *options.grid);
    write_grid(folder, "grid", *grid);
  }
  write_summary(folder / "summary.json", sessions, result, options.crs);
  if (!result.positions.empty()) {
    write_georeference(folder / "georeference.json", sessions, result, options.crs);
  }
  write_timing(folder / "timing.json", result);
  return grid;
}

}  // namespace unimapper::merge
