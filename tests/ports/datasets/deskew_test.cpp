// Tests of the compensation of motion within sweeps, in a room whose walls are known.
#include "ports/datasets/deskew.hpp"

#include "ports/datasets/sensor_motion.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

namespace {

constexpr double kSweep_s = 0.1;
constexpr std::size_t kScans = 40;

/// A robot that turns to and fro while it drives.
Pose pose_at(double time_s) {
  const double yaw = 1.2 * std::sin(1.1 * time_s);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
          {1.5 * std::sin(0.6 * time_s), 0.8 * std::cos(0.5 * time_s), 1.0}};
}

Pose resting_pose(double /*time_s*/) { return {Eigen::Quaterniond::Identity(), {0, 0, 1.0}}; }

/// Half the lengths of the room's edges about (0, 0, 1.5).
const Eigen::Vector3d kHalf(9.0, 6.0, 1.5);
const Eigen::Vector3d kCentre(0.0, 0.0, 1.5);

/// Distance of a point in the room from its nearest wall, floor or ceiling.
double distance_from_wall(const Eigen::Vector3d& point) {
  return (kHalf - (point - kCentre).cwiseAbs()).cwiseAbs().minCoeff();
}

/// Where a ray ends.
Eigen::Vector3d cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  double range = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(direction[axis]) < 1e-9) continue;
    const double wall = kCentre[axis] + std::copysign(kHalf[axis], direction[axis]);
    range = std::min(range, (wall - from[axis]) / direction[axis]);
  }
  return from + range * direction;
}

struct RoomOptions {
  Pose (*motion)(double) = &pose_at;
  bool is_compensated = false;  ///< points as if they were measured at the stamp
  bool has_times = true;
  double time_sign = 1.0;
  bool is_stamped_at_start = false;  ///< times all the same count from the end
  bool has_odometry = true;
  bool are_some_lost = false;  ///< every tenth scan has no points
};

/// Sweeps of a sensor with eight rings.
class Room : public Dataset {
 public:
  explicit Room(const RoomOptions& options = {}) : options_(options) {
    for (std::size_t i = 0; i < kScans; ++i) poses_.push_back(options.motion(stamp_s(i)));
  }

  [[nodiscard]] std::size_t scan_count() const override { return kScans; }
  void read_scan(std::size_t i, Scan& scan) const override {
    scan.reset(0);
    if (options_.are_some_lost && i % 10 == 3) return;
    const double end_s = kSweep_s * static_cast<double>(i + 1);
    for (int column = 0; column < 360; ++column) {
      const double since_end_s = kSweep_s * (column / 360.0 - 1.0);
      const Pose at_shot = options_.motion(end_s + since_end_s);
      for (int ring = 0; ring < 8; ++ring) {
        const double azimuth = -column / kDegreesPerRadian;
        const double elevation = (4.0 * ring - 14.0) / kDegreesPerRadian;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const Eigen::Vector3d hit = cast(at_shot.translation, at_shot.rotation * ray);
        const Pose& measured_from = options_.is_compensated ? poses_[i] : at_shot;
        const Eigen::Vector3f p = (measured_from.inverse() * hit).cast<float>();
        scan.points.push_back({p.x(), p.y(), p.z(), 0.5F});
        const double time_s = options_.time_sign * since_end_s;
        if (options_.has_times) scan.time_s.push_back(static_cast<float>(time_s));
      }
    }
  }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
    return static_cast<std::int64_t>(std::llround(1e9 * stamp_s(i)));
  }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return std::to_string(i); }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    if (!options_.has_odometry) return std::nullopt;
    return options_.motion(1e-9 * static_cast<double>(stamp_ns));
  }

 private:
  [[nodiscard]] double stamp_s(std::size_t i) const {
    return kSweep_s * static_cast<double>(i + (options_.is_stamped_at_start ? 0 : 1));
  }

  RoomOptions options_;
  std::vector<Pose> poses_;
};

/// Root mean square distance of all points from the walls.
double blur(const Dataset& dataset) {
  Scan scan;
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    dataset.read_scan(i, scan);
    for (const Scan::Point& p : scan.points) {
      const double distance = distance_from_wall(dataset.pose(i) * Eigen::Vector3d(p.x, p.y, p.z));
      sum += distance * distance;
    }
    count += scan.points.size();
  }
  return std::sqrt(sum / static_cast<double>(count));
}

std::unique_ptr<Dataset> deskewed_room(const RoomOptions& options = {},
                                       Deskew mode = Deskew::kAuto) {
  return deskewed(std::make_unique<Room>(options), mode);
}

std::string last_note(const Dataset& dataset) {
  const std::vector<Note> notes = dataset.notes();
  return notes.empty() ? std::string() : notes.back().text;
}

}  // namespace

TEST_CASE("between scans the sensor moves evenly, and beyond them for one interval more") {
  const Room room({.motion =
                       [](double time_s) {
                         return Pose(Eigen::Quaterniond::Identity(), {10.0 * time_s, 0.0, 1.0});
                       },
                   .has_odometry = false});
  const SensorMotion motion(room);
  const auto x_at = [&](double time_s) {
    return motion.at(static_cast<std::int64_t>(1e9 * time_s)).translation.x();
  };
  CHECK(x_at(0.1) == Approx(1.0));
  CHECK(x_at(0.25) == Approx(2.5));
  CHECK(x_at(0.05) == Approx(0.5));
  CHECK(x_at(4.05) == Approx(40.5));
  CHECK(x_at(9.0) == Approx(41.0));
}

TEST_CASE("compensated points lie where they would have been measured at the stamp") {
  CHECK(blur(Room()) > 0.1);
  const auto dataset = deskewed_room();
  CHECK(blur(*dataset) < 0.003);
  CHECK_THAT(last_note(*dataset),
             StartsWith("motion within sweeps compensated (by it surfaces of 15 scans are "));
  Scan scan;
  dataset->read_scan(3, scan);
  CHECK(scan.time_s.empty());
}

TEST_CASE("scans that cannot be read do not keep the others from being compensated") {
  CHECK(blur(*deskewed_room({.are_some_lost = true})) < 0.003);
}

TEST_CASE("the poses of scans serve where there is no odometry of its own rate") {
  CHECK(blur(*deskewed_room({.has_odometry = false})) < 0.02);
}

TEST_CASE("points stay where they are where that is better, and the reason is named") {
  const auto check = [](const RoomOptions& options, const std::string& reason) {
    const auto dataset = deskewed_room(options);
    CHECK(blur(*dataset) == Approx(blur(Room(options))));
    CHECK_THAT(last_note(*dataset), Contains(reason));
  };
  check({.is_compensated = true}, "seem to be compensated already");
  CHECK(blur(Room({.is_compensated = true})) < 1e-5);
  check({.time_sign = -1.0}, "backwards");
  check({.is_stamped_at_start = true}, "other end of the sweep");
  check({.motion = &resting_pose}, "too small to matter");
}

TEST_CASE("a recording without times per point passes as it is") {
  const auto dataset = deskewed_room({.has_times = false});
  CHECK(dataset->notes().empty());
  CHECK(blur(*dataset) == Approx(blur(Room({.has_times = false}))));
}

TEST_CASE("compensation can be demanded and switched off") {
  CHECK(blur(*deskewed_room({}, Deskew::kOff)) == Approx(blur(Room())));
  const auto on = deskewed_room({.is_compensated = true}, Deskew::kOn);
  CHECK(blur(*on) > 0.1);
  CHECK_THAT(last_note(*on), StartsWith("compensated all the same"));
}
