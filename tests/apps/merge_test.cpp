// End-to-end tests of `unimapper merge`: exit codes.
#include <Eigen/Core>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "ports/datasets/files.hpp"
#include "ports/datasets/ply.hpp"
#include "tests/apps/command.hpp"
#include "tests/recordings.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;

namespace fs = std::filesystem;

namespace {

/// Runs of recordings that share nothing the merger could find: they are too short.
struct Fixture {
  TemporaryDirectory directory;

  /// A run of `recording`, called `name`.
  std::string run(const std::string& name, const SmallRecording& recording,
                  const std::vector<std::string>& more = {}) const {
    const fs::path dataset = directory / (name + "-data");
    const fs::path run = directory / name;
    recording.write(dataset);
    std::vector<std::string> arguments{"onboard",    dataset.string(), "--out",
                                       run.string(), "--sensor",       "vlp-16"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    (void)run_unimapper(arguments);
    return run.string();
  }
  CommandResult merge(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "merge");
    arguments.insert(arguments.end(), {"--out", (directory / "map").string(), "--replace"});
    return run_unimapper(arguments);
  }
};

/// Positions of a file with one pose a line, whose numbers `x`, `y` and `z` are.
std::vector<Eigen::Vector3d> positions(const fs::path& file, std::size_t x, std::size_t y,
                                       std::size_t z) {
  std::vector<Eigen::Vector3d> all;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream text(line);
    const std::vector<double> numbers(std::istream_iterator<double>(text), {});
    all.emplace_back(numbers.at(x), numbers.at(y), numbers.at(z));
  }
  return all;
}

}  // namespace

TEST_CASE("A LiDAR that looks ahead and one that looks all round are merged in a town", "[slow]") {
  const fs::path pair = unimapper::testing::find_recording("refused_pair");
  if (pair.empty()) return;
  const Fixture fixture;
  const CommandResult merged =
      fixture.merge({(pair / "os2-128.lcmlog").string(), (pair / "avia.lcmlog").string()});
  INFO(merged.err);
  REQUIRE(merged.exit_code == 0);
  const fs::path trajectories = fixture.directory / "map" / "trajectories";
  const auto os2 = positions(trajectories / "run_town_os2.tum", 1, 2, 3);
  const auto avia = positions(trajectories / "run_town_avia.tum", 1, 2, 3);
  const auto true_os2 = positions(pair / "os2-128_gt_poses.txt", 3, 7, 11);
  const auto true_avia = positions(pair / "avia_gt_poses.txt", 3, 7, 11);
  REQUIRE(os2.size() == true_os2.size());
  REQUIRE(avia.size() == true_avia.size());
  // Where both robots pass the same place.
  std::size_t compared = 0;
  for (std::size_t i = 0; i < os2.size(); i += 10) {
    for (std::size_t k = 0; k < avia.size(); k += 10) {
      const double distance = (true_os2[i] - true_avia[k]).norm();
      if (distance > 5.0) continue;
      CHECK(std::abs((os2[i] - avia[k]).norm() - distance) < 0.5);
      ++compared;
    }
  }
  CHECK(compared > 20);
}

TEST_CASE("a session left apart is a failure unless it is allowed") {
  const Fixture fixture;
  const std::string a = fixture.run("a", SmallRecording(12));
  const std::string b = fixture.run("b", SmallRecording(14));
  const CommandResult apart = fixture.merge({a, b});
  INFO(apart.err);
  CHECK(apart.exit_code == 1);
  CHECK_THAT(apart.err, Contains("left apart from the map: ") && Contains("--allow-unconnected"));
  // The map of the rest is there all the same.
  CHECK(fs::exists(fixture.directory / "map/report.html"));
  CHECK(fixture.merge({a, b, "--allow-unconnected"}).exit_code == 0);
  CHECK(fixture.merge({a}).exit_code == 0);
}

