// Merging and stored maps in Python.
#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <memory>
#include <utility>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"
#include "ports/python/sessions.hpp"
#include "src/apps/map/site_system.hpp"
#include "src/apps/map/stored_map.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::python {
namespace {

using Progress = std::function<void(const std::string&)>;

/// A map with the sessions it is of.
struct MergedMap {
  std::vector<SessionData> sessions;
  merge::MergeResult result;
  std::string crs;  ///< of the store that it is from; empty: not said
};

std::unique_ptr<MergedMap> merge_map(const std::vector<const Session*>& sessions,
                                     merge::MergeConfig config, const Progress& progress) {
  // A copy: the configuration is other threads' to change without the GIL.
  require_ok(config.validate());
  auto map = std::make_unique<MergedMap>();
  std::vector<SessionData*> all;
  std::vector<bool> is_prepared;  // the list is another thread's to change without the GIL
  for (const Session* session : sessions) {
    if (session == nullptr) throw py::type_error("sessions: None is no session");
    map->sessions.push_back(session->data);
    is_prepared.push_back(session->is_prepared);
  }
  const py::gil_scoped_release release;
  for (std::size_t i = 0; i < is_prepared.size(); ++i) {
    if (!is_prepared[i]) (void)apps::prepare_session(map->sessions[i]);
    all.push_back(&map->sessions[i]);
  }
  apps::tell_names_apart(all);
  map->result = merge::merge_sessions(map->sessions, config, progress);
  return map;
}

std::unique_ptr<MergedMap> read_map(const std::filesystem::path& store, std::int64_t epoch,
                                    const Progress& progress) {
  if (epoch < 0) throw py::value_error("epoch: its number, or 0 for the latest");
  auto map = std::make_unique<MergedMap>();
  const py::gil_scoped_release release;
  apps::StoredContents contents(merge::MergeConfig{}.kept_bytes());
  apps::StoredMap stored = apps::read_stored_map(store, epoch, &contents);
  map->crs = std::move(stored.crs);
  map->sessions = std::move(stored.sessions);
  map->result =
      merge::complete_merge(map->sessions, std::move(stored.posed), stored.config, progress);
  return map;
}

py::array_t<float> map_points(const MergedMap& map) {
  std::vector<Eigen::Vector3f> points;
  for (const merge::MapPoint& point : map.result.map) points.push_back(point.position);
  return array_from(std::move(points));
}

/// What `number` says of each point.
template <typename Number>
py::array_t<std::uint32_t> map_numbers(const MergedMap& map, const Number& number) {
  std::vector<std::uint32_t> numbers;
  for (const merge::MapPoint& point : map.result.map) numbers.push_back(number(point));
  return array_from(std::move(numbers));
}

py::array_t<std::uint32_t> point_sessions(const MergedMap& map) {
  return map_numbers(map, [](const merge::MapPoint& point) { return point.session; });
}

py::array_t<std::uint32_t> sessions_seen(const MergedMap& map) {
  return map_numbers(map, [](const merge::MapPoint& point) { return point.sessions_seen; });
}

py::array_t<std::uint32_t> intensities(const MergedMap& map) {
  return map_numbers(map, [](const merge::MapPoint& point) { return point.intensity; });
}

py::array_t<float> dynamic_points(const MergedMap& map) {
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& point : map.result.dynamic_points) points.push_back(point);
  return array_from(std::move(points));
}

py::list sessions_list(const MergedMap& map) {
  py::list list;
  for (std::size_t s = 0; s < map.sessions.size(); ++s) {
    const merge::MergedSession& merged = map.result.sessions[s];
    py::dict session;
    session["name"] = map.sessions[s].info.name;
    session["status"] = merge::status_name(merged.status);
    session["reason"] = merged.reason;
    session["T_map_session"] = array_of(merged.T_map_session);
    session["T_map_keyframe"] = array_of(merged.T_map_keyframe);
    list.append(session);
  }
  return list;
}

py::list loops_list(const MergedMap& map) {
  py::list list;
  for (const merge::LoopConstraint& constraint : map.result.loops) {
    py::dict loop;
    loop["query"] = py::make_tuple(constraint.query.session, constraint.query.keyframe);
    loop["match"] = py::make_tuple(constraint.match.session, constraint.match.keyframe);
    loop["T_match_query"] = array_of(constraint.T_match_query);
    loop["overlap"] = constraint.overlap;
    loop["accepted"] = constraint.decision.accepted;
    loop["reason"] = constraint.decision.reason;
    list.append(loop);
  }
  return list;
}

py::list changed_objects(const MergedMap& map) {
  py::list list;
  for (const merge::ChangedObject& object : map.result.changed_objects) {
    py::dict change;
    change["kind"] = kind_name(object.kind);
    change["session"] = object.session;
    change["free_in"] = object.free_in;
    change["T_map_box"] = array_of(object.box.pose());
    change["size_m"] = py::array_t<double>(3, object.box.size.data());
    change["confidence"] = object.confidence;
    list.append(change);
  }
  return list;
}

