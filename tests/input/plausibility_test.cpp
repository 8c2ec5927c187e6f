// Tests of the plausibility of recordings: right ones, and mistakes of points, mounts and clocks
#include "src/input/plausibility.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "tests/input/examined.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

TEST_CASE("a right recording is fine") {
  const Plausibility found = examine(drive(), drive().scan_count());
  CHECK(unusual(found).empty());
  CHECK(found.agreement.pairs >= 8);
  CHECK(found.agreement.given > 0.8);
  CHECK(found.agreement.given > found.agreement.identity + 0.2);
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
