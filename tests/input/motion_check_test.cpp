// Tests of scans against poses, one for each known mistake
#include "src/input/motion_check.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "src/input/rings.hpp"
#include "tests/input/examined.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

namespace {

/// Quaternion whose columns w x y z were read as x y z w.
Pose read_w_first(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.translation};
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

}  // namespace

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

TEST_CASE("where nothing hints at LiDARs that take turns, few scans are looked at") {
  constexpr std::size_t kScans = 20;
  MemoryDataset recording = record(courtyard(), kScans, [](std::size_t i) {
    return level_pose(2.5 * static_cast<double>(i) - 25.0, -4.0, 0.0);
  });
  const Track track{kScans, [&](std::size_t i) { return recording.pose(i); },
                    [&](std::size_t i) { return recording.stamp_ns(i); }};
  std::map<std::size_t, std::shared_ptr<const ScanShape>> looked_at;
  const auto turns = [&] {
    looked_at.clear();
    AgreementFigures figures;
    const auto shape = [&](std::size_t i) {
      auto& kept = looked_at[i];
      if (kept == nullptr) kept = std::make_shared<const ScanShape>(recording.scans[i]);
      return kept;
    };
    find_turns(track, shape, figures);
    return figures.turns;
  };
  CHECK(turns() == 0);
  CHECK(looked_at.size() <= 12);
  for (std::size_t i = 0; i < kScans; i += 2) {
    MemoryDataset::move_points(recording.scans[i], level_pose(0.0, 0.0, 2.5));
  }
  CHECK(turns() == 2);
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
