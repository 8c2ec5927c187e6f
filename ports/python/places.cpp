// Description of places and search among them, in Python.
#include <pybind11/stl.h>

#include <algorithm>
#include <mutex>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"
#include "ports/python/keyframe.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::python {
namespace {

using Id = std::pair<std::uint32_t, std::uint32_t>;

/// Cells at these positions, which are finite and near enough to have a cell.
std::vector<FineCell> cells_at(const py::object& object) {
  constexpr float kFarthestM = 10'000.0F;
  const PointArray points = points_of(object, "cells");
  std::vector<FineCell> cells(points.view.count);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i] = {points.view[i], 1, 0, 0};
    if (!(cells[i].position.cwiseAbs().maxCoeff() <= kFarthestM)) {
      throw py::value_error("cells: NaN, infinite, or farther than 10 km");
    }
  }
  return cells;
}

/// One of several threads at a time.
class LockedDescriber {
 public:
  LockedDescriber(const DescriptorConfig& config, std::uint32_t max_cells)
      : describer_(config, DescriptorInput{kCoarseVoxelSizeM, max_cells}) {
    require_ok(describer_.error());
  }
  Place describe(std::span<const FineCell> cells) {
    const std::lock_guard lock(mutex_);
    return Place(describer_->describe(cells));
  }

 private:
  std::mutex mutex_;
  Owned<PlaceDescriber> describer_;
};

/// One of several threads at a time.
class LockedDatabase {
 public:
  LockedDatabase(const LoopSearchConfig& config, const DescriptorConfig& places)
      : database_(config, PlaceShape{places.max_keypoints, places.max_planes, kCoarseVoxelSizeM}) {
    require_ok(database_.error());
  }
  void insert(const Place& place, const Id& id, const Pose& T_session_place) {
    const std::lock_guard lock(mutex_);
    database_->insert(place.view(), {id.first, id.second}, T_session_place);
  }
  std::vector<LoopCandidate> search(const Place& place, const Id& id, const SearchScope& scope) {
    const std::lock_guard lock(mutex_);
    const auto found = database_->search(place.view(), {id.first, id.second}, scope);
    return {found.begin(), found.end()};
  }
  std::uint32_t size() {
    const std::lock_guard lock(mutex_);
    return database_->size();
  }

 private:
  std::mutex mutex_;
  Owned<PlaceDatabase> database_;
};

SearchScope::Sessions sessions_named(const std::string& name) {
  const auto found = std::find(kSearchSessions.begin(), kSearchSessions.end(), name);
  if (found == kSearchSessions.end()) {
    throw py::value_error("sessions: all, only_same or only_other, not '" + name + "'");
  }
  return static_cast<SearchScope::Sessions>(found - kSearchSessions.begin());
}

std::vector<LoopCandidate> search_places(LockedDatabase& database, const Place& place, const Id& id,
                                         const std::string& sessions, std::uint32_t gap) {
  const SearchScope scope{sessions_named(sessions), gap};
  const py::gil_scoped_release release;
  return database.search(place, id, scope);
}

}  // namespace

void bind_places(py::module_& module) {
  py::class_<LockedDescriber>(module, "PlaceDescriber", "Describes places by their static cells.")
      .def(py::init<const DescriptorConfig&, std::uint32_t>(),
           py::arg("config") = DescriptorConfig{},
           py::arg("max_cells") = DescriptorInput{}.max_cells)
      .def(
          "describe",
          [](LockedDescriber& describer, const py::object& object) {
            const std::vector<FineCell> cells = cells_at(object);
            const py::gil_scoped_release release;
            return describer.describe(cells);
          },
          py::arg("cells"),
          "A `Place`. cells: (N, 3) float32, metres in a level frame with its origin at the "
          "sensor, one\npoint per 0.2 m; in any order. Beyond max_cells they are left out.");
  py::class_<LockedDatabase>(module, "PlaceDatabase",
                             "Places of several sessions, found by what they look like.")
      .def(py::init<const LoopSearchConfig&, const DescriptorConfig&>(),
           py::arg("config") = LoopSearchConfig{}, py::arg("places") = DescriptorConfig{},
           "places: how they are described.")
      .def(
          "insert",
          [](LockedDatabase& database, const Place& place, const Id& id, const py::object& pose) {
            const Pose T_session_place = rigid_pose_of(pose, "T_session_place");
            const py::gil_scoped_release release;
            database.insert(place, id, T_session_place);
          },
          py::arg("place"), py::arg("id"), py::arg("T_session_place"),
          "Stores a place. id: (session, keyframe); T_session_place: (4, 4), metres. A full "
          "database\nforgets the most redundant place.")
      .def("search", &search_places, py::arg("place"), py::arg("id"), py::arg("sessions") = "all",
           py::arg("min_keyframe_gap") = 0,
           "`LoopCandidate`s, best first. sessions: all, only_same or only_other.\n"
           "min_keyframe_gap: to places of the same session.")
      .def("__len__", &LockedDatabase::size);
}

}  // namespace unimapper::python
