// End-to-end tests of `unimapper merge`: exit codes.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "ports/datasets/files.hpp"
#include "ports/datasets/ply.hpp"
#include "tests/apps/project.hpp"
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
  fs::path map = directory / "map";

  [[nodiscard]] std::string run(const std::string& name, std::size_t scans) const {
    return make_run(directory, name, scans);
  }
  [[nodiscard]] CommandResult merge(const Words& arguments) const {
    return run_unimapper({"merge", "--out", map, "--replace"}, arguments);
  }
};

/// Positions of a file with one pose a line, whose numbers `x`, `y` and `z` are.
std::vector<Eigen::Vector3d> positions(const fs::path& file, std::size_t x, std::size_t y,
                                       std::size_t z) {
  std::vector<Eigen::Vector3d> all;
  for (const auto& row : read_rows(file)) all.emplace_back(row.at(x), row.at(y), row.at(z));
  return all;
}

}  // namespace

TEST_CASE("A LiDAR that looks ahead and one that looks all round are merged in a town", "[slow]") {
  const fs::path pair = unimapper::testing::find_recording("refused_pair");
  if (pair.empty()) return;
  const Fixture fixture;
  const CommandResult merged = fixture.merge({pair / "os2-128.lcmlog", pair / "avia.lcmlog"});
  INFO(merged.err);
  REQUIRE(merged.exit_code == 0);
  const fs::path trajectories = fixture.map / "trajectories";
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

TEST_CASE(
    "a session left apart is a failure unless it is allowed, and little memory changes no map") {
  const Fixture fixture;
  const std::string a = fixture.run("a", 12);
  const std::string b = fixture.run("b", 14);
  const CommandResult apart = fixture.merge({a, b});
  check_fails(apart, "left apart from the map: ");
  CHECK_THAT(apart.err, Contains("--allow-unconnected"));
  // The map of the rest is there all the same.
  CHECK(fs::exists(fixture.map / "report.html"));
  REQUIRE(fixture.merge({a, b, "--allow-unconnected"}).exit_code == 0);
  const std::string ample = read_text(fixture.map / "map.ply");
  REQUIRE_FALSE(ample.empty());
  // No copy of the runs is left.
  for (const auto& entry : fs::recursive_directory_iterator(fixture.map)) {
    CHECK_THAT(entry.path().filename().string(), !StartsWith(".") && !EndsWith(".sqlite"));
  }
  REQUIRE(fixture.merge({a, b, "--allow-unconnected", "--memory", "1"}).exit_code == 0);
  CHECK((read_text(fixture.map / "map.ply") == ample));
}

TEST_CASE("poses in a country's coordinates give the same map, about an origin near it") {
  const Eigen::Vector3d far = GENERATE(Eigen::Vector3d(1000.0, 2000.0, 30.0),
                                       Eigen::Vector3d(448262.318, 5411904.557, 312.2));
  const Fixture fixture;
  SmallRecording recording(12);
  for (Pose& pose : recording.poses) pose.translation += far;
  (void)run_well({"merge", make_run(fixture.directory, "a", recording), "--out", fixture.map});
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const auto session = read_json(fixture.map / "summary.json")["sessions"][0];
  CHECK(session.contains("origin") == (far.x() > 1e4));
  for (int axis = 0; axis < 3 && session.contains("origin"); ++axis) {
    origin[axis] = session["origin"][static_cast<std::size_t>(axis)];
  }
  CHECK((far - origin).norm() < 2300.0);
  // Trajectories are in the user's coordinates, points count from the origin.
  const auto driven = positions(fixture.map / "trajectories/a.tum", 1, 2, 3);
  REQUIRE(driven.size() == recording.poses.size());
  for (std::size_t i = 0; i < driven.size(); ++i) {
    CHECK((driven[i] - recording.poses[i].translation).norm() < 0.01);
  }
  CHECK((driven[0] - recording.poses[0].translation).norm() < 0.001);
  datasets::Scan points;
  datasets::parse_ply(datasets::read_file(fixture.map / "map.ply"), "map.ply", points);
  CHECK(points.points.size() > 1000);
  CHECK(std::all_of(points.points.begin(), points.points.end(), [&](const auto& p) {
    return (Eigen::Vector3d(p.x, p.y, p.z) + origin - far).norm() < 120.0;
  }));
}

TEST_CASE("a run that is given twice counts once") {
  const Fixture fixture;
  const std::string run = fixture.run("drive", 12);
  const fs::path copy = fixture.directory / "copy";
  fs::copy(run, copy, fs::copy_options::recursive);
  const CommandResult merged = fixture.merge({run, copy, run});
  INFO(merged.err);
  CHECK(merged.exit_code == 0);
  CHECK_THAT(merged.err, Contains("given twice and counts once"));
  CHECK_THAT(merged.out, Contains("1 of 1 sessions"));
}

TEST_CASE("cells of another edge than labels are refined with are warned of") {
  const Fixture fixture;
  const std::string onboard = fixture.directory.write(
      "onboard.json", R"({"voxel": {"fine_size_m": 0.25, "coarse_size_m": 2.0}})");
  const std::string base =
      fixture.directory.write("base.json", R"({"refinement": {"cell_size_m": 0.25}})");
  const std::string run =
      make_run(fixture.directory, "a", SmallRecording(12), {"--config", onboard});
  CHECK_THAT(fixture.merge({run}).err, Contains("the cells of session a have an edge of 0.25 m") &&
                                           Contains("set refinement.cell_size_m"));
  CHECK_THAT(fixture.merge({run, "--config", base}).err, !Contains("have an edge of"));
  CHECK_THAT(fixture.merge({fixture.run("b", 12)}).err, !Contains("have an edge of"));
}

TEST_CASE("what is no run is refused with what to give instead, and an empty run makes no map") {
  const Fixture fixture;
  const std::string run = fixture.run("a", 3);
  check_fails(fixture.merge({fixture.directory.path()}), "runs in it: " + run);
  check_fails(fixture.merge({fixture.directory.write("drive.mcap", "a recording")}),
              "`unimapper onboard` makes a run of it first");
  SmallRecording recording(2);
  for (auto& scan : recording.scans) {
    for (auto& point : scan.points) point.x += 10000.0F;  // out of range
  }
  const fs::path empty = fixture.directory / "empty";
  recording.write(empty / "data");
  (void)run_unimapper({"onboard", empty / "data", "--out", empty / "run", "--sensor", "vlp-16"});
  check_fails(fixture.merge({empty / "run"}), "");
}
