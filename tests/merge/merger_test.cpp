// Tests of merging whole sessions.
#include "unimapper/merge/merger.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/merge/synthetic_sheets.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/merge/export.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Drive;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;
using unimapper::merge::testing::Town;

namespace {

namespace fs = std::filesystem;

/// Two robots that share streets on different days, and a third in another town. On the second day
/// a van is gone and a kiosk has been set up.
struct Fleet {
  std::vector<Drive> drives;
  std::vector<SessionData> sessions;
  Eigen::Vector3f van{24.0F, 50.8F, 1.0F};
  Eigen::Vector3f kiosk{3.0F, 30.0F, 1.0F};
};

const Fleet& fleet() {
  static const Fleet shared = [] {
    Fleet f;
    Town first = make_town(1, 2);
    Town second = first;
    first.add_box(f.van.x() - 2.5, f.van.y() - 1.0, 5.0, 2.0, 2.2);
    second.add_box(f.kiosk.x() - 1.5, f.kiosk.y() - 1.5, 3.0, 3.0, 2.4);
    const std::vector<Eigen::Vector2d> a{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {0.5, 0}};
    const std::vector<Eigen::Vector2d> b{{2, 1}, {0, 1}, {0, 0}};
    const std::vector<Eigen::Vector2d> c{{0, 0}, {1, 0}, {1, 1}};
    f.drives.push_back(record(first, drive_roads(a), "alpha", 11));
    f.drives.push_back(record(second, drive_roads(b), "beta", 12));
    f.drives.push_back(record(make_town(99, 2), drive_roads(c), "other-town", 13));
    for (const auto& drive : f.drives) f.sessions.push_back(drive.session);
    return f;
  }();
  return shared;
}

const MergeResult& merged() {
  static const MergeResult shared = merge_sessions(fleet().sessions, MergeConfig{});
  return shared;
}

/// Largest distance of the second session's keyframes from the truth, in the first one's frame.
double worst_error_m(const MergeResult& result) {
  const auto& drives = fleet().drives;
  const Pose T_map_world = result.sessions[0].T_map_keyframe[0] * drives[0].truth[0].inverse();
  double worst = 0.0;
  for (std::size_t k = 0; k < drives[1].truth.size(); ++k) {
    const Pose truth = T_map_world * drives[1].truth[k];
    worst = std::max(worst,
                     (truth.translation - result.sessions[1].T_map_keyframe[k].translation).norm());
  }
  return worst;
}

std::size_t changes_near(const MergeResult& result, const Eigen::Vector3f& world, bool appeared) {
  const Pose T_map_world =
      result.sessions[0].T_map_keyframe[0] * fleet().drives[0].truth[0].inverse();
  const Eigen::Vector3f at = (T_map_world * Eigen::Vector3d(world.cast<double>())).cast<float>();
  std::size_t count = 0;
  for (const auto& change : result.changes) {
    if (change.appeared == appeared && (change.position - at).norm() < 4.0F) ++count;
  }
  return count;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) result.push_back(line);
  return result;
}

}  // namespace

TEST_CASE("Two sessions of one town are merged, one of another town stays unconnected",
          "[merger][slow]") {
  const MergeResult& result = merged();
  SECTION("statuses and accuracy") {
    REQUIRE(is_in_map(result.sessions[0].status));
    REQUIRE(is_in_map(result.sessions[1].status));
    CHECK(result.sessions[result.central_session].status == SessionStatus::kCentral);
    CHECK(result.sessions[2].status == SessionStatus::kUnconnected);
    CHECK_FALSE(result.sessions[2].reason.empty());
    CHECK(result.sessions[2].T_map_keyframe.size() == fleet().sessions[2].keyframes.size());
    CHECK(worst_error_m(result) < 0.5);
  }
  SECTION("every loop is accounted for") {
    std::size_t between = 0;
    for (const auto& loop : result.loops) {
      CHECK_FALSE(loop.decision.reason.empty());
      if (!loop.decision.accepted || loop.is_intra_session()) continue;
      CHECK((loop.decision.reason == "descriptor" || loop.decision.reason == "radius"));
      CHECK(loop.query.session != 2);
      CHECK(loop.match.session != 2);
      ++between;
    }
    CHECK(between >= 5);
  }
  SECTION("the unified map fuses what sessions share") {
    std::size_t shared = 0;
    bool foreign = false;
    for (const auto& point : result.map) {
      foreign = foreign || point.session > 1;
      shared += point.sessions_seen > 1 ? 1 : 0;
    }
    CHECK_FALSE(foreign);
    CHECK(shared > 1000);
  }
  SECTION("changes are found, and nothing else") {
    const std::size_t gone = changes_near(result, fleet().van, false);
    const std::size_t new_here = changes_near(result, fleet().kiosk, true);
    CHECK(gone >= 20);
    CHECK(new_here >= 20);
    CHECK(changes_near(result, fleet().van, true) == 0);
    CHECK(changes_near(result, fleet().kiosk, false) == 0);
    CHECK(result.changes.size() <= (gone + new_here) * 5 / 4);
  }
}

