// Conversions between NumPy's arrays and the library's types.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::python {

namespace py = pybind11;

/// Points where they lie in an array, which is kept meanwhile.
struct PointArray {
  py::array array;
  PointView view;
};

/// Points of a float32 array of shape (N, 3) or (N, 4), whatever its strides; only where one is
/// negative it is copied. Throws TypeError or ValueError, which name the argument.
[[nodiscard]] PointArray points_of(const py::object& object, const char* name);

/// The one-dimensional array of numbers `T`, contiguous; copied only where it was not. Throws
/// TypeError for another type and ValueError for another shape.
template <typename T>
[[nodiscard]] py::array_t<T> vector_of(const py::object& object, const char* name);

/// The elements of a one-dimensional array that is contiguous.
template <typename T>
[[nodiscard]] std::span<const T> span_of(const py::array_t<T>& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

/// Positions of a float32 array of shape (N, 3) or (N, 4), copied.
[[nodiscard]] std::vector<Eigen::Vector3f> positions_of(const py::object& object, const char* name);

/// A pose of an array of shape (4, 4); its last row is 0 0 0 1. Whether it is a rotation is not
/// checked. Throws TypeError or ValueError.
[[nodiscard]] Pose pose_of(const py::object& object, const char* name);
/// A pose that is finite and rigid.
[[nodiscard]] Pose rigid_pose_of(const py::object& object, const char* name);
/// Rigid poses of an array of shape (N, 4, 4).
[[nodiscard]] std::vector<Pose> poses_of(const py::object& object, const char* name);

/// A float64 array of shape (4, 4).
[[nodiscard]] py::array_t<double> array_of(const Pose& pose);
/// A float64 array of shape (N, 4, 4).
[[nodiscard]] py::array_t<double> array_of(std::span<const Pose> poses);

/// An array over memory that `owner` keeps alive; it cannot be written to.
template <typename T>
[[nodiscard]] py::array_t<T> view_of(std::vector<py::ssize_t> shape,
                                     std::vector<py::ssize_t> strides, const T* data,
                                     const py::handle& owner) {
  py::array_t<T> array(std::move(shape), std::move(strides), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// An array that owns the elements of a vector, which are not copied.
template <typename T>
[[nodiscard]] py::array_t<T> array_from(std::vector<T>&& values) {
  auto* const kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(static_cast<py::ssize_t>(kept->size()), kept->data(), owner);
}

/// A float32 array of shape (N, 3) that owns positions, which are not copied.
[[nodiscard]] py::array_t<float> array_from(std::vector<Eigen::Vector3f>&& positions);

/// Throws ValueError with the message of an error, RuntimeError where memory is short.
void require_ok(const Error& error);

/// Throws IndexError where there is no element `index` of `count` `what`. Negative ones count from
/// the end.
[[nodiscard]] std::size_t checked_index(std::int64_t index, std::size_t count, const char* what);

}  // namespace unimapper::python
