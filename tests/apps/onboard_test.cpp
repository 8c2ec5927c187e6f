// End-to-end tests of `unimapper onboard`: files, messages, exit codes.
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// A recording and a run folder. The small sensor keeps the pipeline's memory small.
struct Fixture {
  TemporaryDirectory directory;
  fs::path dataset = directory.path() / "recording";
  fs::path run = directory.path() / "run";

  CommandResult onboard(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"onboard",  dataset.string(), "--out",    run.string(),
                                          "--sensor", "vlp-16",         "--replace"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_unimapper(arguments);
  }
  [[nodiscard]] nlohmann::json stats() const {
    return nlohmann::json::parse(read_text(run / "stats.json"));
  }
  [[nodiscard]] std::size_t label_count(const std::string& name) const {
    const fs::path file = run / "labels" / (name + ".label");
    REQUIRE(fs::exists(file));
    return fs::file_size(file) / sizeof(std::uint32_t);
  }
  void check_labels(const SmallRecording& recording) const {
    for (std::size_t i = 0; i < recording.scans.size(); ++i) {
      const std::string number = std::to_string(i);
      CHECK(label_count(std::string(6 - number.size(), '0') + number) ==
            recording.scans[i].points.size());
    }
  }
};

void check_refused(const CommandResult& result, const std::string& message) {
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, Contains("unimapper: error: ") && Contains(message));
  const std::size_t error = result.err.find("unimapper: error: ");
  CHECK(result.err.find('\n', error) == result.err.size() - 1);  // one line, the last one
}

}  // namespace

TEST_CASE("a run folder holds labels for every point, keyframes, loops and statistics") {
  const Fixture fixture;
  const SmallRecording recording;
  recording.write(fixture.dataset);
  const CommandResult result = fixture.onboard({"--surroundings", "outdoors"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  CHECK(result.out.empty());
  fixture.check_labels(recording);
  for (const fs::path& file : datasets::list_files(fixture.run / "labels", ".label")) {
    const std::string bytes = read_text(file);
    for (std::size_t i = 0; i < bytes.size(); i += 4) {
      std::uint32_t label = 0;
      std::memcpy(&label, bytes.data() + i, sizeof label);
      REQUIRE((label == 9 || label == 251));
    }
  }
  CHECK(fs::file_size(fixture.run / "keyframes.lcmlog") > 0);
  CHECK_THAT(read_text(fixture.run / "loops.csv"),
             Catch::StartsWith("query_session,query_keyframe,query_scan,match_session,"
                               "match_keyframe,match_scan,confidence,accepted,reason,"
                               "x,y,z,qx,qy,qz,qw\n"));
  const auto stats = fixture.stats();
  CHECK(stats["scans"] == 12);
  CHECK(stats["keyframes"] == 2);
  CHECK(stats["closing_call_ms"]["max"] > 0.0);
  CHECK(stats["keyframes_late"] == 0);  // none is late without --realtime
  CHECK(stats["allocations_after_start"] == 0);
  CHECK(stats["hand_over_ms"]["max"] > 0.0);
  CHECK(stats["keyframes_not_encoded"] == 0);
  CHECK(stats["arena_bytes"].get<std::uint64_t>() > 0);
  std::size_t points = 0;
  for (const auto& scan : recording.scans) points += scan.points.size();
  CHECK(stats["points_in"] == points);
  for (const char* stage : {"ingest", "removal", "description", "search", "total"}) {
    for (const char* figure : {"p50", "p99", "max"}) {
      CHECK(stats["stage_ms"][stage][figure].is_number());
    }
  }
  const auto run = nlohmann::json::parse(read_text(fixture.run / "run.json"));
  CHECK(run["session"] == "run");
  CHECK(run["boot"].get<std::string>().size() == 32);
  CHECK(run["sensor"] == "vlp-16");
  CHECK(run["dataset"] == "recording");
}

TEST_CASE("a run that does not know up says so, unless the odometry promises it") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  const std::string warning = "warning: up is unknown in 2 keyframes";
  const CommandResult unknown = fixture.onboard();
  REQUIRE(unknown.exit_code == 0);
  CHECK_THAT(unknown.err, Contains(warning) && Contains("odometry.up_sigma_deg promises nothing"));
  CHECK(fixture.stats()["up"]["known"] == 0);
  CHECK(fixture.stats()["up"]["unknown"] == 2);

  const fs::path config = fixture.directory.path() / "config.json";
  std::ofstream(config) << R"({"odometry": {"up_sigma_deg": 0.5}})";
  fs::remove_all(fixture.run);
  const CommandResult promised = fixture.onboard({"--config", config.string()});
  REQUIRE(promised.exit_code == 0);
  CHECK_THAT(promised.err, !Contains(warning));
  CHECK(fixture.stats()["up"]["known"] == 2);
  CHECK(fixture.stats()["up"]["unknown"] == 0);
}

TEST_CASE("the same recording gives the same bytes") {
  const Fixture fixture;
  SmallRecording(25).write(fixture.dataset);
  const fs::path again = fixture.directory.path() / "again" / "run";
  REQUIRE(fixture.onboard({"--all-candidates"}).exit_code == 0);
  REQUIRE(run_unimapper({"onboard", fixture.dataset.string(), "--out", again.string(), "--sensor",
                         "vlp-16", "--all-candidates"})
              .exit_code == 0);
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fixture.run)) {
    const fs::path relative = entry.path().lexically_relative(fixture.run);
    if (!entry.is_regular_file() || relative == "stats.json") continue;
    INFO(relative);
    CHECK(read_text(entry.path()) == read_text(again / relative));
    ++files;
  }
  CHECK(files == 25 + 4);
  auto first = fixture.stats();
  auto second = nlohmann::json::parse(read_text(again / "stats.json"));
  for (const char* timing : {"stage_ms", "total_histogram", "deadline_misses", "closing_call_ms",
                             "hand_over_ms", "load"}) {
    CHECK(first.contains(timing));
    first.erase(timing);
    second.erase(timing);
  }
  CHECK(first == second);
}

