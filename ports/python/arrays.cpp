#include "ports/python/arrays.hpp"

#include <algorithm>
#include <cstring>

namespace unimapper::python {
namespace {

std::string shape_text(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>();
}

/// The array, of the type `T`.
template <typename T>
py::array typed_array(const py::object& object, const char* name, const char* shape) {
  const std::string wanted = std::string(name) + ": a numpy array of " +
                             py::str(py::dtype::of<T>()).cast<std::string>() + " and shape " +
                             shape + " is needed, not ";
  if (!py::isinstance<py::array>(object)) {
    throw py::type_error(wanted + py::str(py::type::of(object)).cast<std::string>());
  }
  if (!py::isinstance<py::array_t<T>>(object)) {
    throw py::type_error(wanted + "one of " + py::str(object.attr("dtype")).cast<std::string>() +
                         "; astype() converts it");
  }
  return py::reinterpret_borrow<py::array>(object);
}

py::array_t<double> doubles_of(const py::object& object, const char* name) {
  using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
  if (object.is_none()) throw py::type_error(std::string(name) + ": a pose is needed, not None");
  Doubles array = Doubles::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + ": an array of numbers is needed");
  }
  return array;
}

Pose pose_at(const double* m, const char* name) {
  if (m[12] != 0.0 || m[13] != 0.0 || m[14] != 0.0 || m[15] != 1.0) {
    throw py::value_error(std::string(name) + ": the last row of a pose is 0 0 0 1");
  }
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = m[4 * row + column];
    pose.translation[row] = m[4 * row + 3];
  }
  return pose;
}

void require_rigid(const Pose& pose, const char* name) {
  if (pose.is_rigid()) return;
  throw py::value_error(std::string(name) +
                        ": not a rigid pose: NaN, infinite, or no rotation in its first rows");
}

void write_pose(const Pose& pose, double* m) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m[4 * row + column] = pose.rotation(row, column);
    m[4 * row + 3] = pose.translation[row];
  }
  std::fill_n(m + 12, 3, 0.0);
  m[15] = 1.0;
}

}  // namespace

PointArray points_of(const py::object& object, const char* name) {
  py::array array = typed_array<float>(object, name, "(N, 3) or (N, 4)");
  if (array.ndim() != 2 || (array.shape(1) != 3 && array.shape(1) != 4)) {
    throw py::value_error(std::string(name) + ": the shape is (N, 3) or (N, 4), not " +
                          shape_text(array));
  }
  if (array.strides(0) < 0 || array.strides(1) < 0) {
    array = py::array_t<float, py::array::c_style>(array);
  }
  const auto step = static_cast<std::size_t>(array.strides(1));
  const PointView view{static_cast<const std::byte*>(array.data()),
                       static_cast<std::size_t>(array.shape(0)),
                       static_cast<std::size_t>(array.strides(0)),
                       0,
                       step,
                       2 * step};
  return {std::move(array), view};
}

template <typename T>
py::array_t<T> vector_of(const py::object& object, const char* name) {
  const py::array array = typed_array<T>(object, name, "(N,)");
  if (array.ndim() != 1) {
    throw py::value_error(std::string(name) + ": the shape is (N,), not " + shape_text(array));
  }
  return py::array_t<T, py::array::c_style | py::array::forcecast |
                            py::detail::npy_api::NPY_ARRAY_ALIGNED_>(array);
}
template py::array_t<double> vector_of(const py::object&, const char*);
template py::array_t<float> vector_of(const py::object&, const char*);
template py::array_t<std::int64_t> vector_of(const py::object&, const char*);
template py::array_t<std::uint32_t> vector_of(const py::object&, const char*);
template py::array_t<std::uint8_t> vector_of(const py::object&, const char*);

std::vector<Eigen::Vector3f> positions_of(const py::object& object, const char* name) {
  const PointArray points = points_of(object, name);
  std::vector<Eigen::Vector3f> positions(points.view.count);
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = points.view[i];
  return positions;
}

Pose pose_of(const py::object& object, const char* name) {
  const py::array_t<double> array = doubles_of(object, name);
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) {
    throw py::value_error(std::string(name) + ": the shape is (4, 4), not " + shape_text(array));
  }
  return pose_at(array.data(), name);
}

Pose rigid_pose_of(const py::object& object, const char* name) {
  Pose pose = pose_of(object, name);
  require_rigid(pose, name);
  return pose;
}

std::vector<Pose> poses_of(const py::object& object, const char* name) {
  const py::array_t<double> array = doubles_of(object, name);
  if (array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4) {
    throw py::value_error(std::string(name) + ": the shape is (N, 4, 4), not " + shape_text(array));
  }
  std::vector<Pose> poses;
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    poses.push_back(pose_at(array.data() + 16 * i, name));
    require_rigid(poses.back(), name);
  }
  return poses;
}

py::array_t<double> array_of(const Pose& pose) {
  py::array_t<double> array({4, 4});
  write_pose(pose, array.mutable_data());
  return array;
}

py::array_t<double> array_of(std::span<const Pose> poses) {
  const auto count = static_cast<py::ssize_t>(poses.size());
  py::array_t<double> array(std::vector<py::ssize_t>{count, 4, 4});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    write_pose(poses[i], array.mutable_data() + 16 * i);
  }
  return array;
}

py::array_t<float> array_from(std::vector<Eigen::Vector3f>&& positions) {
  auto* const kept = new std::vector<Eigen::Vector3f>(std::move(positions));
  const py::capsule owner(kept,
                          [](void* p) { delete static_cast<std::vector<Eigen::Vector3f>*>(p); });
  const auto* const first = reinterpret_cast<const float*>(kept->data());
  return py::array_t<float>(std::vector<py::ssize_t>{static_cast<py::ssize_t>(kept->size()), 3},
                            first, owner);
}

void require_ok(const Error& error) {
  if (error.ok()) return;
  if (error.code == ErrorCode::kMemoryTooSmall) throw std::runtime_error(error.message);
  throw py::value_error(error.message);
}

std::size_t checked_index(std::int64_t index, std::size_t count, const char* what) {
  const auto size = static_cast<std::int64_t>(count);
  const std::int64_t at = index < 0 ? index + size : index;
  if (at >= 0 && at < size) return static_cast<std::size_t>(at);
  throw py::index_error("index " + std::to_string(index) + " of " + std::to_string(count) + " " +
                        what);
}

}  // namespace unimapper::python