TEST_CASE("poses in a country's coordinates give the same map, about an origin near it") {
  const Eigen::Vector3d far = GENERATE(Eigen::Vector3d(1000.0, 2000.0, 30.0),
                                       Eigen::Vector3d(448262.318, 5411904.557, 312.2));
  const Fixture fixture;
  SmallRecording recording(12);
  for (Pose& pose : recording.poses) pose.translation += far;
  const std::string run = fixture.run("a", recording);
  const CommandResult merged = fixture.merge({run});
  INFO(merged.err);
  REQUIRE(merged.exit_code == 0);
  const fs::path map = fixture.directory / "map";
  const auto summary = nlohmann::json::parse(read_text(map / "summary.json"));
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const auto& session = summary["sessions"][0];
  CHECK(session.contains("origin") == (far.x() > 1e4));
  for (int axis = 0; axis < 3 && session.contains("origin"); ++axis) {
    origin[axis] = session["origin"][static_cast<std::size_t>(axis)];
  }
  CHECK((far - origin).norm() < 2300.0);
  // Trajectories are in the user's coordinates, points count from the origin.
  const auto driven = positions(map / "trajectories/a.tum", 1, 2, 3);
  REQUIRE(driven.size() == recording.poses.size());
  for (std::size_t i = 0; i < driven.size(); ++i) {
    CHECK((driven[i] - recording.poses[i].translation).norm() < 0.01);
  }
  CHECK((driven[0] - recording.poses[0].translation).norm() < 0.001);
  datasets::Scan points;
  datasets::parse_ply(datasets::read_file(map / "map.ply"), map / "map.ply", points);
  CHECK(points.points.size() > 1000);
  CHECK(std::all_of(points.points.begin(), points.points.end(), [&](const auto& p) {
    return (Eigen::Vector3d(p.x, p.y, p.z) + origin - far).norm() < 120.0;
  }));
}

TEST_CASE("a run that is given twice counts once") {
  const Fixture fixture;
  const std::string run = fixture.run("drive", SmallRecording(12));
  const fs::path copy = fixture.directory / "copy";
  fs::copy(run, copy, fs::copy_options::recursive);
  const CommandResult merged = fixture.merge({run, copy.string(), run});
  INFO(merged.err);
  CHECK(merged.exit_code == 0);
  CHECK_THAT(merged.err, Contains("given twice and counts once"));
  CHECK_THAT(merged.out, Contains("1 of 1 sessions"));
}

TEST_CASE("a merge of runs leaves no copy of them, and its map does not depend on its memory") {
  const Fixture fixture;
  const std::string a = fixture.run("a", SmallRecording(12));
  const std::string b = fixture.run("b", SmallRecording(14));
  REQUIRE(fixture.merge({a, b, "--allow-unconnected"}).exit_code == 0);
  const fs::path map = fixture.directory / "map";
  const std::string ample = read_text(map / "map.ply");
  REQUIRE_FALSE(ample.empty());
  for (const auto& entry : fs::recursive_directory_iterator(map)) {
    CHECK_THAT(entry.path().filename().string(), !StartsWith(".") && !EndsWith(".sqlite"));
  }
  REQUIRE(fixture.merge({a, b, "--allow-unconnected", "--memory", "1"}).exit_code == 0);
  CHECK(read_text(map / "map.ply") == ample);
}

TEST_CASE("cells of another edge than labels are refined with are warned of") {
  const Fixture fixture;
  const fs::path onboard = fixture.directory / "onboard.json";
  const fs::path base = fixture.directory / "base.json";
  write_text(onboard, R"({"voxel": {"fine_size_m": 0.25, "coarse_size_m": 2.0}})");
  write_text(base, R"({"refinement": {"cell_size_m": 0.25}})");
  const std::string run = fixture.run("a", SmallRecording(12), {"--config", onboard.string()});
  const CommandResult unlike = fixture.merge({run});
  CHECK_THAT(unlike.err, Contains("the cells of session a have an edge of 0.25 m") &&
                             Contains("set refinement.cell_size_m"));
  CHECK_THAT(fixture.merge({run, "--config", base.string()}).err, !Contains("have an edge of"));
  CHECK_THAT(fixture.merge({fixture.run("b", SmallRecording(12))}).err,
             !Contains("have an edge of"));
}

TEST_CASE("what is no run is refused with what to give instead") {
  const Fixture fixture;
  const std::string run = fixture.run("a", SmallRecording(3));
  const CommandResult above = fixture.merge({fixture.directory.path().string()});
  CHECK(above.exit_code == 1);
  CHECK_THAT(above.err, Contains("runs in it: " + run));
  const fs::path recording = fixture.directory / "drive.mcap";
  write_text(recording, "a recording");
  const CommandResult raw = fixture.merge({recording.string()});
  CHECK(raw.exit_code == 1);
  CHECK_THAT(raw.err, Contains("`unimapper onboard` makes a run of it first"));
}

TEST_CASE("a run of which nothing came makes no map") {
  const Fixture fixture;
  SmallRecording recording(2);
  for (auto& scan : recording.scans) {
    for (auto& point : scan.points) point.x += 10000.0F;  // out of range
  }
  const CommandResult empty = fixture.merge({fixture.run("a", recording)});
  INFO(empty.err);
  CHECK(empty.exit_code == 1);
}