TEST_CASE("the setting for indoors is taken on request, and both outputs name it") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  for (const std::string setting : {"indoors", "outdoors"}) {
    const CommandResult result = fixture.onboard({"--surroundings", setting});
    REQUIRE(result.exit_code == 0);
    CHECK_THAT(result.err, Contains("surroundings " + setting + " (from --surroundings)"));
    CHECK(fixture.stats().at("surroundings").at("setting") == setting);
  }
  const CommandResult dumped = run_unimapper(
      {"onboard", fixture.dataset.string(), "--surroundings", "indoors", "--dump-config"});
  CHECK(nlohmann::json::parse(dumped.out).at("descriptor").at("column_size_m") == 0.2);
}

TEST_CASE("only the first scans on request") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  REQUIRE(fixture.onboard({"--scans", "5"}).exit_code == 0);
  CHECK(fixture.stats()["scans"] == 5);
  CHECK(fixture.stats()["keyframes"] == 1);
  CHECK(datasets::list_files(fixture.run / "labels", ".label").size() == 5);
}

TEST_CASE("a second run into the same folder leaves nothing of the first") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  REQUIRE(fixture.onboard().exit_code == 0);
  REQUIRE(fixture.onboard({"--scans", "3"}).exit_code == 0);
  CHECK(datasets::list_files(fixture.run / "labels", ".label").size() == 3);
}

TEST_CASE("an earlier run is not overwritten without --replace") {
  const Fixture fixture;
  SmallRecording(2).write(fixture.dataset);
  const std::vector<std::string> again = {
      "onboard", fixture.dataset.string(), "--out", fixture.run.string(), "--sensor", "vlp-16"};
  REQUIRE(run_unimapper(again).exit_code == 0);
  const std::string run = read_text(fixture.run / "keyframes.lcmlog");
  check_refused(run_unimapper(again), "holds an earlier run; --replace overwrites it");
  CHECK(read_text(fixture.run / "keyframes.lcmlog") == run);
  REQUIRE(fixture.onboard({"--scans", "1"}).exit_code == 0);
  CHECK(fixture.stats()["scans"] == 1);
}

TEST_CASE("a run of which nothing came ends with exit code 1 and the likely cause") {
  const Fixture fixture;
  SmallRecording recording;
  std::string cause;
  SECTION("millimetres") {
    for (auto& scan : recording.scans) {
      for (auto& point : scan.points) {
        point = {1000.0F * point.x, 1000.0F * point.y, 1000.0F * point.z, point.intensity};
      }
    }
    cause = "all 12 scans were refused: no point within range: are the points in metres";
  }
  SECTION("no points") {
    for (auto& scan : recording.scans) scan.points.clear();
    cause = "all 12 scans were refused: no point within range";
  }
  recording.write(fixture.dataset);
  check_refused(fixture.onboard({"--force"}), cause);
  CHECK(fixture.stats()["keyframes"] == 0);
}

