// Definition of the Python module `unimapper`.
#include "ports/datasets/dataset.hpp"
#include "ports/python/bindings.hpp"

namespace py = pybind11;

PYBIND11_MODULE(unimapper, module) {
  module.doc() =
      "Real-time LiDAR keyframes, odometry, labels and merged maps.\n\n"
      "Conventions: metres, seconds after the stamp, stamps in nanoseconds. A pose T_a_b is a\n"
      "(4, 4) float64 array that maps coordinates in b to those in a. Points are (N, 3) or (N, 4)\n"
      "float32 arrays; labels are (N,) uint8 arrays in the order of the points.";
  py::register_exception<unimapper::datasets::DatasetError>(module, "DatasetError",
                                                            PyExc_RuntimeError);
  using namespace unimapper::python;
  bind_configs(module);
  bind_recordings(module);
  bind_keyframe(module);
  bind_pipeline(module);
  bind_odometry(module);
  bind_places(module);
  bind_merge(module);
  bind_evaluate(module);
}
