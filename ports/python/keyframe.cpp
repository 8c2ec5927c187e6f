#include "ports/python/keyframe.hpp"

#include <pybind11/stl.h>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"

namespace unimapper::python {

Keyframe::Keyframe(const KeyframeView& view)
    : content(view),
      scans(view.scans.begin(), view.scans.end()),
      static_cells(view.static_cells.begin(), view.static_cells.end()),
      dynamic_cells(view.dynamic_cells.begin(), view.dynamic_cells.end()),
      loops(view.loops.begin(), view.loops.end()),
      place(view.place) {
  if (view.statistics != nullptr) statistics = *view.statistics;
  content.scans = {};
  content.static_cells = content.dynamic_cells = {};
  content.images = {};
  content.place = {};
  content.loops = {};
  content.statistics = nullptr;
}

namespace {

/// A vector of each element, (N, 3) float32, in the memory of `owner`.
template <typename Element>
py::array_t<float> vectors(const std::vector<Element>& elements, Eigen::Vector3f Element::*member,
                           const py::object& owner) {
  const float* const first = elements.empty() ? nullptr : (elements.front().*member).data();
  return view_of<float>({static_cast<py::ssize_t>(elements.size()), 3},
                        {sizeof(Element), sizeof(float)}, first, owner);
}

template <auto Cells>
py::array_t<float> cell_positions(const py::object& self) {
  return vectors(self.cast<const Keyframe&>().*Cells, &FineCell::position, self);
}

/// One byte of every static cell.
template <auto Member>
py::array_t<std::uint8_t> cell_bytes(const py::object& self) {
  const auto& cells = self.cast<const Keyframe&>().static_cells;
  return view_of<std::uint8_t>({static_cast<py::ssize_t>(cells.size())}, {sizeof(FineCell)},
                               cells.empty() ? nullptr : &(cells.front().*Member), self);
}

/// One number of every scan.
template <auto Member>
auto scan_numbers(const Keyframe& keyframe) {
  std::vector<std::remove_cvref_t<decltype(keyframe.scans.front().*Member)>> numbers;
  for (const KeyframeScan& scan : keyframe.scans) numbers.push_back(scan.*Member);
  return array_from(std::move(numbers));
}

py::array_t<double> scan_poses(const Keyframe& keyframe) {
  std::vector<Pose> poses;
  for (const KeyframeScan& scan : keyframe.scans) poses.push_back(scan.T_odometry_sensor);
  return array_of(poses);
}

py::dict keyframe_counts(const Keyframe& keyframe) {
  const KeyframeStatistics& s = keyframe.statistics;
  py::dict result;
  result["points_in"] = s.points_in;
  result["points_valid"] = s.points_valid;
  result["points_static"] = s.points_static;
  result["points_dynamic"] = s.points_dynamic;
  result["cells"] = s.cells;
  result["dynamic_cells"] = s.dynamic_cells;
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    const std::string name(drop_cause_name(static_cast<DropCause>(i)));
    result[("dropped_" + name).c_str()] = s.dropped[i];
  }
  for (std::size_t i = 0; i < kStages; ++i) {
    const std::string name(stage_name(static_cast<Stage>(i)));
    result[(name + "_us").c_str()] = s.stage_us[i];
  }
  return result;
}

py::tuple id_tuple(const KeyframeId& id) { return py::make_tuple(id.session, id.keyframe); }

void bind_place_class(py::module_& module) {
  py::class_<Place>(module, "Place", "What loop search knows of a place, in a level frame, metres.")
      .def_property_readonly(
          "keypoints",
          [](const py::object& self) {
            return vectors(self.cast<const Place&>().keypoints, &Keypoint::position, self);
          },
          "(N, 3) float32, metres; not copied.")
      .def_property_readonly(
          "keypoint_normals",
          [](const py::object& self) {
            return vectors(self.cast<const Place&>().keypoints, &Keypoint::normal, self);
          },
          "(N, 3) float32, unit length; not copied.")
      .def_property_readonly(
          "planes",
          [](const py::object& self) {
            return vectors(self.cast<const Place&>().planes, &PlanePatch::center, self);
          },
          "Centres of planar voxels: (N, 3) float32, metres; not copied.");
  py::class_<LoopCandidate>(module, "LoopCandidate", "Two keyframes that may show one place.")
      .def_property_readonly(
          "query", [](const LoopCandidate& c) { return id_tuple(c.query); },
          "(session, keyframe) that was searched for.")
      .def_property_readonly(
          "match", [](const LoopCandidate& c) { return id_tuple(c.match); },
          "(session, keyframe) that was found.")
      .def_readonly("confidence", &LoopCandidate::confidence, "Probability, [0, 1].")
      .def_readonly("accepted", &LoopCandidate::accepted, "Whether it reaches the threshold.")
      .def_readonly("plane_overlap", &LoopCandidate::plane_overlap, "Share of planes, [0, 1].")
      .def_property_readonly(
          "T_match_query", [](const LoopCandidate& c) { return array_of(c.T_match_query); },
          "Between the two level frames: (4, 4) float64, metres.");
}

}  // namespace

void bind_keyframe(py::module_& module) {
  bind_place_class(module);
  py::class_<Keyframe>(module, "Keyframe",
                       "A keyframe, copied out of the pipeline: it stays as it is. Cells are in "
                       "its level\nframe (z up, origin at the sensor), metres.")
      .def_property_readonly(
          "sequence", [](const Keyframe& k) { return k.content.sequence; },
          "Running number, from 0.")
      .def_property_readonly(
          "repeats", [](const Keyframe& k) { return k.content.repeats; },
          "The robot stands and sees nothing new: never finished.")
      .def_property_readonly(
          "T_odometry_keyframe",
          [](const Keyframe& k) { return array_of(k.content.T_odometry_keyframe); },
          "(4, 4) float64, metres.")
      .def_property_readonly("scan_indices", &scan_numbers<&KeyframeScan::scan_index>,
                             "Running numbers of its scans, refused ones counted: (N,) uint32.")
      .def_property_readonly("stamps_ns", &scan_numbers<&KeyframeScan::stamp_ns>,
                             "(N,) int64, nanoseconds.")
      .def_property_readonly("T_odometry_sensor", &scan_poses,
                             "Poses of its scans: (N, 4, 4) float64, metres.")
      .def_property_readonly(
          "cell_size_m", [](const Keyframe& k) { return k.content.cell_size_m; },
          "Edge of the cells.")
      .def_property_readonly("static_cells", &cell_positions<&Keyframe::static_cells>,
                             "(N, 3) float32; a view of this keyframe.")
      .def_property_readonly("dynamic_cells", &cell_positions<&Keyframe::dynamic_cells>,
                             "(N, 3) float32; a view of this keyframe.")
      .def_property_readonly("ground", &cell_bytes<&FineCell::ground>,
                             "1 for static cells of the ground: (N,) uint8; a view.")
      .def_property_readonly("intensities", &cell_bytes<&FineCell::intensity>,
                             "Of static cells, from 1; 0: not known: (N,) uint8; a view.")
      .def_readonly("place", &Keyframe::place, "Its description; empty until it is finished.")
      .def_readonly("loops", &Keyframe::loops, "Earlier keyframes that look alike, best first.")
      .def_property_readonly("statistics", &keyframe_counts,
                             "Counts, points dropped by cause, and microseconds by stage.");
}

}  // namespace unimapper::python