TEST_CASE("The number of threads changes nothing, byte for byte", "[merger]") {
  const Town town = make_town(5, 1);
  const std::vector<Eigen::Vector2d> street{{0, 0}, {1, 0}, {1, 0.5}};
  const std::vector<SessionData> two{record(town, drive_roads(street), "alpha", 1).session,
                                     record(town, drive_roads(street), "beta", 2).session};
  const TemporaryDirectory scratch;
  for (const unsigned threads : {1U, 3U}) {
    MergeConfig config;
    config.threads = threads;
    export_map(scratch.path() / std::to_string(threads), two, merge_sessions(two, config));
  }
  for (const char* file : {"map.ply", "changes.ply", "graph.g2o", "loops.csv", "summary.json",
                           "trajectories/alpha.tum", "trajectories/beta.tum"}) {
    INFO(file);
    const std::string one = read(scratch.path() / "1" / file);
    CHECK_FALSE(one.empty());
    CHECK(one == read(scratch.path() / "3" / file));
  }
}

TEST_CASE("A map of leaning odometry frames is level, and its sessions still coincide",
          "[merger]") {
  const Town town = make_town(5, 1);
  std::vector<Drive> drives{record(town, drive_roads({{0, 0}, {0.7, 0}}), "alpha", 1),
                            record(town, drive_roads({{0, 0}, {0.7, 0}}), "beta", 2)};
  const Eigen::Vector3d axes[] = {{1.0, 0.3, 0.0}, {-0.2, 1.0, 0.0}};
  std::vector<SessionData> sessions;
  for (std::size_t s = 0; s < 2; ++s) {
    const Pose leaning(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, axes[s].normalized())),
                       Eigen::Vector3d::Zero());
    for (KeyframeRecord& keyframe : drives[s].session.keyframes) {
      keyframe.T_odometry_keyframe = leaning * keyframe.T_odometry_keyframe;
      for (KeyframeScan& scan : keyframe.scans)
        scan.T_odometry_sensor = keyframe.T_odometry_keyframe;
      keyframe.up = {true, 1e-5F, 0.0F, 1e-5F};
    }
    sessions.push_back(drives[s].session);
  }
  const MergeResult result = merge_sessions(sessions, MergeConfig{});
  const Pose T_map_world = result.sessions[0].T_map_keyframe[0] * drives[0].truth[0].inverse();
  for (std::size_t s = 0; s < 2; ++s) {
    REQUIRE(is_in_map(result.sessions[s].status));
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      INFO("keyframe " << k << " of session " << s);
      const Pose& T_map_keyframe = result.sessions[s].T_map_keyframe[k];
      CHECK(T_map_keyframe.rotation.col(2).head<2>().norm() < 0.0052);  // 0.3 degrees
      const Pose truth = T_map_world * drives[s].truth[k];
      CHECK((T_map_keyframe.translation - truth.translation).norm() < 0.5);
    }
  }
}