TEST_CASE("labels that may be ground truth are not overwritten") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  write_text(fixture.dataset / "labels/000000.label", "truth");
  const CommandResult result =
      run_unimapper({"onboard", fixture.dataset.string(), "--out", fixture.dataset.string()});
  check_refused(result, "choose another --out");
  CHECK(read_text(fixture.dataset / "labels/000000.label") == "truth");
}

TEST_CASE("the sensor comes from --sensor, else dataset.json, else the format, and is reported") {
  const Fixture fixture;
  SmallRecording(2).write(fixture.dataset);
  const auto sensor_line = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"onboard", fixture.dataset.string(), "--out",
                                          fixture.run.string(), "--replace"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_unimapper(arguments).err;
  };
  CHECK_THAT(sensor_line({}), Contains("sensor generic"));
  write_text(fixture.dataset / "dataset.json", R"({"sensor": "livox-avia"})");
  CHECK_THAT(sensor_line({}), Contains("sensor livox-avia (from dataset.json)"));
  CHECK_THAT(sensor_line({"--sensor", "VLP-16"}), Contains("sensor vlp-16 (from --sensor)"));
  CHECK_THAT(sensor_line({"--sensor", "thermometer"}), Contains("unknown sensor 'thermometer'"));
  CHECK_THAT(sensor_line({"--sensor", "os3-128"}), Contains("did you mean 'os2-128'?"));
  fs::rename(fixture.dataset / "scans", fixture.dataset / "velodyne");
  fs::remove(fixture.dataset / "dataset.json");
  CHECK_THAT(sensor_line({}), Contains("sensor hdl-64e"));
}

TEST_CASE("a mode with twice the columns runs without overflow") {
  const Fixture fixture;
  SmallRecording recording(2);
  for (Pose& pose : recording.poses) pose = Pose();  // the sphere stands still
  const auto turn = [&](int columns) {
    for (auto& scan : recording.scans) {
      scan.points.clear();
      for (int ring = 0; ring < 16; ++ring) {
        const double elevation = (-15.0 + 2.0 * ring) * 3.14159265 / 180.0;
        for (int column = 0; column < columns; ++column) {
          const double azimuth = 2.0 * 3.14159265 * column / columns;
          const auto at = [](double value) { return static_cast<float>(15.0 * value); };
          scan.points.push_back({at(std::cos(elevation) * std::cos(azimuth)),
                                 at(std::cos(elevation) * std::sin(azimuth)),
                                 at(std::sin(elevation)), 0.0F});
        }
      }
    }
    recording.write(fixture.dataset);
    return fixture.onboard();
  };
  const CommandResult own = turn(1808);
  REQUIRE(own.exit_code == 0);
  CHECK_THAT(own.err, !Contains("columns"));
  const CommandResult twice = turn(3616);
  REQUIRE(twice.exit_code == 0);
  CHECK_THAT(twice.err, Contains("room for a mode of 3616 columns"));
  CHECK_THAT(twice.err, !Contains("scan_too_large") && !Contains("cells_full"));
}

TEST_CASE("a sensor that does not fit its cells is named before the first scan, and once after") {
  const Fixture fixture;
  SmallRecording recording;
  recording.write(fixture.dataset);
  const fs::path config = fixture.directory.path() / "config.json";
  std::ofstream(config) << R"({"voxel": {"max_cells": 64}})";
  const CommandResult full =
      fixture.onboard({"--surroundings", "outdoors", "--config", config.string()});
  REQUIRE(full.exit_code == 0);
  const std::size_t before =
      full.err.find("sensor and preset do not fit: in a dense street vlp-16");
  const std::size_t after = full.err.find("all 64 fine cells are full");
  REQUIRE(before != std::string::npos);
  REQUIRE(after != std::string::npos);
  CHECK(before < after);
  CHECK(full.err.find("all 64 fine cells are full", after + 1) == std::string::npos);
  CHECK_THAT(full.err, Contains("voxel.max_cells to 87146"));

  const CommandResult own = fixture.onboard({"--surroundings", "outdoors"});
  REQUIRE(own.exit_code == 0);
  CHECK_THAT(own.err, !Contains("do not fit") && !Contains("are full"));
}

