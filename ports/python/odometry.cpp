// LiDAR odometry in Python.
#include "unimapper/odometry/odometry.hpp"

#include <mutex>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"
#include "unimapper/core/owned.hpp"

namespace unimapper::python {
namespace {

/// The odometry with its memory; calls of several threads wait for each other.
class LockedOdometry {
 public:
  explicit LockedOdometry(const LidarOdometryConfig& config)
      : block_(LidarOdometry::required_bytes(config)) {
    require_ok(config.validate());
    if (block_.data() == nullptr) throw std::runtime_error("no memory for the odometry");
    const auto created = LidarOdometry::create(config, block_.span());
    require_ok(created.error());
    odometry_ = *created;
  }
  OdometryResult add_scan(std::int64_t stamp_ns, const PointView& points,
                          std::span<const float> time_s) {
    const std::lock_guard lock(mutex_);
    return odometry_->add_scan(stamp_ns, points, time_s);
  }
  void add_imu(std::int64_t stamp_ns, const Eigen::Vector3d& rad_s, const Eigen::Vector3d* m_s2) {
    const std::lock_guard lock(mutex_);
    require_ok(odometry_->add_angular_velocity(stamp_ns, rad_s));
    if (m_s2 != nullptr) require_ok(odometry_->add_acceleration(stamp_ns, *m_s2));
  }
  OdometryStatistics statistics() {
    const std::lock_guard lock(mutex_);
    return odometry_->statistics();
  }

