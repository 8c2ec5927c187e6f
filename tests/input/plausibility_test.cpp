// Tests of the plausibility of recordings: right ones, and one for each known mistake.
#include "src/input/plausibility.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "src/core/pose_interpolation.hpp"
#include "src/input/motion_check.hpp"
#include "tests/input/courtyard.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

namespace {

/// What is not fine, as "severity check: message" lines.
std::string unusual(const Plausibility& found) {
  std::string text;
  for (const Finding& finding : found.findings) {
    if (finding.severity == Severity::kFine) continue;
    text += std::string(severity_name(finding.severity)) + " " + finding.check + ": " +
            finding.message + "\n";
  }
  return text;
}

std::string examined(const MemoryDataset& recording) {
  return unusual(examine(recording, recording.scan_count()));
}

template <typename Change>
MemoryDataset with_poses(MemoryDataset recording, const Change& change) {
  for (Pose& pose : recording.poses) pose = change(pose);
  return recording;
}

const Eigen::Matrix3d kCamera = (Eigen::Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();

/// Quaternion whose columns w x y z were read as x y z w.
Pose read_w_first(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.translation};
}

Pose in_axes(const Pose& pose, const Eigen::Matrix3d& axes) {
  return {Eigen::Matrix3d(axes * pose.rotation * axes.transpose()),
          Eigen::Vector3d(axes * pose.translation)};
}

const MemoryDataset& drive() {
  static const MemoryDataset kDrive = courtyard_drive();
  return kDrive;
}

/// 64 rings of a sensor in the middle of a tunnel of 3 m radius and 20 m of sight, not quite even.
datasets::Scan rings_in_tunnel() {
  datasets::Scan scan;
  for (int ring = 0; ring < 64; ++ring) {
    for (int column = 0; column < 360; column += 2) {
      const double uneven_deg = 0.06 * std::sin(7.3 * ring + 1.7 * column);
      const double elevation = ((ring - 32) * 0.7 + uneven_deg) / kDegreesPerRadian;
      const double azimuth = column / kDegreesPerRadian;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double range = 3.0 / std::max(0.15, ray.tail<2>().norm());
      const Eigen::Vector3f p = (range * ray).cast<float>();
      scan.points.push_back({p.x(), p.y(), p.z(), 0.0F});
    }
  }
  return scan;
}

/// For what is not about the motion: few pairs of scans to compare.
const MemoryDataset& short_drive() {
  static const MemoryDataset kDrive = courtyard_drive(5);
  return kDrive;
}

}  // namespace

TEST_CASE("Scans of keyframes metres apart are too sparse to remove what moves") {
  MotionFigures figures;
  figures.scans = 20;
  figures.interval_s = 0.1;
  figures.step_m = 3.6;  // 130 km/h
  CHECK(check_spacing(figures).severity == Severity::kFine);
  figures.interval_s = 0.5;
  figures.step_m = 5.1;
  CHECK(check_spacing(figures).severity == Severity::kSuspicious);
  CHECK_THAT(check_spacing(figures).message, Contains("5.1 m and 0.5 s apart"));
}

