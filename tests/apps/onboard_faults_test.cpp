// End-to-end tests of `unimapper onboard` on recordings with faults.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "ports/lcm/received_log.hpp"
#include "tests/apps/onboard_run.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("a run of which nothing came ends with exit code 1 and the likely cause") {
  SmallRecording recording;
  std::string cause = "all 12 scans were refused: no point within range";
  SECTION("no points") {
    for (auto& scan : recording.scans) scan.points.clear();
  }
  SECTION("millimetres") {
    for (auto& scan : recording.scans) {
      for (auto& point : scan.points) {
        point = {1000.0F * point.x, 1000.0F * point.y, 1000.0F * point.z, point.intensity};
      }
    }
    cause += ": are the points in metres";
  }
  const OnboardRun fixture(recording);
  check_refused(fixture.onboard({"--force"}), cause);
  CHECK(fixture.stats()["keyframes"] == 0);
}

TEST_CASE("a sensor that does not fit its cells is named before the first scan, and once after") {
  const OnboardRun fixture{SmallRecording()};
  const std::string config =
      fixture.directory.write("config.json", R"({"voxel": {"max_cells": 64}})");
  const std::string full = fixture.done({"--surroundings", "outdoors", "--config", config});
  const std::size_t before = full.find("sensor and preset do not fit: in a dense street vlp-16");
  const std::size_t after = full.find("no room for more fine cells (at most 64)");
  REQUIRE(before != std::string::npos);
  REQUIRE(after != std::string::npos);
  CHECK(before < after);
  CHECK(full.find("no room for more fine cells (at most 64)", after + 1) == std::string::npos);
  CHECK_THAT(full, Contains("voxel.max_cells to 87146"));
  CHECK_THAT(fixture.done(kOutdoors), !Contains("do not fit") && !Contains("are full"));
}

TEST_CASE("damaged recordings end the run with a sentence and exit code 1") {
  const struct {
    const char* message;
    std::function<void(SmallRecording&)> change;
    std::function<void(const fs::path&)> damage;
  } damaged[] = {
      {"no such file or directory", {}, [](const fs::path& data) { fs::remove_all(data); }},
      {"11 poses for 12 scans", [](SmallRecording& r) { r.poses.pop_back(); }, {}},
      {"poses.txt:8: 'nan' is not finite",
       [](SmallRecording& r) { r.poses[7].translation.x() = std::nan(""); },
       {}},
      {"truncated",
       {},
       [](const fs::path& data) {
         for (const char* scan : {"000005.bin", "000008.bin"}) {
           fs::resize_file(data / "scans" / scan, 1000);
         }
       }},
  };
  for (const auto& [message, change, damage] : damaged) {
    SmallRecording recording;
    if (change) change(recording);
    const OnboardRun fixture(recording);
    if (damage) damage(fixture.dataset);
    check_refused(fixture.onboard(), message);
  }
}

TEST_CASE("scans that cannot be used are refused one by one, counted, and labelled static") {
  const struct {
    const char* message;
    std::map<std::string, int> refused;
    std::function<void(SmallRecording&)> change;
  } unusable[] = {
      {"scan 000003 refused: the scan has no point",
       {{"empty_scan", 1}},
       [](SmallRecording& r) { r.scans[3].points.clear(); }},
      {"scan 000003 refused: the scan has no point",
       {{"empty_scan", 1}},
       [](SmallRecording& r) {
         for (auto& point : r.scans[3].points) point.x = kNaN;
       }},
      {"scan 000006 refused: ",
       {{"pose_jump", 1}},
       [](SmallRecording& r) { r.poses[6].translation.y() = 100.0; }},
      {"scan 000005 refused: ",  // time goes backwards, too often for a glitch
       {{"time_reversed", 2}},
       [](SmallRecording& r) {
         r.stamps_ns[8] = r.stamps_ns[2];
         r.stamps_ns[5] = r.stamps_ns[1];
       }},
      {"warning: 1 of 12 scans are truncated within a point", {}, {}},
  };
  for (const auto& [message, refused, change] : unusable) {
    SmallRecording recording;
    if (change) change(recording);
    const OnboardRun fixture(recording);
    if (!change) {
      fs::resize_file(fixture.dataset / "scans/000003.bin", 1000);
      recording.scans[3].points.resize(1000 / 16);
    }
    CHECK_THAT(fixture.done({"--force"}), Contains(message));
    CHECK(fixture.stats()["scans_refused"].get<std::map<std::string, int>>() == refused);
    CHECK(fixture.stats()["scans"] == 12);
    CHECK(fixture.stats()["allocations_after_start"] == 0);
    fixture.check_labels(recording);
  }
}