 private:
  std::mutex mutex_;
  MemoryBlock block_;
  LidarOdometry* odometry_ = nullptr;
};

OdometryResult register_scan(LockedOdometry& odometry, std::int64_t stamp_ns,
                             const py::object& points, const py::object& time_s) {
  const PointArray scan = points_of(points, "points");
  py::array_t<float> times(0);
  if (!time_s.is_none()) {
    times = vector_of<float>(time_s, "time_s");
    if (static_cast<std::size_t>(times.size()) != scan.view.count) {
      throw py::value_error("time_s: there are " + std::to_string(scan.view.count) +
                            " points, not " + std::to_string(times.size()));
    }
  }
  const py::gil_scoped_release release;
  return odometry.add_scan(stamp_ns, scan.view, span_of(times));
}

Eigen::Vector3d three_of(const py::object& object, const char* name) {
  const auto values = vector_of<double>(object, name);
  if (values.size() != 3) {
    throw py::value_error(std::string(name) + ": the shape is (3,)");
  }
  return {values.at(0), values.at(1), values.at(2)};
}

void add_imu_sample(LockedOdometry& odometry, std::int64_t stamp_ns, const py::object& rad_s,
                    const py::object& m_s2) {
  const Eigen::Vector3d angular = three_of(rad_s, "rad_s");
  if (m_s2.is_none()) return odometry.add_imu(stamp_ns, angular, nullptr);
  const Eigen::Vector3d acceleration = three_of(m_s2, "m_s2");
  odometry.add_imu(stamp_ns, angular, &acceleration);
}

py::array_t<double> vector_array(const Eigen::Vector3d& v) {
  return py::array_t<double>(3, v.data());
}

py::array_t<double> covariance_array(const OdometryResult& result) {
  py::array_t<double> array({6, 6});
  for (int i = 0; i < 36; ++i) array.mutable_data()[i] = result.covariance(i / 6, i % 6);
  return array;
}

/// The axes in use, one a row.
py::array_t<double> weak_axes_array(const OdometryResult& result) {
  py::array_t<double> array(std::vector<py::ssize_t>{result.weak.count, 6});
  for (std::uint32_t axis = 0; axis < result.weak.count; ++axis) {
    for (int i = 0; i < 6; ++i) array.mutable_at(axis, i) = result.weak.axes(i, axis);
  }
  return array;
}

void bind_odometry_result(py::module_& module) {
  py::enum_<OdometryState>(module, "OdometryState", "What is known about the pose.")
      .value("STARTING", OdometryState::kStarting)
      .value("TRACKING", OdometryState::kTracking)
      .value("DEGENERATE", OdometryState::kDegenerate)
      .value("LOST", OdometryState::kLost);
  py::class_<OdometryResult>(module, "OdometryResult", "What a scan showed.")
      .def_property_readonly(
          "ok", [](const OdometryResult& r) { return r.error.ok(); },
          "Whether the scan was accepted.")
      .def_property_readonly(
          "error", [](const OdometryResult& r) { return r.error.code; }, "`ErrorCode`.")
      .def_property_readonly(
          "message", [](const OdometryResult& r) { return std::string(r.error.message); },
          "Why it was refused, or empty.")
      .def_readonly("state", &OdometryResult::state, "`OdometryState`.")
      .def_property_readonly(
          "T_odometry_sensor",
          [](const OdometryResult& r) { return array_of(r.T_odometry_sensor); },
          "At the stamp: (4, 4) float64, metres; the first one is the identity, or levelled.")
      .def_property_readonly(
          "velocity_m_s", [](const OdometryResult& r) { return vector_array(r.velocity_m_s); },
          "(3,) float64, in the sensor's frame.")
      .def_property_readonly(
          "angular_velocity_rad_s",
          [](const OdometryResult& r) { return vector_array(r.angular_velocity_rad_s); },
          "(3,) float64, in the sensor's frame.")
      .def_property_readonly("covariance", &covariance_array,
                             "Of the motion since the scan before: (6, 6) float64, translation "
                             "(m²) in the\nodometry's frame, then rotation (rad²) in the sensor's.")
      .def_property_readonly("weak_axes", &weak_axes_array,
                             "Directions that the scan does not determine: (K, 6) float64, a unit "
                             "vector of\ntranslation, then one of rotation, of which one is zero.")
      .def_property_readonly(
          "up", [](const OdometryResult& r) { return vector_array(r.up); },
          "By the accelerometer: (3,) float64, a unit vector in the odometry frame.")
      .def_readonly("up_sigma_rad", &OdometryResult::up_sigma_rad,
                    "Its standard deviation in one direction; infinite where it is not known.")
      .def_property_readonly(
          "reason", [](const OdometryResult& r) { return std::string(r.reason); },
          "Why the state is not TRACKING, or empty.");
}

py::dict odometry_counts(LockedOdometry& odometry) {
  const OdometryStatistics statistics = odometry.statistics();
  py::dict result;
  result["scans"] = statistics.scans;
  result["points_refused"] = statistics.points_refused;
  result["points_without_voxel"] = statistics.points_without_voxel;
  result["voxels"] = statistics.voxels;
  result["restarts"] = statistics.restarts;
  return result;
}

}  // namespace

void bind_odometry(py::module_& module) {
  bind_odometry_result(module);
  py::class_<LockedOdometry>(module, "LidarOdometry",
                             "Registers each scan to a local map of those before "
                             "(docs/odometry.md).\nCalls release the GIL; those of several "
                             "threads wait for each other.")
      .def(py::init<const LidarOdometryConfig&>(), py::arg("config") = LidarOdometryConfig{})
      .def("add_scan", &register_scan, py::arg("stamp_ns"), py::arg("points"),
           py::arg("time_s") = py::none(),
           "Adds a scan; returns an `OdometryResult`.\n\n"
           "stamp_ns: nanoseconds, later than the last one.\n"
           "points: (N, 3) or (N, 4) float32, metres in the sensor's frame; not copied.\n"
           "time_s: (N,) float32, seconds after the stamp, may be negative; None: the scan is\n"
           "  motion-compensated.")
      .def("add_imu", &add_imu_sample, py::arg("stamp_ns"), py::arg("rad_s"),
           py::arg("m_s2") = py::none(),
           "Takes a sample of an IMU; tell all up to a scan's last point before that scan.\n\n"
           "rad_s: (3,) float64, about the sensor's axes.  m_s2: (3,) float64, at rest 9.81 along\n"
           "  up; None: none.")
      .def_property_readonly("statistics", &odometry_counts, "Counts since it was made.");
}

}  // namespace unimapper::python