py::tuple trajectory_of(const MergedMap& map, std::int64_t session) {
  const std::size_t s = checked_index(session, map.sessions.size(), "sessions");
  std::vector<std::int64_t> stamps_ns;
  std::vector<Pose> poses;
  for (const merge::TrajectoryPose& pose :
       merge::session_trajectory(map.sessions[s], map.result.sessions[s])) {
    stamps_ns.push_back(pose.stamp_ns);
    poses.push_back(pose.T_map_sensor);
  }
  return py::make_tuple(array_from(std::move(stamps_ns)), array_of(poses));
}

/// Without a position of x and y the map is in no system, whatever was said.
std::string system_of(const MergedMap& map) {
  const auto& place = map.result.georeference;
  return place && place->is_horizontal ? map.crs : std::string();
}

py::object origin_of(const MergedMap& map) {
  const auto& place = map.result.georeference;
  return place ? py::object(py::array_t<double>(3, place->origin.data())) : py::none();
}

void export_to(const MergedMap& map, const std::filesystem::path& folder, bool las,
               const std::string& crs) {
  const py::gil_scoped_release release;
  merge::ExportOptions options;
  options.las = las;
  options.crs.name = crs.empty() ? system_of(map) : crs;
  if (!options.crs.name.empty()) options.crs = apps::Projection(options.crs.name).system();
  (void)merge::export_map(folder, map.sessions, map.result, options);
}

void state_system(const std::filesystem::path& store, const std::string& crs) {
  const py::gil_scoped_release release;
  (void)apps::state_system(store, crs);
}

void bind_map(py::module_& module) {
  py::class_<MergedMap>(module, "MergedMap",
                        "Sessions in one frame, in metres. Methods return new arrays and lists.")
      .def("points", &map_points, "The unified map's static points: (N, 3) float32.")
      .def("point_sessions", &point_sessions,
           "Index of the first session that saw each point: (N,) uint32.")
      .def("sessions_seen", &sessions_seen, "How many sessions saw each point: (N,) uint32.")
      .def("intensities", &intensities,
           "Mean intensity of each point, from 1; 0: not known: (N,) uint32.")
      .def("dynamic_points", &dynamic_points, "Removed points: (N, 3) float32.")
      .def("sessions", &sessions_list,
           "Dicts by session: name, status (central, merged, provisional or unconnected), reason,\n"
           "T_map_session (4, 4) and T_map_keyframe (N, 4, 4).")
      .def("loops", &loops_list,
           "All loops considered: query and match as (session, keyframe), T_match_query (4, 4),\n"
           "overlap, accepted and reason.")
      .def("changed_objects", &changed_objects,
           "What appeared, is gone or moved: kind, session, free_in, T_map_box, size_m, "
           "confidence.")
      .def("trajectory", &trajectory_of, py::arg("session"),
           "Stamps, (N,) int64 in ns, and T_map_sensor, (N, 4, 4), of every scan of a session; "
           "of one that\nis not in the map in its own frame.")
      .def_property_readonly(
          "central_session", [](const MergedMap& m) { return m.result.central_session; },
          "Index of the session whose frame is the map's.")
      .def_property_readonly("crs", &system_of,
                             "Coordinate system of the site, if a store says it and a position "
                             "places the map in it; else \"\".")
      .def_property_readonly("origin", &origin_of,
                             "A point plus this, (3,) in metres, is in the site's frame. None "
                             "where no position is known.")
      .def("export", &export_to, py::arg("folder"), py::arg("las") = false, py::arg("crs") = "",
           "Writes map.ply, trajectories, loops.csv and what else docs/export.md names, with `las` "
           "map.las.\ncrs: the coordinate system that they name instead of that of the store.");
}

}  // namespace

void bind_merge(py::module_& module) {
  bind_sessions(module);
  bind_map(module);
  module.def("merge_sessions", &merge_map, py::arg("sessions"),
             py::arg("config") = merge::MergeConfig{}, py::arg("progress") = Progress{},
             "Merges sessions into one `MergedMap`; the same sessions give the same map.\n\n"
             "sessions: a list of `Session`, which are copied. progress: called with a sentence "
             "each;\nwhat it raises ends the merge.");
  module.def("read_map", &read_map, py::arg("store"), py::arg("epoch") = 0,
             py::arg("progress") = Progress{},
             "The map that `unimapper map merge` or `unimapper base --merge` has put into a store, "
             "as a\n`MergedMap`. epoch: its number; 0: the latest.");
  module.def("state_crs", &state_system, py::arg("store"), py::arg("crs"),
             "States which coordinate system a store's positions are in, as `unimapper map crs`.\n"
             "crs: \"EPSG:25832\", a name or WKT of PROJ; east and north in metres.");
}

}  // namespace unimapper::python