TEST_CASE(
    "what --force maps though it is refused without is said in summary, stats.json and merge") {
  SmallRecording recording;
  for (datasets::Scan& scan : recording.scans) {
    datasets::Scan::Point far = scan.points.front();
    far.x = 1500.0F;
    scan.points.insert(scan.points.end(), scan.points.size() / 40, far);
  }
  const OnboardRun fixture(recording);
  check_refused(fixture.onboard(), "units: ");
  const std::string forced = "forced: mapped as it is by --force, though surely wrong: units";
  CHECK_THAT(fixture.done({"--force"}), Contains("warning: input, " + forced));
  bool is_told = false;
  const nlohmann::json stats = fixture.stats();
  for (const auto& finding : stats["input"]["findings"]) {
    is_told = is_told || finding["check"] == "forced";
    if (finding["check"] != "units") continue;
    CHECK(finding["severity"] == "wrong");
    CHECK(finding["suspicious_above"] == 500.0);
    CHECK(finding["wrong_above"] == 1000.0);
    CHECK(finding["figure"] > 1000.0);
  }
  CHECK(is_told);
  const auto merged = run_unimapper({"merge", fixture.run, "--out", fixture.directory / "map"});
  CHECK_THAT(merged.err, Contains("warning: run: input, " + forced));
}

TEST_CASE("scans that repeat the one before while the robot moves are left out and counted") {
  for (const bool moves : {true, false}) {
    SmallRecording recording;
    for (std::size_t i = 5; i < recording.scans.size(); ++i) {
      if (i < 9) recording.scans[i] = recording.scans[4];
      const auto stood_m = static_cast<double>(std::max<std::size_t>(i, 8) - 4);
      if (!moves) recording.poses[i].translation.x() = stood_m;
    }
    const OnboardRun fixture(recording);
    const std::string said = fixture.done({"--force"});
    const std::string expected =
        "4 of 12 scans repeat the one before point by point although the "
        "robot moved, and are left out; the first is 000005";
    const auto refused = fixture.stats()["scans_refused"].get<std::map<std::string, int>>();
    if (moves) {
      CHECK_THAT(said, Contains(expected) && Contains("scan 000005 refused: it repeats"));
      CHECK(refused == std::map<std::string, int>{{"empty_scan", 4}});
    } else {
      CHECK_THAT(said, !Contains("although the robot moved"));
      CHECK(refused.empty());
    }
    CHECK(fixture.stats()["allocations_after_start"] == 0);
    fixture.check_labels(recording);
  }
}

TEST_CASE("a jump of 10 m between two scans begins a session of its own") {
  SmallRecording recording(20);
  for (std::size_t i = 6; i < recording.poses.size(); ++i) {
    recording.poses[i].translation.x() += 10.0;
  }
  const OnboardRun fixture(recording);
  CHECK_THAT(fixture.done(kOutdoors),
             Contains("between scan 5 and 6") && Contains("session of its own"));
  CHECK(fixture.stats()["scans"] == 20);
  CHECK(fixture.stats()["scans_refused"].empty());
  CHECK(fixture.stats()["keyframes"] == 3);
  CHECK(fixture.stats()["sessions"] == std::vector<std::string>{"run", "run.2"});
  fixture.check_labels(recording);
  const std::string events = read_text(fixture.run / "events.log");
  CHECK_THAT(events, Contains("keyframe 0 closed: 6 scans"));
  const auto sessions = lcm_port::read_event_log(fixture.run / "keyframes.lcmlog").sessions;
  REQUIRE(sessions.size() == 2);
  const bool is_first = sessions[0].info.name == "run";
  const SessionData& before = sessions[is_first ? 0 : 1];
  const SessionData& after = sessions[is_first ? 1 : 0];
  CHECK(before.keyframes.size() == 1);
  REQUIRE(after.keyframes.size() == 2);
  CHECK(after.keyframes[0].sequence == 0);
  // Scans keep their numbers in the recording, which truth and labels are found by.
  CHECK(after.keyframes[0].scans.front().scan_index == 6);
  CHECK(before.complete);
  CHECK(after.complete);
}

TEST_CASE("scans between two breaks of the odometry that make no session are said") {
  SmallRecording recording(24);
  for (std::size_t i = 12; i < recording.poses.size(); ++i) {
    recording.poses[i].translation.x() += i < 14 ? 10.0 : 20.0;
  }
  const OnboardRun fixture(recording);
  CHECK_THAT(fixture.done(kOutdoors), Contains("2 scans between breaks are left out"));
  CHECK(fixture.stats()["scans"] == 22);
  CHECK(fixture.stats()["scans_left_out"] == 2);
  fixture.check_labels(recording);
}

TEST_CASE("single points that are NaN, infinite or out of range are counted and keep their index") {
  SmallRecording recording;
  auto& points = recording.scans[4].points;
  points[0].x = kNaN;
  points[1].y = std::numeric_limits<float>::infinity();
  points[2].z = -std::numeric_limits<float>::max();
  const OnboardRun fixture(recording);
  (void)fixture.done();
  CHECK(fixture.stats()["dropped"]["not_finite"] == 2);
  CHECK(fixture.stats()["dropped"]["out_of_range"].get<int>() >= 1);
  fixture.check_labels(recording);
}
