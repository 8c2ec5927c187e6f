// End-to-end tests of `unimapper onboard`: files, messages, exit codes.
#include <chrono>
#include <cmath>
#include <cstring>

#include "ports/datasets/ply.hpp"
#include "tests/apps/onboard_run.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

TEST_CASE("a run folder holds labels for every point, keyframes, loops and statistics") {
  const SmallRecording recording;
  const OnboardRun fixture(recording);
  const CommandResult result = fixture.onboard(kOutdoors);
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
  const auto run = read_json(fixture.run / "run.json");
  CHECK(run["session"] == "run");
  CHECK(run["boot"].get<std::string>().size() == 32);
  CHECK(run["sensor"] == "vlp-16");
  CHECK(run["dataset"] == "recording");
}

TEST_CASE("a run that does not know up says so, unless the odometry promises it") {
  const OnboardRun fixture{SmallRecording()};
  const std::string warning = "warning: up is unknown in 2 keyframes";
  CHECK_THAT(fixture.done(),
             Contains(warning) && Contains("odometry.up_sigma_deg promises nothing"));
  CHECK(fixture.stats()["up"]["known"] == 0);
  CHECK(fixture.stats()["up"]["unknown"] == 2);

  const std::string config =
      fixture.directory.write("config.json", R"({"odometry": {"up_sigma_deg": 0.5}})");
  CHECK_THAT(fixture.done({"--config", config}), !Contains(warning));
  CHECK(fixture.stats()["up"]["known"] == 2);
  CHECK(fixture.stats()["up"]["unknown"] == 0);
}

TEST_CASE("the same recording gives the same bytes, with one worker and with two") {
  const OnboardRun fixture(SmallRecording(25));
  const fs::path again = fixture.directory / "again" / "run";
  (void)fixture.done({"--all-candidates"});
  (void)run_well({"onboard", fixture.dataset, "--out", again, "--sensor", "vlp-16",
                  "--all-candidates", "--workers", "2"});
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
  auto second = read_json(again / "stats.json");
  CHECK(first["workers"] == 1);
  CHECK(second["workers"] == std::min(2U, std::thread::hardware_concurrency()));
  CHECK(second["arena_bytes"] > first["arena_bytes"]);
  second["workers"] = 1;
  second["arena_bytes"] = first["arena_bytes"];
  for (const char* timing : {"stage_ms", "total_histogram", "deadline_misses", "closing_call_ms",
                             "hand_over_ms", "load"}) {
    CHECK(first.contains(timing));
    first.erase(timing);
    second.erase(timing);
  }
  CHECK(first == second);
}

TEST_CASE("the setting for indoors is taken on request, and both outputs name it") {
  const OnboardRun fixture{SmallRecording()};
  for (const std::string setting : {"indoors", "outdoors"}) {
    CHECK_THAT(fixture.done({"--surroundings", setting}),
               Contains("surroundings " + setting + " (from --surroundings)"));
    CHECK(fixture.stats().at("surroundings").at("setting") == setting);
  }
  const CommandResult dumped =
      run_unimapper({"onboard", fixture.dataset, "--surroundings", "indoors", "--dump-config"});
  CHECK(nlohmann::json::parse(dumped.out).at("descriptor").at("column_size_m") == 0.2);
}

TEST_CASE("an earlier run is kept without --replace, and with it nothing of the run is left") {
  const OnboardRun fixture{SmallRecording()};
  (void)run_well(fixture.words());
  const std::string run = read_text(fixture.run / "keyframes.lcmlog");
  check_refused(run_unimapper(fixture.words()), "holds an earlier run; --replace overwrites it");
  CHECK(read_text(fixture.run / "keyframes.lcmlog") == run);
  (void)fixture.done({"--scans", "5"});
  CHECK(fixture.stats()["scans"] == 5);
  CHECK(fixture.stats()["keyframes"] == 1);
  CHECK(datasets::list_files(fixture.run / "labels", ".label").size() == 5);
}

TEST_CASE("labels that may be ground truth are not overwritten") {
  const OnboardRun fixture{SmallRecording()};
  write_text(fixture.dataset / "labels/000000.label", "truth");
  check_refused(run_unimapper({"onboard", fixture.dataset, "--out", fixture.dataset}),
                "choose another --out");
  CHECK(read_text(fixture.dataset / "labels/000000.label") == "truth");
}

TEST_CASE("the sensor comes from --sensor, else dataset.json, else the format, and is reported") {
  const OnboardRun fixture(SmallRecording(2));
  const auto check_said = [&](const Words& more, const char* said) {
    const Words onboard = {"onboard", fixture.dataset, "--out", fixture.run, "--replace"};
    CHECK_THAT(run_unimapper(onboard, more).err, Contains(said));
  };
  check_said({}, "sensor generic");
  write_text(fixture.dataset / "dataset.json", R"({"sensor": "livox-avia"})");
  check_said({}, "sensor livox-avia (from dataset.json)");
  check_said({"--sensor", "VLP-16"}, "sensor vlp-16 (from --sensor)");
  check_said({"--sensor", "thermometer"}, "unknown sensor 'thermometer'");
  check_said({"--sensor", "os3-128"}, "did you mean 'os2-128'?");
  fs::rename(fixture.dataset / "scans", fixture.dataset / "velodyne");
  fs::remove(fixture.dataset / "dataset.json");
  check_said({}, "sensor hdl-64e");
}