TEST_CASE(
    "far positions in single precision are told by their steps, near and whole ones are not") {
  const auto rounding_m = [](double far_m, bool is_rounded) {
    const Track track{30,
                      [&](std::size_t i) {
                        Pose pose;
                        pose.translation.y() = far_m + 0.73 * static_cast<double>(i);
                        if (is_rounded) {
                          const auto rounded = static_cast<float>(pose.translation.y());
                          pose.translation.y() = static_cast<double>(rounded);
                        }
                        return pose;
                      },
                      [](std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }};
    return check_rounding(measure_motion(track));
  };
  CHECK(rounding_m(5'411'904.557, false).severity == Severity::kFine);
  CHECK(rounding_m(12.0, true).severity == Severity::kFine);
  CHECK(rounding_m(448'262.318, true).severity == Severity::kSuspicious);
  const Finding far = rounding_m(5'411'904.557, true);
  CHECK(far.severity == Severity::kWrong);
  CHECK(far.figure == 0.5);
  CHECK_THAT(far.message, Contains("rounded to 0.50 m") && Contains("relative to the first pose"));
}

TEST_CASE("earth-centred positions are told from far ones on a level") {
  const auto frame_at = [](const Eigen::Vector3d& origin) {
    const Track track{3,
                      [&](std::size_t i) {
                        Pose pose(Eigen::Matrix3d::Identity(), origin);
                        pose.translation.x() += static_cast<double>(i);
                        return pose;
                      },
                      [](std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }};
    return check_frame(measure_motion(track));
  };
  CHECK(frame_at({500'000.0, 6'350'000.0, 300.0}).severity == Severity::kFine);  // UTM
  CHECK(frame_at({0.0, 0.0, 0.0}).severity == Severity::kFine);
  const Finding found = frame_at({4'160'000.0, 660'000.0, 4'780'000.0});
  CHECK(found.severity == Severity::kWrong);
  CHECK_THAT(found.message, Contains("(ECEF)") && Contains("UTM"));
}

/// Every n-th pose as it is, those between interpolated.
MemoryDataset with_every(MemoryDataset recording, std::size_t n) {
  const std::vector<Pose> poses = recording.poses;
  for (std::size_t i = 0; i + n < poses.size(); i += n) {
    for (std::size_t k = 1; k < n; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(n);
      recording.poses[i + k] = interpolate(poses[i], poses[i + n], share);
    }
  }
  return recording;
}

TEST_CASE("poses that were interpolated between few are told by their straight stretches") {
  const auto rate_of = [](const MemoryDataset& recording) {
    return measure_pose_rate({recording.poses.size(),
                              [&](std::size_t i) { return recording.poses[i]; },
                              [&](std::size_t i) { return recording.stamps_ns[i]; }});
  };
  CHECK(rate_of(drive()).interval_s == 0.0);
  const PoseRate rate = rate_of(with_every(drive(), 5));
  CHECK(rate.interval_s == Approx(0.5));
  CHECK(is_too_sparse(rate));
  Finding other{"mount", Severity::kWrong, 2.0, "degrees", "yaw by 2 degrees", {}};
  const Finding found = check_pose_rate(rate, other);
  CHECK(found.severity == Severity::kWrong);
  CHECK_THAT(found.message, Contains("poses are 0.50 s apart") && Contains("yaw by 2 degrees"));
}

TEST_CASE("a LiDAR that is turned by any angle is refused with that angle") {
  const Pose turned(
      Eigen::AngleAxisd(40.0 / kDegreesPerRadian, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
      Eigen::Vector3d::Zero());
  MemoryDataset recording = drive();
  recording.change_points([&](const Eigen::Vector3d& p) { return turned.inverse() * p; });
  CHECK_THAT(examined(recording),
             Contains("wrong ") && Contains("--extrinsic 0.00,0.00,0.00,0.00,"));
}

TEST_CASE("two LiDARs that take turns under one name are told from wrong poses") {
  const Pose rear(
      Eigen::AngleAxisd(150.0 / kDegreesPerRadian, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
      Eigen::Vector3d(-0.8, 0.1, 0.1));
  const std::size_t every = GENERATE(2U, 3U);
  MemoryDataset recording = drive();
  for (std::size_t i = 0; i < recording.scans.size(); i += every) {
    for (datasets::Scan::Point& p : recording.scans[i].points) {
      const Eigen::Vector3f q = (rear * Eigen::Vector3d(p.x, p.y, p.z)).cast<float>();
      p = {q.x(), q.y(), q.z(), p.intensity};
    }
  }
  CHECK_THAT(examined(recording), Contains(" motion: scans " + std::to_string(every)) &&
                                      Contains("several LiDARs take turns"));
}

TEST_CASE("a right recording is fine") {
  const Plausibility found = examine(drive(), drive().scan_count());
  CHECK(unusual(found).empty());
  CHECK(found.agreement.pairs >= 8);
  CHECK(found.agreement.given > 0.8);
  CHECK(found.agreement.given > found.agreement.identity + 0.2);
}

TEST_CASE("poses of another convention are wrong, and the message names the remedy", "[slow]") {
  const Eigen::Matrix3d mirrored = Eigen::Vector3d(1, -1, 1).asDiagonal();
  const Eigen::Matrix3d down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  struct Mistake {
    const char* remedy;
    std::function<Pose(const Pose&)> make;
  };
  const Mistake mistake = GENERATE_REF(
      Mistake{"invert them", [](const Pose& p) { return p.inverse(); }},
      Mistake{"qx qy qz qw (w last)", [](const Pose& p) { return read_w_first(p); }},
      Mistake{"row by row",
              [](const Pose& p) {
                return Pose(Eigen::Matrix3d(p.rotation.transpose()), p.translation);
              }},
      Mistake{"calib.txt", [](const Pose& p) { return in_axes(p, kCamera); }},
      Mistake{"negate y", [=](const Pose& p) { return in_axes(p, mirrored); }},
      Mistake{"NED", [=](const Pose& p) { return in_axes(p, down); }},
      Mistake{
          "multiply them by 0.001",
          [](const Pose& p) { return Pose(p.rotation, Eigen::Vector3d(1000.0 * p.translation)); }},
      Mistake{
          "multiply them by 1000",
          [](const Pose& p) { return Pose(p.rotation, Eigen::Vector3d(0.001 * p.translation)); }},
      Mistake{"stand still", [](const Pose&) { return Pose(); }});
  const std::string found = examined(with_poses(drive(), mistake.make));
  INFO(found);
  CHECK_THAT(found, Contains("wrong motion: ") && Contains(mistake.remedy));
}

TEST_CASE("few points settle only pairs that all agree, move and show the same place") {
  AgreementFigures figures;
  figures.pairs = 16;
  figures.given = 0.79;
  figures.registered = 0.8;
  figures.identity = 0.4;
  figures.least_of_usual = 0.8;
  CHECK(is_surely_right(figures, 16));
  CHECK_FALSE(is_surely_right(figures, 17));
  AgreementFigures other = figures;
  other.given = 0.77;
  CHECK_FALSE(is_surely_right(other, 16));
  other = figures;
  other.identity = 0.75;
  CHECK_FALSE(is_surely_right(other, 16));
  other = figures;
  other.least_of_usual = 0.5;
  CHECK_FALSE(is_surely_right(other, 16));
}

TEST_CASE("an attitude that scatters by a degree is said, and nothing else is blamed") {
  MemoryDataset recording = drive();
  std::mt19937 random(7);  // NOLINT: the same noise every time
  std::normal_distribution<double> noise(0.0, 1.0 / kDegreesPerRadian);
  for (Pose& pose : recording.poses) {
    const double roll = noise(random);
    const double pitch = noise(random);
    pose.rotation *= (Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()) *
                      Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()))
                         .toRotationMatrix();
  }
  const std::string found = examined(recording);
  INFO(found);
  CHECK_THAT(found, Contains("suspicious attitude: roll and pitch of the poses scatter by ") &&
                        !Contains("wrong") && !Contains("odometry: "));
}

TEST_CASE("a heading that drifts for half a second is said, and no mount is blamed") {
  MemoryDataset recording = drive();
  const Pose drift = level_pose(0.0, 0.0, 2.5 / kDegreesPerRadian);
  for (std::size_t i = 21; i < recording.poses.size(); ++i) {
    Pose step = drive().poses[i - 1].inverse() * drive().poses[i];
    if (i <= 25) step.rotation *= drift.rotation;
    recording.poses[i] = recording.poses[i - 1] * step;
  }
  const std::string found = examined(recording);
  INFO(found);
  CHECK_THAT(found, Contains("suspicious odometry: ") && Contains("slipped"));
  CHECK_THAT(found, !Contains("mount: ") && !Contains("time: "));
}

TEST_CASE("poses of a mount that is off, or late by part of a scan, are said with the remedy") {
  SECTION("yaw") {
    const Pose mount = level_pose(0.0, 0.0, 2.0 / kDegreesPerRadian);
    const Pose turn(mount.rotation.transpose(), Eigen::Vector3d::Zero());
    CHECK_THAT(examined(with_poses(drive(), [&](const Pose& p) { return p * turn; })),
               Contains("wrong mount: ") && (Contains("yaw by 2.0") || Contains("yaw by 1.9")) &&
                   Contains("--extrinsic 0.00"));
  }
  SECTION("poses late by one and a half scans") {
    MemoryDataset recording = drive();
    for (std::size_t i = recording.poses.size() - 1; i >= 2; --i) {
      Pose& later = recording.poses[i - 1];
      const Pose& earlier = recording.poses[i - 2];
      recording.poses[i] = {
          Eigen::Quaterniond(later.rotation).slerp(0.5, Eigen::Quaterniond(earlier.rotation)),
          Eigen::Vector3d(0.5 * (later.translation + earlier.translation))};
    }
    CHECK_THAT(examined(recording),
               Contains("wrong time: the poses are 0.15 s late") && Contains("--time-offset -0.1"));
  }
}

TEST_CASE("a LiDAR that hangs upside down is wrong, with an odometry of its own too") {
  MemoryDataset recording = drive();
  const Pose over(Eigen::Matrix3d(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()),
                  Eigen::Vector3d::Zero());
  recording.change_points([&](const Eigen::Vector3d& p) { return over * p; });
  SECTION("poses of the LiDAR") {
    for (Pose& pose : recording.poses) pose = over * pose * over;
    CHECK_THAT(examined(recording), Contains("wrong axes: ") && Contains("--extrinsic auto"));
  }
  SECTION("poses of an upright body") {
    CHECK_THAT(examined(recording),
               Contains("wrong motion: ") && Contains("--extrinsic 0,0,0,180,0,0"));
  }
}

TEST_CASE("poses in another order than the scans are wrong", "[slow]") {
  using Poses = std::vector<Pose>;
  struct Mistake {
    const char* check;
    const char* remedy;
    std::function<void(Poses&)> make;
  };
  const Mistake mistake = GENERATE_REF(
      Mistake{"wrong motion: ", "reversed in time",
              [](Poses& poses) { std::reverse(poses.begin(), poses.end()); }},
      Mistake{"wrong time: ", "0.50 s early",
              [](Poses& poses) { std::rotate(poses.begin(), poses.begin() + 5, poses.end()); }},
      Mistake{"wrong motion: ", "accumulate",
              [](Poses& poses) {
                for (std::size_t i = poses.size() - 1; i > 0; --i) {
                  poses[i] = poses[i - 1].inverse() * poses[i];
                }
              }},
      Mistake{"wrong motion: ", "leading zeros",  // sorted as text
              [](Poses& poses) {
                std::map<std::string, Pose> sorted;
                for (const Pose& pose : poses) sorted[std::to_string(sorted.size())] = pose;
                poses.clear();
                for (const auto& [name, pose] : sorted) poses.push_back(pose);
              }},
      Mistake{"wrong motion: ", "same order",  // at random
              [](Poses& poses) {
                for (std::size_t i = 0; i < poses.size(); ++i) {
                  std::swap(poses[i], poses[(17 * i + 5) % poses.size()]);
                }
              }});
  MemoryDataset recording = drive();
  mistake.make(recording.poses);
  CHECK_THAT(examined(recording), Contains(mistake.check) && Contains(mistake.remedy));
}

TEST_CASE("scans in the world frame are wrong with poses and without") {
  MemoryDataset recording = record(courtyard(), 40, winding, 6.0);
  for (std::size_t i = 0; i < recording.scans.size(); ++i) {
    // What is near: the middle of the scans moves with the sensor.
    std::erase_if(recording.scans[i].points,
                  [](const datasets::Scan::Point& p) { return std::hypot(p.x, p.y) > 12.0F; });
    MemoryDataset::move_points(recording.scans[i], recording.poses[i]);
  }
  CHECK_THAT(examined(recording),
             Contains("wrong motion: ") && Contains("by the inverse of its pose"));
  for (Pose& pose : recording.poses) pose = Pose();
  CHECK_THAT(examined(recording), Contains("wrong motion: ") && Contains("VIEWPOINT"));
}

TEST_CASE("what says little of the motion is fine") {
  const std::vector<Sheet> field = {{{-40, -40, 0}, {80, 0, 0}, {0, 80, 0}}};
  const std::vector<Sheet> tunnel = {{{-60, -4, 0}, {120, 0, 0}, {0, 8, 0}},
                                     {{-60, -4, 0}, {120, 0, 0}, {0, 0, 5}},
                                     {{-60, 4, 0}, {120, 0, 0}, {0, 0, 5}},
                                     {{-60, -4, 5}, {120, 0, 0}, {0, 8, 0}}};
  const auto straight = [](std::size_t i) {
    return level_pose(0.8 * static_cast<double>(i) - 12.0, 0.3, 0.0);
  };
  CHECK(examined(record(field, 30, straight)) == "");
  CHECK(examined(record(tunnel, 30, straight)) == "");
  CHECK(
      examined(record(courtyard(), 30, [](std::size_t) { return level_pose(1, 2, 0.4); })).empty());
}

TEST_CASE("rings tell scans in the world frame from those of a tunnel seen from afar") {
  std::vector<Pose> poses;
  std::vector<datasets::Scan> of_sensor;
  std::vector<datasets::Scan> of_world;
  for (const double x : {30.0, 40.0, 50.0}) {
    poses.push_back(level_pose(x, 0.0, 0.0));
    of_sensor.push_back(rings_in_tunnel());
    of_world.push_back(of_sensor.back());
    MemoryDataset::move_points(of_world.back(), poses.back());
  }
  const auto gain = [&](const std::vector<datasets::Scan>& scans) {
    std::vector<const datasets::Scan*> pointers;
    for (const datasets::Scan& scan : scans) pointers.push_back(&scan);
    return measure_ring_gain(pointers, poses);
  };
  CHECK(gain(of_sensor) < 1.0);
  CHECK(gain(of_world) > 1.3);
}

TEST_CASE("a short drive in the world frame without poses is told by its rings") {
  MemoryDataset recording = record(courtyard(), 12, winding, 40.0);
  for (std::size_t i = 0; i < recording.scans.size(); ++i) {
    std::erase_if(recording.scans[i].points, [](const datasets::Scan::Point& p) {
      const double elevation = std::atan2(p.z, std::hypot(p.x, p.y)) * kDegreesPerRadian;
      return std::hypot(p.x, p.y) > 12.0F || std::fabs(elevation) > 16.0 ||
             std::fabs(std::remainder(elevation, 2.0)) > 0.15;
    });
  }
  CHECK(examined(recording).empty());
  const Pose first = recording.poses.front();
  MemoryDataset standing = recording;
  for (std::size_t i = 0; i < recording.scans.size(); ++i) {
    MemoryDataset::move_points(recording.scans[i], first.inverse() * recording.poses[i]);
    recording.poses[i] = Pose();
    standing.scans[i] = standing.scans.front();
    standing.poses[i] = Pose();
  }
  CHECK_THAT(examined(recording), Contains("wrong motion: ") && Contains("VIEWPOINT"));
  CHECK_THAT(examined(standing), !Contains("motion"));
}

TEST_CASE("scans that follow each other but show different places are suspicious") {
  // Two courtyards far apart, scan by scan in turns of five: no motion makes neighbours agree.
  MemoryDataset recording = drive();
  const MemoryDataset elsewhere = record({{{-30, -22, 0}, {60, 0, 0}, {0, 44, 0}},
                                          {{-30, -3, 0}, {60, 0, 0}, {0, 0, 8}},
                                          {{-30, 9, 0}, {60, 20, 0}, {0, 0, 8}},
                                          {{5, -22, 0}, {20, 44, 0}, {0, 0, 8}}},
                                         recording.scan_count(), winding);
  for (std::size_t i = 0; i < recording.scan_count(); ++i) {
    if (i / 5 % 2 == 1) recording.scans[i] = elsewhere.scans[i];
  }
  const Plausibility found = examine(recording, recording.scan_count());
  INFO(found.agreement.disjoint_pairs << " of " << found.agreement.pairs);
  CHECK_THAT(unusual(found), Contains("succession: ") && Contains("covered or the robot carried") &&
                                 Contains("another order"));
}

TEST_CASE("points in other units, or of a map far away, are wrong") {
  MemoryDataset recording = short_drive();
  SECTION("units") {
    const double scale = GENERATE(1000.0, 100.0, 0.001);
    recording.change_points([&](const Eigen::Vector3d& p) { return Eigen::Vector3d(scale * p); });
    CHECK_THAT(examined(recording), Contains("wrong units: ") && Contains("metres"));
  }
  SECTION("map") {
    const Pose far_away(Eigen::Matrix3d::Identity(), Eigen::Vector3d(4e5, 5e6, 50));
    for (datasets::Scan& scan : recording.scans) MemoryDataset::move_points(scan, far_away);
    CHECK_THAT(examined(recording), Contains("wrong origin: ") && Contains("map's frame"));
  }
}

TEST_CASE("records of another size are wrong") {
  // A scan whose points follow each other, as a sensor hands them over.
  MemoryDataset recording = short_drive();
  const std::size_t floats =
      GENERATE(std::size_t{4}, std::size_t{5}, std::size_t{3}, std::size_t{6}, std::size_t{8});
  for (datasets::Scan& scan : recording.scans) {
    std::sort(scan.points.begin(), scan.points.end(), [](const auto& a, const auto& b) {
      return std::atan2(a.y, a.x) < std::atan2(b.y, b.x);
    });
    std::vector<float> values;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const datasets::Scan::Point& p = scan.points[i];
      const float extra[] = {p.intensity, static_cast<float>(i % 16), 0.0F, 0.0F, 0.0F};
      values.insert(values.end(), {p.x, p.y, p.z});
      values.insert(values.end(), extra, extra + (floats - 3));
    }
    scan.points.clear();
    for (std::size_t i = 0; i + 4 <= values.size(); i += 4) {
      scan.points.push_back({values[i], values[i + 1], values[i + 2], values[i + 3]});
    }
  }
  const std::string found = examined(recording);
  INFO(floats << " floats: " << found);
  if (floats == 4) {
    CHECK(found.empty());
  } else {
    CHECK_THAT(found, Contains("wrong records: ") && Contains(std::to_string(4 * floats)));
  }
}

TEST_CASE("stamps that do not fit are said") {
  MemoryDataset recording = short_drive();
  std::vector<std::int64_t>& stamps_ns = recording.stamps_ns;
  SECTION("milliseconds read as seconds") {
    for (std::int64_t& stamp : stamps_ns) stamp *= 1000;
    CHECK_THAT(examined(recording), Contains("wrong interval: ") && Contains("milliseconds"));
  }
  SECTION("seconds read as microseconds: faster than any robot") {
    for (std::int64_t& stamp : stamps_ns) stamp /= 1000000;
    CHECK_THAT(examined(recording), Contains("wrong speed: ") && Contains("stamps in seconds"));
  }
  SECTION("all equal") {
    for (std::int64_t& stamp : stamps_ns) stamp = 5;
    CHECK_THAT(examined(recording), Contains("wrong order of stamps: ") && Contains("unit"));
  }
  SECTION("two exchanged") {
    std::swap(stamps_ns[2], stamps_ns[3]);
    CHECK_THAT(examined(recording), Contains("suspicious order of stamps: "));
  }
}

TEST_CASE("axes other than z up are wrong") {
  MemoryDataset recording = drive();
  // Rings of a spinning sensor, none of them far from level.
  for (datasets::Scan& scan : recording.scans) {
    std::erase_if(scan.points, [](const datasets::Scan::Point& p) {
      return std::fabs(p.z) > 0.5F * std::hypot(p.x, p.y);
    });
  }
  recording.change_points([&](const Eigen::Vector3d& p) { return Eigen::Vector3d(kCamera * p); });
  const auto turned = with_poses(recording, [&](const Pose& p) { return in_axes(p, kCamera); });
  CHECK_THAT(examined(turned), Contains("wrong axes: ") && Contains("z up"));
}

TEST_CASE("scans that repeat and scans without points are said") {
  MemoryDataset recording = drive();
  SECTION("repeated") {
    for (std::size_t i = 1; i < recording.scans.size(); i += 2) {
      recording.scans[i] = recording.scans[i - 1];
    }
    CHECK_THAT(examined(recording), Contains("suspicious repeated scans: "));
  }
  SECTION("repeated, and compensated for the motion since they were read") {
    for (std::size_t i = 0; i < recording.scans.size(); ++i) {
      recording.scans[i].fingerprint = 1 + i / 2;
    }
    CHECK_THAT(examined(recording), Contains("suspicious repeated scans: "));
  }
  SECTION("all empty") {
    for (datasets::Scan& scan : recording.scans) scan.points.clear();
    CHECK_THAT(examined(recording), Contains("wrong points: ") && Contains("--format"));
  }
}

TEST_CASE("recordings of none, one and two scans are examined") {
  for (const std::size_t scans : {0U, 1U, 2U}) CHECK(examined(courtyard_drive(scans)).empty());
}