TEST_CASE("Exported files are complete and consistent", "[merger][slow]") {
  const TemporaryDirectory scratch;
  const fs::path folder = scratch.path() / "new" / "map";
  export_map(folder, fleet().sessions, merged());

  SECTION(
      "one pose per scan, stamps to the nanosecond, unconnected sessions in a folder of their "
      "own") {
    const auto tum = lines(read(folder / "trajectories" / "alpha.tum"));
    CHECK(tum.size() == 3 * fleet().sessions[0].keyframes.size());
    CHECK(tum.front().rfind("11.000000000 ", 0) == 0);
    CHECK(tum[1].rfind("11.100000000 ", 0) == 0);
    CHECK(fs::exists(folder / "unconnected" / "other-town.tum"));
    CHECK_FALSE(fs::exists(folder / "trajectories" / "other-town.tum"));
  }
  SECTION("a pose graph with one vertex per keyframe and one fixed per piece") {
    const std::string graph = read(folder / "graph.g2o");
    std::size_t vertices = 0;
    std::size_t fixed = 0;
    std::size_t edges = 0;
    for (const auto& line : lines(graph)) {
      vertices += line.rfind("VERTEX_SE3:QUAT ", 0) == 0 ? 1 : 0;
      fixed += line.rfind("FIX ", 0) == 0 ? 1 : 0;
      edges += line.rfind("EDGE_SE3:QUAT ", 0) == 0 ? 1 : 0;
    }
    std::size_t keyframes = 0;
    for (const auto& session : fleet().sessions) keyframes += session.keyframes.size();
    CHECK(vertices == keyframes);
    CHECK(fixed == 2);
    CHECK(edges == merged().graph_edges.size());
  }
  SECTION("loops with the agreed columns") {
    const auto csv = lines(read(folder / "loops.csv"));
    REQUIRE(csv.size() == merged().loops.size() + 1);
    CHECK(csv[0] ==
          "query_session,query_keyframe,query_scan,match_session,match_keyframe,match_scan,"
          "confidence,accepted,reason,x,y,z,qx,qy,qz,qw");
  }
  SECTION("a summary with the status of every session and the reason") {
    const std::string summary = read(folder / "summary.json");
    for (const char* expected :
         {"\"status\": \"central\"", "\"status\": \"merged\"", "\"status\": \"unconnected\"",
          "\"reason\"", "\"intra\"", "\"inter\"", "\"rejected\""}) {
      CHECK(summary.find(expected) != std::string::npos);
    }
    CHECK(summary.find("seconds") == std::string::npos);
  }
  SECTION("a point cloud of the size in its header") {
    const std::string ply = read(folder / "map.ply");
    const std::size_t header = ply.find("end_header\n") + 11;
    CHECK(ply.find("element vertex " + std::to_string(merged().map.size()) + "\n") !=
          std::string::npos);
    CHECK(ply.size() == header + merged().map.size() * 19);
  }
  SECTION("more sessions than the file's 16 bits can number are an error") {
    MergeResult many = merged();
    many.map.push_back({Eigen::Vector3f::Zero(), 65536, 1});
    CHECK_THROWS_WITH(export_map(scratch.path() / "many", fleet().sessions, many),
                      Catch::Contains("65536 sessions"));
  }
  SECTION("a folder that cannot be made is an error with its name") {
    const fs::path file = scratch.path() / "file";
    std::ofstream(file) << "in the way";
    CHECK_THROWS_WITH(export_map(file / "map", fleet().sessions, merged()),
                      Catch::Contains("file"));
  }
}

TEST_CASE("A trajectory has no steps where one keyframe ends and the next begins", "[merger]") {
  // Straight ahead, 4 m from keyframe to keyframe, three scans each. The pose graph stretches
  // every keyframe's step by 60 cm: nine scans must share what three keyframes gained.
  SessionData session;
  MergedSession stretched;
  stretched.status = SessionStatus::kMerged;
  for (int k = 0; k < 8; ++k) {
    KeyframeRecord keyframe;
    keyframe.sequence = static_cast<std::uint32_t>(k);
    keyframe.T_odometry_keyframe.translation.x() = 4.0 * k;
    keyframe.reference_scan = 1;
    for (int i = 0; i < 3; ++i) {
      KeyframeScan scan{static_cast<std::uint32_t>(3 * k + i), 100000000LL * (3 * k + i), Pose{}};
      scan.T_odometry_sensor.translation.x() = 4.0 * k + 4.0 / 3.0 * (i - 1);
      keyframe.scans.push_back(scan);
    }
    session.keyframes.push_back(keyframe);
    Pose pose;
    pose.translation.x() = 4.6 * k;
    stretched.T_map_keyframe.push_back(pose);
  }
  const auto trajectory = session_trajectory(session, stretched);
  REQUIRE(trajectory.size() == 24);
  for (std::size_t i = 1; i + 2 < trajectory.size(); ++i) {
    INFO("scan " << i);
    CHECK(trajectory[i + 1].T_map_sensor.translation.x() -
              trajectory[i].T_map_sensor.translation.x() ==
          Approx(4.6 / 3.0).margin(1e-9));
  }
}

