// Parts of the Python module, one function each that adds its classes and functions.
#pragma once

#include <pybind11/pybind11.h>

namespace unimapper::python {

/// Sensors and the configurations, by their parameter tables.
void bind_configs(pybind11::module_& module);
/// Recordings of every format that the tool reads.
void bind_recordings(pybind11::module_& module);
/// `Keyframe`, before what returns some.
void bind_keyframe(pybind11::module_& module);
/// `Pipeline`.
void bind_pipeline(pybind11::module_& module);
/// `LidarOdometry`.
void bind_odometry(pybind11::module_& module);
/// `PlaceDescriber` and `PlaceDatabase`.
void bind_places(pybind11::module_& module);
/// `Session`, as a part of merging.
void bind_sessions(pybind11::module_& module);
/// Sessions, merging and stored maps.
void bind_merge(pybind11::module_& module);
/// Errors of trajectories, labels and maps.
void bind_evaluate(pybind11::module_& module);

}  // namespace unimapper::python
