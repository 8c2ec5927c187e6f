// Steps of an odometry that the scans contradict
#include "src/input/odometry_breaks.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "src/input/agreement.hpp"
#include "src/input/plane_look.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/shut_in.hpp"
#include "tests/input/courtyard.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

namespace {

/// Half a round of the courtyard, 0.4 m a scan.
const MemoryDataset& drive() {
  static const MemoryDataset kDrive = record(courtyard(), 60, [](std::size_t i) {
    const double angle = 0.05 * static_cast<double>(i);
    return level_pose(8.0 * std::cos(angle) - 4.0, 8.0 * std::sin(angle) - 4.0, angle + M_PI / 2.0);
  });
  return kDrive;
}

OdometryBreaks found_in(const MemoryDataset& recording) {
  const Track track{recording.scan_count(), [&](std::size_t i) { return recording.pose(i); },
                    [&](std::size_t i) { return recording.stamp_ns(i); }};
  return find_odometry_breaks(
      track, [&](std::size_t i, datasets::Scan& scan) { recording.read_scan(i, scan); });
}

/// From scan `at` on the poses are moved.
MemoryDataset jumping(std::size_t at, const Pose& jump) {
  MemoryDataset recording = drive();
  for (std::size_t i = at; i < recording.poses.size(); ++i) {
    recording.poses[i] = jump * recording.poses[i];
  }
  return recording;
}

Pose moved(double x, double y, double yaw_deg = 0.0) {
  Pose pose = level_pose(x, y, yaw_deg / kDegreesPerRadian);
  pose.translation.z() = 0.0;
  return pose;
}

/// The scans `first` to `next` are missing, and the poses do not know.
MemoryDataset carried(std::size_t first, std::size_t next) {
  MemoryDataset recording = drive();
  const Pose unfelt = recording.poses[first] * recording.poses[next].inverse();
  for (std::size_t i = next; i < recording.poses.size(); ++i) {
    recording.poses[i] = unfelt * recording.poses[i];
  }
  const auto erase = [&](auto& of_scans) {
    of_scans.erase(of_scans.begin() + static_cast<std::ptrdiff_t>(first),
                   of_scans.begin() + static_cast<std::ptrdiff_t>(next));
  };
  erase(recording.scans);
  erase(recording.poses);
  recording.stamps_ns.resize(recording.scans.size());
  return recording;
}

/// Drives to and fro in a closed room with two cupboards; at scan 30 the odometry jumps by `off_m`.
MemoryDataset small_room(double off_m) {
  std::vector<Sheet> room;
  for (const double side : {-2.4, 2.4}) {
    room.push_back({{side, -2.4, 0}, {0, 4.8, 0}, {0, 0, 2.3}});
    room.push_back({{-2.4, side, 0}, {4.8, 0, 0}, {0, 0, 2.3}});
  }
  room.push_back({{1.5, 1.0, 0}, {0, 1.4, 0}, {0, 0, 1.6}});
  room.push_back({{1.5, 1.0, 0}, {0.9, 0, 0}, {0, 0, 1.6}});
  room.push_back({{-2.4, -1.6, 0}, {1.2, 0, 0}, {0, 0, 1.2}});
  MemoryDataset recording = record(
      room, 60,
      [](std::size_t i) {
        return level_pose(1.1 * std::sin(0.15 * static_cast<double>(i)), 0.0, 0.2);
      },
      60.0);
  for (std::size_t i = 30; i < recording.poses.size(); ++i) {
    recording.poses[i] = moved(0.0, off_m) * recording.poses[i];
  }
  return recording;
}

/// Drives 2 m a scan along a wall, then three seconds later, `given_m` farther by its poses, along
/// another one.
MemoryDataset with_gap(double given_m) {
  const auto along = [](std::size_t i) {
    return level_pose(2.0 * static_cast<double>(i), 0.0, 0.0);
  };
  const auto walls = [](double side_m, double every_m) {
    std::vector<Sheet> sheets = {{{-20, side_m, 0}, {80, 0, 0}, {0, 0, 4}}};
    for (double x = -20.0; x < 60.0; x += every_m) {
      sheets.push_back({{x, side_m, 0}, {0, -3, 0}, {0, 0, 4}});
    }
    return sheets;
  };
  MemoryDataset recording = record(walls(6.0, 7.0), 20, along, 8.0);
  const MemoryDataset after = record(walls(-14.0, 4.5), 20, along, 8.0);
  const Pose last = recording.poses.back();
  for (std::size_t i = 0; i < after.scans.size(); ++i) {
    recording.scans.push_back(after.scans[i]);
    recording.poses.push_back(moved(last.translation.x() + given_m, 0.0) * after.poses[i]);
    recording.stamps_ns.push_back(recording.stamps_ns[19] + 3'000'000'000 +
                                  static_cast<std::int64_t>(i) * 100'000'000);
  }
  return recording;
}

/// Stands at the middle of a courtyard, then in a closed cabin there, then at the middle again.
/// The odometry rises by `felt_m` while the cabin is closed.
MemoryDataset lift(std::size_t shut, double felt_m) {
  const auto stand = [](std::size_t) { return level_pose(0.0, 0.0, 0.3); };
  std::vector<Sheet> cabin;
  for (const double side : {-1.0, 1.0}) {
    cabin.push_back({{side, -1, 0}, {0, 2, 0}, {0, 0, 2.3}});
    cabin.push_back({{-1, side, 0}, {2, 0, 0}, {0, 0, 2.3}});
  }
  MemoryDataset recording = record(courtyard(), 25, stand);
  const MemoryDataset within = record(cabin, shut, stand, 60.0);
  recording.scans.insert(recording.scans.end(), within.scans.begin(), within.scans.end());
  const MemoryDataset after = record(courtyard(), 25, stand);
  recording.scans.insert(recording.scans.end(), after.scans.begin(), after.scans.end());
  recording.poses.assign(recording.scans.size(), stand(0));
  recording.stamps_ns.clear();
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    const double share =
        std::clamp((static_cast<double>(i) - 25.0) / static_cast<double>(shut), 0.0, 1.0);
    recording.poses[i].translation.z() += share * felt_m;
    recording.stamps_ns.push_back(static_cast<std::int64_t>(i) * 100'000'000);
  }
  return recording;
}

}  // namespace

