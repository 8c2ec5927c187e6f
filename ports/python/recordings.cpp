#include "ports/python/recordings.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <optional>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"

namespace unimapper::python {
namespace {

using datasets::Dataset;
using datasets::OpenOptions;
using datasets::Scan;

datasets::Deskew deskew_named(const std::string& name) {
  if (name == "auto") return datasets::Deskew::kAuto;
  if (name == "on") return datasets::Deskew::kOn;
  if (name == "off") return datasets::Deskew::kOff;
  throw py::value_error("deskew: auto, on or off, not '" + name + "'");
}

std::unique_ptr<Recording> open_recording(const std::filesystem::path& path, OpenOptions options) {
  auto recording = std::make_unique<Recording>();
  const py::gil_scoped_release release;
  recording->dataset = datasets::open_dataset(path, options);
  return recording;
}

std::unique_ptr<RecordedScan> read_recorded(Recording& recording, std::int64_t index) {
  const Dataset& dataset = *recording.dataset;
  const std::size_t i = checked_index(index, dataset.scan_count(), "scans");
  auto read = std::make_unique<RecordedScan>();
  const py::gil_scoped_release release;
  const std::lock_guard lock(recording.mutex);
  dataset.read_scan(i, read->scan);
  read->T_odometry_sensor = dataset.pose(i);
  read->stamp_ns = dataset.stamp_ns(i);
  read->name = dataset.scan_name(i);
  return read;
}

py::array_t<std::uint32_t> read_truth_labels(Recording& recording, std::int64_t index) {
  const std::size_t i = checked_index(index, recording.dataset->scan_count(), "scans");
  std::vector<std::uint32_t> labels;
  {
    const py::gil_scoped_release release;
    const std::lock_guard lock(recording.mutex);
    labels = recording.dataset->labels(i);
  }
  return array_from(std::move(labels));
}

/// An array over the points of the scan, which `self` keeps.
py::array_t<float> points_array(const py::object& self) {
  const auto& points = self.cast<const RecordedScan&>().scan.points;
  constexpr py::ssize_t kFloat = sizeof(float);
  return view_of<float>({static_cast<py::ssize_t>(points.size()), 4}, {sizeof(Scan::Point), kFloat},
                        reinterpret_cast<const float*>(points.data()), self);
}

template <typename T>
py::object optional_array(const py::object& self, const std::vector<T>& values) {
  if (values.empty()) return py::none();
  return view_of<T>({static_cast<py::ssize_t>(values.size())}, {sizeof(T)}, values.data(), self);
}

void bind_scan(py::module_& module) {
  py::class_<RecordedScan>(module, "Scan", "One scan of a recording, in the LiDAR's frame.")
      .def_property_readonly("points", &points_array,
                             "(N, 4) float32: x, y, z in metres and intensity; not copied, read "
                             "only.")
      .def_property_readonly(
          "time_s",
          [](const py::object& self) {
            return optional_array(self, self.cast<const RecordedScan&>().scan.time_s);
          },
          "(N,) float32: seconds after the stamp, may be negative; None where unknown.")
      .def_property_readonly(
          "ring",
          [](const py::object& self) {
            return optional_array(self, self.cast<const RecordedScan&>().scan.ring);
          },
          "(N,) uint16: laser of each point; None where unknown.")
      .def_property_readonly(
          "T_odometry_sensor", [](const RecordedScan& s) { return array_of(s.T_odometry_sensor); },
          "(4, 4) float64, metres.")
      .def_readonly("stamp_ns", &RecordedScan::stamp_ns, "Nanoseconds.")
      .def_readonly("name", &RecordedScan::name, "Stem of its file.")
      .def("__len__", [](const RecordedScan& s) { return s.scan.points.size(); });
}

py::list notes_of(const Recording& recording) {
  py::list notes;
  for (const datasets::Note& note : recording.dataset->notes()) {
    notes.append((note.is_warning ? "warning: " : "") + note.text);
  }
  return notes;
}

void bind_dataset(py::module_& module) {
  py::class_<Recording>(module, "Dataset",
                        "A recording: `dataset[i]` reads scan i. Threads read one at a time.")
      .def("__len__", [](const Recording& r) { return r.dataset->scan_count(); })
      .def("__getitem__", &read_recorded, py::arg("index"))
      .def(
          "pose",
          [](const Recording& r, std::int64_t i) {
            return array_of(r.dataset->pose(checked_index(i, r.dataset->scan_count(), "scans")));
          },
          py::arg("index"), "T_odometry_sensor of a scan: (4, 4) float64, metres.")
      .def(
          "stamp_ns",
          [](const Recording& r, std::int64_t i) {
            return r.dataset->stamp_ns(checked_index(i, r.dataset->scan_count(), "scans"));
          },
          py::arg("index"), "Stamp of a scan, nanoseconds.")
      .def("labels", &read_truth_labels, py::arg("index"),
           "True labels of a scan: (N,) uint32 as SemanticKITTI numbers them; empty if none.")
      .def(
          "ground_truth_poses",
          [](const Recording& r) {
            const std::vector<Pose> poses = r.dataset->ground_truth_poses();
            return array_of(poses);
          },
          "T_world_sensor of every scan: (N, 4, 4) float64; empty if there are none.")
      .def_property_readonly(
          "sensor", [](const Recording& r) { return r.dataset->sensor(); },
          "The LiDAR where the format implies one, else empty.")
      .def_property_readonly(
          "has_poses", [](const Recording& r) { return r.dataset->has_poses(); },
          "Whether poses were recorded, or made by the own odometry.")
      .def_property_readonly("notes", &notes_of,
                             "What was chosen or may be wrong, one sentence each.");
}

py::tuple read_poses(const std::filesystem::path& file) {
  datasets::Trajectory read;
  {
    const py::gil_scoped_release release;
    read = datasets::parse_trajectory(datasets::read_text(file), file);
  }
  return py::make_tuple(array_from(std::move(read.stamps_ns)), array_of(read.poses));
}

}  // namespace

void bind_recordings(py::module_& module) {
  bind_scan(module);
  bind_dataset(module);
  module.def(
      "open_dataset",
      [](const std::filesystem::path& path, const std::string& format, const std::string& sensor,
         const std::string& sequence, const std::optional<std::filesystem::path>& poses,
         bool own_odometry, std::size_t most_scans, const std::string& topic,
         const std::string& odometry_topic, const std::string& imu_topic,
         const std::string& deskew) {
        OpenOptions options;
        options.format = format;
        options.sensor = sensor;
        options.sequence = sequence;
        if (poses) options.poses = *poses;
        options.own_odometry = own_odometry;
        options.most_scans = most_scans;
        options.topic = topic;
        options.odometry_topic = odometry_topic;
        options.imu_topic = imu_topic;
        options.deskew = deskew_named(deskew);
        return open_recording(path, options);
      },
      py::arg("path"), py::kw_only(), py::arg("format") = "auto", py::arg("sensor") = "",
      py::arg("sequence") = "", py::arg("poses") = py::none(), py::arg("own_odometry") = false,
      py::arg("most_scans") = 0, py::arg("topic") = "", py::arg("odometry_topic") = "",
      py::arg("imu_topic") = "", py::arg("deskew") = "auto",
      "Opens a folder or file of any format of docs/datasets.md; raises DatasetError.\n\n"
      "own_odometry: poses of the own odometry, also where others were recorded; it reads\n"
      "  all scans, or the first most_scans.\n"
      "poses: a pose file.  topic, odometry_topic, imu_topic (\"off\": none): in a bag.\n"
      "deskew: auto, on or off; whether points are moved to where they were at the stamp.");
  module.def("read_trajectory", &read_poses, py::arg("path"),
             "Stamps, (N,) int64 in ns (empty where the file has none), and poses, (N, 4, 4) "
             "float64,\nof a text file: TUM, KITTI or 4x4; raises DatasetError.");
}

}  // namespace unimapper::python