TEST_CASE("damaged recordings end the run with a sentence and exit code 1") {
  const Fixture fixture;
  SmallRecording recording;

  SECTION("no recording at all") { check_refused(fixture.onboard(), "no such file or directory"); }
  SECTION("no poses") {
    recording.write(fixture.dataset);
    fs::remove(fixture.dataset / "poses.txt");
    check_refused(fixture.onboard(), "poses.txt: no such file");
  }
  SECTION("fewer poses than scans") {
    recording.poses.pop_back();
    recording.write(fixture.dataset);
    check_refused(fixture.onboard(), "11 poses for 12 scans");
  }
  SECTION("a pose that is not a number") {
    recording.poses[7].translation.x() = std::nan("");
    recording.write(fixture.dataset);
    check_refused(fixture.onboard(), "poses.txt:8: 'nan' is not finite");
  }
  SECTION("a sixth of the scans truncated") {
    recording.write(fixture.dataset);
    fs::resize_file(fixture.dataset / "scans/000005.bin", 1000);
    fs::resize_file(fixture.dataset / "scans/000008.bin", 1000);
    check_refused(fixture.onboard(), "truncated");
  }
}

TEST_CASE("scans that cannot be used are refused one by one, counted, and labelled static") {
  const Fixture fixture;
  SmallRecording recording;
  std::map<std::string, int> expected;
  std::string message;
  bool is_truncated = false;

  SECTION("empty scan") {
    recording.scans[3].points.clear();
    expected = {{"empty_scan", 1}};
    message = "scan 000003 refused: the scan has no point";
  }
  SECTION("a truncated scan") {
    is_truncated = true;
    message = "warning: 1 of 12 scans are truncated within a point";
  }
  SECTION("a scan of nothing but NaN") {
    for (auto& point : recording.scans[3].points) {
      point.x = std::numeric_limits<float>::quiet_NaN();
    }
    expected = {{"empty_scan", 1}};
    message = "scan 000003 refused: the scan has no point";
  }
  SECTION("the pose jumps by 100 m and back") {
    recording.poses[6].translation.y() = 100.0;
    expected = {{"pose_jump", 1}};
    message = "scan 000006 refused: ";
  }
  SECTION("time goes backwards, too often for a glitch") {
    recording.stamps_ns[8] = recording.stamps_ns[2];
    recording.stamps_ns[5] = recording.stamps_ns[1];
    expected = {{"time_reversed", 2}};
    message = "scan 000005 refused: ";
  }
  recording.write(fixture.dataset);
  if (is_truncated) {
    fs::resize_file(fixture.dataset / "scans/000003.bin", 1000);
    recording.scans[3].points.resize(1000 / 16);
  }
  const CommandResult result = fixture.onboard({"--force"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.err, Contains(message));
  CHECK(fixture.stats()["scans_refused"].get<std::map<std::string, int>>() == expected);
  CHECK(fixture.stats()["scans"] == 12);
  CHECK(fixture.stats()["allocations_after_start"] == 0);
  fixture.check_labels(recording);
}

TEST_CASE("a jump of 10 m between two scans begins a session of its own") {
  const Fixture fixture;
  SmallRecording recording(20);
  for (std::size_t i = 6; i < recording.poses.size(); ++i) {
    recording.poses[i].translation.x() += 10.0;
  }
  recording.write(fixture.dataset);
  const CommandResult result = fixture.onboard({"--surroundings", "outdoors"});
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.err, Contains("between scan 5 and 6") && Contains("session of its own"));
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
  const Fixture fixture;
  SmallRecording recording(24);
  for (std::size_t i = 12; i < recording.poses.size(); ++i) {
    recording.poses[i].translation.x() += i < 14 ? 10.0 : 20.0;
  }
  recording.write(fixture.dataset);
  const CommandResult result = fixture.onboard({"--surroundings", "outdoors"});
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.err, Contains("2 scans between breaks are left out"));
  CHECK(fixture.stats()["scans"] == 22);
  CHECK(fixture.stats()["scans_left_out"] == 2);
  fixture.check_labels(recording);
}

