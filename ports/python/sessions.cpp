#include "ports/python/sessions.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <memory>
#include <stdexcept>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::python {
namespace {

void add_keyframe(Session& session, const py::bytes& bytes) {
  if (session.is_prepared) throw py::value_error("keyframes of a session that was read are fixed");
  char* data = nullptr;
  py::ssize_t size = 0;
  if (PyBytes_AsStringAndSize(bytes.ptr(), &data, &size) != 0) throw py::error_already_set();
  wire::DecodedKeyframe decoded = wire::decode_keyframe(
      {reinterpret_cast<const std::uint8_t*>(data), static_cast<std::size_t>(size)});
  if (!decoded.record) throw py::value_error(decoded.error);
  std::vector<KeyframeRecord>& keyframes = session.data.keyframes;
  if (decoded.record->session != session.data.info.id) {
    throw py::value_error("the keyframe is of another session: its robot and boot differ");
  }
  if (!keyframes.empty() && decoded.record->sequence <= keyframes.back().sequence) {
    throw py::value_error("keyframes are added in ascending sequence");
  }
  keyframes.push_back(std::move(*decoded.record));
}

std::unique_ptr<Session> make_session(const std::string& name, const std::string& sensor,
                                      std::uint32_t robot, std::uint64_t boot) {
  auto session = std::make_unique<Session>();
  session->data.info = {{robot, boot}, name, sensor};
  session->data.complete = true;
  return session;
}

std::vector<std::unique_ptr<Session>> read_runs(const std::vector<std::filesystem::path>& runs,
                                                const std::vector<std::string>& names) {
  apps::MergeOptions options;
  options.runs = runs;
  options.chosen = names;
  apps::StoredContents contents(merge::MergeConfig{}.kept_bytes());
  std::vector<std::unique_ptr<Session>> sessions;
  const py::gil_scoped_release release;
  for (apps::InputSession& input :
       apps::gather_sessions(options, contents, std::filesystem::temp_directory_path())) {
    sessions.push_back(std::make_unique<Session>(Session{std::move(input.data), true}));
  }
  return sessions;
}

/// Cells of a keyframe, read where they are not in memory.
template <auto Cells>
py::array_t<float> cells_of(const Session& session, std::int64_t index) {
  const std::size_t k = checked_index(index, session.data.keyframes.size(), "keyframes");
  std::vector<Eigen::Vector3f> positions;
  for (const FineCell& cell : (*whole_keyframe(session.data, k)).*Cells) {
    positions.push_back(cell.position);
  }
  return array_from(std::move(positions));
}

py::array_t<double> keyframe_poses(const Session& session) {
  std::vector<Pose> poses;
  for (const KeyframeRecord& keyframe : session.data.keyframes) {
    poses.push_back(keyframe.T_odometry_keyframe);
  }
  return array_of(poses);
}

}  // namespace

void bind_sessions(py::module_& module) {
  py::class_<Session>(module, "Session", "Keyframes of one start of a robot, to be merged.")
      .def(py::init(&make_session), py::arg("name"), py::arg("sensor") = "", py::arg("robot") = 0,
           py::arg("boot") = 0,
           "robot, boot: as given to `Pipeline.encode`; each start of a robot has another boot.")
      .def("add_keyframe", &add_keyframe, py::arg("encoded"),
           "Adds a keyframe of `Pipeline.encode`, in ascending sequence; others are a ValueError.")
      .def_property_readonly("name", [](const Session& s) { return s.data.info.name; })
      .def_property_readonly("sensor", [](const Session& s) { return s.data.info.sensor; })
      .def_property_readonly(
          "keyframes_missing", [](const Session& s) { return s.data.keyframes_missing; },
          "Keyframes that were made and are not there.")
      .def("__len__", [](const Session& s) { return s.data.keyframes.size(); })
      .def_property_readonly("T_odometry_keyframe", &keyframe_poses,
                             "Of every keyframe: (N, 4, 4) float64, metres.")
      .def("static_cells", &cells_of<&KeyframeRecord::static_cells>, py::arg("keyframe"),
           "(N, 3) float32, metres in the keyframe's level frame; a copy.")
      .def("dynamic_cells", &cells_of<&KeyframeRecord::dynamic_cells>, py::arg("keyframe"),
           "(N, 3) float32, metres in the keyframe's level frame; a copy.");
  module.def("read_sessions", &read_runs, py::arg("runs"),
             py::arg("sessions") = std::vector<std::string>{},
             "Sessions of run folders, event logs and stores, as `unimapper merge` reads them: "
             "sorted by name.\n\n"
             "runs: paths.  sessions: of stores only those of these names.\n"
             "Damage is said on stderr, and what is whole is kept. Cells are read on demand.");
}

}  // namespace unimapper::python