TEST_CASE("A right odometry breaks nowhere", "[breaks]") {
  const OdometryBreaks found = found_in(drive());
  CHECK(found.breaks.empty());
  CHECK(found.compared >= 11);
  CHECK(found.steps_told == drive().scan_count() - 1);
  CHECK(check_odometry_breaks(found).severity == Severity::kFine);
}

TEST_CASE("Where scans agree little while it drives, a robot may stand before it drives on",
          "[breaks]") {
  MemoryDataset recording = drive();
  std::mt19937 random(3);  // NOLINT: the same noise every time
  std::normal_distribution<double> noise_m(0.0, 0.15);
  recording.change_points([&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p + Eigen::Vector3d(noise_m(random), noise_m(random), noise_m(random)));
  });
  CHECK(found_in(recording).breaks.empty());
  constexpr std::size_t kAt = 30;
  constexpr std::size_t kStands = 100;
  recording.scans.insert(recording.scans.begin() + kAt, kStands, recording.scans[kAt]);
  recording.poses.insert(recording.poses.begin() + kAt, kStands, recording.poses[kAt]);
  for (std::size_t i = 0; i < kStands; ++i) {
    recording.stamps_ns.push_back(recording.stamps_ns.back() + 100'000'000);
  }
  CHECK(found_in(recording).breaks.empty());
}

TEST_CASE("A first look tells the right motion from those beside it", "[breaks]") {
  const auto from = spread_points(drive().scans[10], PlaneLook::kPoints);
  const auto to = spread_points(drive().scans[14], PlaneLook::kPoints);
  const Pose right = drive().poses[10].inverse() * drive().poses[14];
  PlaneLook look;
  const onboard::PlaneFit fit = look.fit(from, to, right);
  CHECK(fit.least > 10.0F);
  for (const Pose& beside : {moved(0.3, 0.0), moved(0.0, 0.3), moved(0.0, 0.0, 3.0)}) {
    CHECK(look.fit(from, to, right * beside).share < 0.8F * fit.share);
  }
  CHECK(look.fit(from, to, right).share > 0.95F * fit.share);
  CHECK(look.fit({}, to, right).share == 0.0F);
}