TEST_CASE("single points that are NaN, infinite or out of range are counted and keep their index") {
  const Fixture fixture;
  SmallRecording recording;
  auto& points = recording.scans[4].points;
  points[0].x = std::numeric_limits<float>::quiet_NaN();
  points[1].y = std::numeric_limits<float>::infinity();
  points[2].z = -std::numeric_limits<float>::max();
  recording.write(fixture.dataset);
  REQUIRE(fixture.onboard().exit_code == 0);
  CHECK(fixture.stats()["dropped"]["not_finite"] == 2);
  CHECK(fixture.stats()["dropped"]["out_of_range"].get<int>() >= 1);
  fixture.check_labels(recording);
}

TEST_CASE("a run that cannot be written is reported") {
  const Fixture fixture;
  SmallRecording(2).write(fixture.dataset);
  write_text(fixture.directory.path() / "file", "");
  check_refused(run_unimapper({"onboard", fixture.dataset.string(), "--out",
                               (fixture.directory.path() / "file/run").string()}),
                "cannot create the directory");
}

TEST_CASE("real time means at the pace of the stamps") {
  const Fixture fixture;
  SmallRecording(4).write(fixture.dataset);
  const auto start = std::chrono::steady_clock::now();
  REQUIRE(fixture.onboard({"--realtime"}).exit_code == 0);
  CHECK(std::chrono::steady_clock::now() - start >= std::chrono::milliseconds(300));
  CHECK(fixture.stats()["realtime"] == true);
}

TEST_CASE("a run may be searched for the places of an earlier one") {
  const Fixture fixture;
  SmallRecording(15).write(fixture.dataset);
  REQUIRE(fixture.onboard({"--surroundings", "outdoors"}).exit_code == 0);
  const fs::path second = fixture.directory.path() / "second";
  const auto against = [&](const fs::path& earlier) {
    return run_unimapper({"onboard", fixture.dataset.string(), "--out", second.string(), "--sensor",
                          "vlp-16", "--against", earlier.string(), "--all-candidates",
                          "--surroundings", "outdoors", "--replace"});
  };
  const CommandResult result = against(fixture.run);
  INFO(result.err);
  CHECK(result.exit_code == 0);
  const auto stats = nlohmann::json::parse(read_text(second / "stats.json"));
  CHECK(stats["capacity"]["places"]["used"] == 4);  // two of each run

  check_refused(against(fixture.directory.path() / "nowhere"), "keyframes.lcmlog");
  write_text(fixture.run / "keyframes.lcmlog", "garbage");
  check_refused(against(fixture.run), "holds no keyframe");
}

TEST_CASE("a link that cannot be opened is reported") {
  const Fixture fixture;
  SmallRecording(2).write(fixture.dataset);
  check_refused(fixture.onboard({"--publish", "nonsense://nowhere"}), "nonsense://nowhere");
}

TEST_CASE("a spool keeps the keyframes of every run, and a publishing one tries to deliver them",
          "[slow]") {
  const Fixture fixture;
  SmallRecording().write(fixture.dataset);
  const std::string spool = (fixture.directory.path() / "spool").string();
  const CommandResult kept = fixture.onboard({"--spool", spool});
  INFO(kept.err);
  REQUIRE(kept.exit_code == 0);
  CHECK(fixture.stats()["delivery"]["spool"]["keyframes_written"] == 2);
  CHECK(fixture.stats()["delivery"]["spool"]["keyframes_on_disk"] == 2);
  CHECK(fixture.stats()["published"] == false);
  // Over a network without a base.
  const CommandResult published = fixture.onboard({"--spool", spool, "--publish", "memq://"});
  INFO(published.err);
  REQUIRE(published.exit_code == 0);
  CHECK_THAT(published.err, Contains("2 keyframes of 1 earlier sessions") &&
                                Contains("0 of 2 keyframes acknowledged") &&
                                Contains("2 waiting in the spool"));
  const auto delivery = fixture.stats()["delivery"];
  CHECK(delivery["keyframes_published"] == 2);
  CHECK(delivery["keyframes_waiting"] == 2);
  CHECK(delivery["keyframes_lost"] == 0);
  CHECK(delivery["earlier_sessions"]["keyframes"] == 2);
  CHECK(delivery["spool"]["keyframes_on_disk"] == 4);
  const fs::path file = fixture.directory.write("file", "");
  check_refused(fixture.onboard({"--spool", (file / "spool").string()}), "Not a directory");
}