TEST_CASE("a mode with twice the columns runs without overflow") {
  const OnboardRun fixture;
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
    return fixture.done();
  };
  CHECK_THAT(turn(1808), !Contains("columns"));
  CHECK_THAT(turn(3616), Contains("room for a mode of 3616 columns") &&
                             !Contains("scan_too_large") && !Contains("cells_full"));
}

TEST_CASE("a run that cannot be written and a link that cannot be opened are reported") {
  const OnboardRun fixture(SmallRecording(2));
  const fs::path file = fixture.directory.write("file", "");
  check_refused(run_unimapper({"onboard", fixture.dataset, "--out", file / "run"}),
                "cannot create the directory");
  check_refused(fixture.onboard({"--publish", "nonsense://nowhere"}), "nonsense://nowhere");
  check_refused(fixture.onboard({"--spool", file / "spool"}), "Not a directory");
}

TEST_CASE("real time means at the pace of the stamps") {
  const OnboardRun fixture(SmallRecording(4));
  const auto start = std::chrono::steady_clock::now();
  (void)fixture.done({"--realtime"});
  CHECK(std::chrono::steady_clock::now() - start >= std::chrono::milliseconds(300));
  CHECK(fixture.stats()["realtime"] == true);
}

TEST_CASE("a run may be searched for the places of an earlier one") {
  const OnboardRun fixture(SmallRecording(15));
  (void)fixture.done(kOutdoors);
  const fs::path second = fixture.directory / "second";
  const auto against = [&](const fs::path& earlier) {
    return run_unimapper({"onboard", fixture.dataset, "--out", second, "--sensor", "vlp-16",
                          "--against", earlier, "--all-candidates", "--surroundings", "outdoors",
                          "--replace"});
  };
  const CommandResult result = against(fixture.run);
  INFO(result.err);
  CHECK(result.exit_code == 0);
  CHECK(read_json(second / "stats.json")["capacity"]["places"]["used"] == 4);  // two of each run
  check_refused(against(fixture.directory / "nowhere"), "keyframes.lcmlog");
  write_text(fixture.run / "keyframes.lcmlog", "garbage");
  check_refused(against(fixture.run), "holds no keyframe");
}

TEST_CASE("intensities of a recording reach the map, and what is sent if they are asked for") {
  const OnboardRun fixture{SmallRecording()};
  const std::string spool = fixture.directory / "spool";
  const auto bytes = [&](const Words& words) -> std::size_t {
    (void)fixture.done(words);
    return fixture.stats()["message_bytes_per_keyframe"]["all"];
  };
  const std::size_t without = bytes({"--spool", spool});
  const std::size_t with = bytes({"--spool", spool, "--intensity"});
  CHECK(with > without + 1000);
  CHECK(bytes({}) == with);
  const fs::path map = fixture.directory / "map";
  (void)run_well({"merge", fixture.run, "--out", map});
  datasets::Scan points;
  datasets::parse_ply(datasets::read_file(map / "map.ply"), "map.ply", points);
  // The ground has 0.1 of 255, walls have 0.5.
  for (const auto& [height, intensity] : {std::pair{-2.0F, 26.0F}, {0.0F, 128.0F}}) {
    CHECK(std::any_of(points.points.begin(), points.points.end(), [&](const auto& point) {
      return std::abs(point.z - height) < 0.2F && point.intensity == intensity;
    }));
  }
}

TEST_CASE("a spool keeps the keyframes of every run, and a publishing one tries to deliver them",
          "[slow]") {
  const OnboardRun fixture{SmallRecording()};
  const std::string spool = fixture.directory / "spool";
  (void)fixture.done({"--spool", spool});
  CHECK(fixture.stats()["delivery"]["spool"]["keyframes_written"] == 2);
  CHECK(fixture.stats()["delivery"]["spool"]["keyframes_on_disk"] == 2);
  CHECK(fixture.stats()["published"] == false);
  // Over a network without a base.
  CHECK_THAT(fixture.done({"--spool", spool, "--publish", "memq://"}),
             Contains("2 keyframes of 1 earlier sessions") &&
                 Contains("0 of 2 keyframes acknowledged") && Contains("2 waiting in the spool"));
  const auto delivery = fixture.stats()["delivery"];
  CHECK(delivery["keyframes_published"] == 2);
  CHECK(delivery["keyframes_waiting"] == 2);
  CHECK(delivery["keyframes_lost"] == 0);
  CHECK(delivery["earlier_sessions"]["keyframes"] == 2);
  CHECK(delivery["spool"]["keyframes_on_disk"] == 4);
}