TEST_CASE("A motion is a peak only where the scans agree less on all its sides", "[breaks]") {
  const ScanPair pair(10, drive().scans[10], 14, drive().scans[14]);
  const Pose right = drive().poses[10].inverse() * drive().poses[14];
  const auto is_peak = [](const ScanPair& of, const Pose& motion) {
    return of.is_peak(motion, of.agreement(motion));
  };
  CHECK(is_peak(pair, right));
  for (const double side : {-1.0, 1.0}) {
    CHECK_FALSE(is_peak(pair, right * moved(0.4 * side, 0.0)));
    CHECK_FALSE(is_peak(pair, right * moved(0.0, 0.4 * side)));
    CHECK_FALSE(is_peak(pair, right * moved(0.0, 0.0, 3.0 * side)));
  }
  // Along two walls the scans agree everywhere alike.
  const std::vector<Sheet> walls = {{{-40, -4, 0}, {80, 0, 0}, {0, 0, 4}},
                                    {{-40, 4, 0}, {80, 0, 0}, {0, 0, 4}},
                                    {{-40, -4, 0}, {80, 0, 0}, {0, 8, 0}}};
  const MemoryDataset along =
      record(walls, 2, [](std::size_t i) { return level_pose(static_cast<double>(i), 0.0, 0.0); });
  CHECK_FALSE(is_peak({0, along.scans[0], 1, along.scans[1]}, moved(1.0, 0.0)));
}

TEST_CASE("A jump is found at its scan, with its size", "[breaks]") {
  const Pose jump = GENERATE(moved(2.0, -1.0, 30.0), moved(0.5, 0.4), moved(0.0, 0.0, 8.0));
  const std::size_t at = GENERATE(3, 33);
  const OdometryBreaks found = found_in(jumping(at, jump));
  REQUIRE(found.breaks.size() == 1);
  CHECK(found.breaks[0].last == at - 1);
  CHECK(found.breaks[0].next == at);
  const Pose& before = drive().poses[at];
  const double off_m = (jump * before.translation - before.translation).norm();
  CHECK(found.breaks[0].off_m == Approx(off_m).margin(0.1));
  CHECK(found.breaks[0].off_deg ==
        Approx(rotation_angle(jump.rotation) * kDegreesPerRadian).margin(1.0));
}

TEST_CASE("An odometry that starts anew breaks there, and nothing else is said", "[breaks]") {
  const Pose restart = drive().poses[40].inverse();
  const MemoryDataset recording = jumping(40, restart);
  const Plausibility found = examine(recording, recording.scan_count());
  REQUIRE(found.steps.breaks.size() == 1);
  for (const Finding& finding : found.findings) {
    INFO(finding.check << ": " << finding.message);
    CHECK((finding.severity == Severity::kFine) == (finding.check != "odometry"));
  }
  CHECK_THAT(describe(found.steps.breaks[0]), Contains("between scan 39 and 40"));
}

TEST_CASE("A robot that was carried is seen in its scans", "[breaks]") {
  const OdometryBreaks found = found_in(carried(20, 35));
  REQUIRE(found.breaks.size() == 1);
  CHECK(found.breaks[0].last == 19);
  CHECK(found.breaks[0].next == 20);
}

TEST_CASE("Scans while the odometry stands still belong to no session", "[breaks]") {
  MemoryDataset recording = drive();
  const Pose stands = recording.poses[20];
  for (std::size_t i = 21; i < recording.poses.size(); ++i) {
    recording.poses[i] = i < 30 ? stands : stands * drive().poses[30].inverse() * drive().poses[i];
  }
  const OdometryBreaks found = found_in(recording);
  REQUIRE_FALSE(found.breaks.empty());
  CHECK(found.breaks.front().last == 20);
  CHECK(found.breaks.back().next >= 29);
  CHECK(found.breaks.back().next <= 31);
  CHECK(found.breaks.front().is_frozen);
  const Finding finding = check_odometry_breaks(found);
  CHECK(finding.severity == Severity::kSuspicious);
  CHECK_THAT(finding.message,
             Catch::Matchers::Contains("one pose is repeated while the scans move"));
}

TEST_CASE("A scan without points, or with few, says nothing of the odometry", "[breaks]") {
  const std::size_t left = GENERATE(0, 40);
  MemoryDataset recording = drive();
  for (std::size_t i = 10; i < 40; ++i) recording.scans[i].points.resize(left);
  const OdometryBreaks found = found_in(recording);
  CHECK(found.breaks.empty());
  CHECK(found.contradicted == 0);
}

TEST_CASE("A gap behind the first scan, or before the last one, is no break either", "[breaks]") {
  MemoryDataset recording = with_gap(60.0);
  const auto keep = [&](std::size_t first, std::size_t end) {
    const auto cut = [&](auto& of_scans) {
      of_scans = {of_scans.begin() + static_cast<std::ptrdiff_t>(first),
                  of_scans.begin() + static_cast<std::ptrdiff_t>(end)};
    };
    cut(recording.scans);
    cut(recording.poses);
    cut(recording.stamps_ns);
  };
  SECTION("first") { keep(19, 40); }
  SECTION("last") { keep(0, 21); }
  CHECK(found_in(recording).breaks.empty());
}