TEST_CASE("Zero sessions, one session, empty sessions", "[merger]") {
  const Town town = make_town(5, 1);
  const SessionData some = record(town, drive_roads({{0, 0}, {0.5, 0}}), "some", 3).session;
  SessionData nothing;
  nothing.info.name = "nothing";
  SECTION("none") {
    const MergeResult result = merge_sessions({}, MergeConfig{});
    CHECK(result.sessions.empty());
    CHECK(result.map.empty());
  }
  SECTION("one") {
    const MergeResult result = merge_sessions({some}, MergeConfig{});
    CHECK(result.sessions[0].status == SessionStatus::kCentral);
    CHECK(result.changes.empty());
    CHECK_FALSE(result.map.empty());
  }
  SECTION("one without keyframes beside one with") {
    const MergeResult result = merge_sessions({nothing, some}, MergeConfig{});
    CHECK(result.central_session == 1);
    CHECK(result.sessions[0].status == SessionStatus::kUnconnected);
    CHECK(result.sessions[0].reason == "no keyframes");
  }
  SECTION("only one without keyframes") {
    const MergeResult result = merge_sessions({nothing}, MergeConfig{});
    CHECK(result.sessions[0].status == SessionStatus::kUnconnected);
    const TemporaryDirectory scratch;
    export_map(scratch.path(), {nothing}, result);
    CHECK(fs::exists(scratch.path() / "map.ply"));
  }
}

TEST_CASE("Cells of an unconnected session are not refined by sessions of the map", "[merger]") {
  // The coordinates of both overlap by chance: where one saw a person, the other saw through.
  SessionData map;
  map.info.name = "map";
  for (std::uint32_t k = 0; k < 8; ++k) {
    map.keyframes.push_back(testing::keyframe_of(k, {testing::kWall}));
  }
  SessionData other;
  other.info.name = "other-town";
  other.keyframes.push_back(testing::keyframe_of(0, {testing::kWall, testing::kPerson}));
  const MergeResult result = merge_sessions({map, other}, MergeConfig{});
  REQUIRE(result.sessions[0].status == SessionStatus::kCentral);
  REQUIRE(result.sessions[1].status == SessionStatus::kUnconnected);
  CHECK(result.sessions[1].refined.at(0).changed.empty());
  // In one frame the same two sessions disagree.
  const auto together = refine({{&map, std::vector<Pose>(8), 0}, {&other, {Pose{}}, 0}}, {}, 1);
  CHECK(together[1][0].changed.size() > 10);
}

TEST_CASE("Invalid sessions are refused with a message", "[merger]") {
  std::vector<SessionData> two(2);
  for (std::size_t s = 0; s < 2; ++s) {
    two[s].info.name = s == 0 ? "alpha" : "beta";
    for (std::uint32_t k = 0; k < 5; ++k) {
      KeyframeRecord keyframe;
      keyframe.sequence = k;
      keyframe.scans.push_back({k, 1000 * k, Pose{}});
      two[s].keyframes.push_back(keyframe);
    }
  }
  MergeConfig config;
  std::string expected;
  SECTION("a pose of NaN") {
    two[1].keyframes[3].T_odometry_keyframe.translation.x() = std::nan("");
    expected = "keyframe 3 has no valid pose";
  }
  SECTION("keyframes out of order") {
    std::swap(two[1].keyframes[2], two[1].keyframes[3]);
    expected = "out of order";
  }
  SECTION("a reference scan that is not there") {
    two[0].keyframes[0].reference_scan = 9;
    expected = "has no reference scan";
  }
  SECTION("a name that would leave the output folder") {
    two[0].info.name = "../alpha";
    expected = "cannot be a file name";
  }
  SECTION("two sessions of one name") {
    two[1].info.name = two[0].info.name;
    expected = "two sessions are named alpha";
  }
  SECTION("a parameter out of range") {
    config.map.voxel_size_m = -1.0F;
    expected = "map.voxel_size_m";
  }
  CHECK_THROWS_WITH(merge_sessions(two, config), Catch::Contains(expected));
}