TEST_CASE("A slip is a break, though it is small at each scan", "[breaks]") {
  // Of 0.4 m a scan the wheels tell so much; or the heading drifts.
  const double told = GENERATE(0.4, 1.5, 1.0);
  const double drift_deg = told == 1.0 ? 2.5 : 0.0;
  MemoryDataset recording = drive();
  for (std::size_t i = 1; i < recording.poses.size(); ++i) {
    Pose step = drive().poses[i - 1].inverse() * drive().poses[i];
    if (i > 20 && i <= 40) {
      step.translation *= told;
      step.rotation *= moved(0.0, 0.0, drift_deg).rotation;
    }
    recording.poses[i] = recording.poses[i - 1] * step;
  }
  const OdometryBreaks found = found_in(recording);
  REQUIRE(found.breaks.size() == 1);
  CHECK(found.breaks[0].last >= 15);
  CHECK(found.breaks[0].last <= 21);
  CHECK(found.breaks[0].next >= 36);
  CHECK(found.breaks[0].next <= 45);
}

TEST_CASE("A gap in the poses is no break where the robot drives on as fast as before",
          "[breaks]") {
  for (const double given_m : {40.0, 60.0, 85.0}) {
    CAPTURE(given_m);
    CHECK(found_in(with_gap(given_m)).breaks.empty());
  }
  for (const double given_m : {0.0, 9.0, 25.0, 95.0}) {
    CAPTURE(given_m);
    const OdometryBreaks found = found_in(with_gap(given_m));
    REQUIRE(found.breaks.size() == 1);
    CHECK(found.breaks[0].is_elsewhere);
    CHECK(found.breaks[0].next == 20);
  }
}

TEST_CASE("A ride in a lift that the odometry does not feel is a break", "[breaks]") {
  const double felt_m = GENERATE(0.0, -0.5, 1.4);
  const OdometryBreaks found = found_in(lift(40, felt_m));
  REQUIRE(found.breaks.size() == 1);
  CHECK(found.breaks[0].is_shut_in);
  CHECK(found.breaks[0].last < 25);
  CHECK(found.breaks[0].last >= 20);
  CHECK(found.breaks[0].next >= 65);
  CHECK(found.breaks[0].next < 70);
  CHECK(found.contradicted == 0);
  CHECK_THAT(describe(found.breaks[0]), Contains("shut in, as in a lift"));
}

TEST_CASE("A ride that the odometry feels is none, nor is a door that closes for a moment",
          "[breaks]") {
  for (const double felt_m : {2.3, -2.3, 3.5, 12.0}) {
    INFO(felt_m);
    CHECK(found_in(lift(40, felt_m)).breaks.empty());
  }
  CHECK(found_in(lift(20, 0.0)).breaks.empty());
}

TEST_CASE("A room where the robot drives is no cabin: a jump there is found", "[breaks]") {
  CHECK(is_shut_in(small_room(0.0).scans[0]));
  CHECK(found_in(small_room(0.0)).breaks.empty());
  const OdometryBreaks found = found_in(small_room(0.8));
  REQUIRE(found.breaks.size() == 1);
  CHECK(found.breaks[0].last == 29);
  CHECK(found.breaks[0].next == 30);
  CHECK(found.breaks[0].off_m == Approx(0.8).margin(0.1));
}

TEST_CASE("A view of one side cannot tell a cabin from a wall", "[breaks]") {
  datasets::Scan scan = lift(1, 0.0).scans[25];
  CHECK(is_shut_in(scan));
  std::erase_if(scan.points, [](const auto& point) { return point.x < 0.5F; });
  CHECK_FALSE(is_shut_in(scan));
  CHECK_FALSE(is_shut_in(drive().scans[0]));
}

TEST_CASE("An odometry that is contradicted in most steps is refused", "[breaks]") {
  OdometryBreaks found;
  found.compared = 20;
  found.breaks = {{3, 4, 1.0, 0.0, false}};
  found.contradicted = 5;
  CHECK(check_odometry_breaks(found).severity == Severity::kSuspicious);
  found.contradicted = 6;
  CHECK(check_odometry_breaks(found).severity == Severity::kWrong);
}
