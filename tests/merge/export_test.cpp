// Contents of a merged map's files: trajectories, loops, points, summary
#include "unimapper/merge/export.hpp"

#include <nlohmann/json.hpp>

#include "src/merge/export/export_files.hpp"
#include "src/merge/export/loops_csv.hpp"
#include "tests/merge/exported_files.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Three scans a keyframe, anywhere and turned in any way.
SessionData random_session(Random& random, const std::string& name, std::size_t keyframes) {
  SessionData session;
  session.info.name = name;
  session.info.sensor = "os2-128";
  for (std::size_t k = 0; k < keyframes; ++k) {
    KeyframeRecord& keyframe = session.keyframes.emplace_back();
    keyframe.sequence = static_cast<std::uint32_t>(2 * k + 5);
    keyframe.reference_scan = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t scan = 3 * k + i;
      keyframe.scans.push_back({static_cast<std::uint32_t>(100 + scan),
                                static_cast<std::int64_t>(1'000'000'000 + 100'000'000 * scan),
                                random.pose(20.0, 1.0)});
    }
    keyframe.T_odometry_keyframe = keyframe.scans[1].T_odometry_sensor * random.pose(0.0, 0.1);
  }
  return session;
}

double difference(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() + (a.rotation - b.rotation).norm();
}

nlohmann::json read_json(const std::filesystem::path& path) {
  return nlohmann::json::parse(read(path));
}

/// Of a PLY file, without its header.
std::string body(const std::filesystem::path& path) {
  const std::string ply = read(path);
  return ply.substr(ply.find("end_header\n") + 11);
}

template <typename... Numbers>
std::string bytes(const Numbers&... numbers) {
  std::string all;
  (all.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
  return all;
}

}  // namespace

TEST_CASE("Where the graph only moved odometry as a whole the trajectory is odometry, moved",
          "[export]") {
  Random random(3);
  const SessionData session = random_session(random, "alpha", 5);
  const Pose T_map_odometry = random.pose(50.0, 1.0);
  MergedSession merged;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    merged.T_map_keyframe.push_back(T_map_odometry * keyframe.T_odometry_keyframe);
  }
  const auto trajectory = session_trajectory(session, merged);
  REQUIRE(trajectory.size() == 15);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const KeyframeScan& scan = session.keyframes[i / 3].scans[i % 3];
    CHECK(trajectory[i].stamp_ns == scan.stamp_ns);
    CHECK(difference(trajectory[i].T_map_sensor, T_map_odometry * scan.T_odometry_sensor) < 1e-9);
  }
}

TEST_CASE("A trajectory has no steps where one keyframe ends and the next begins", "[export]") {
  // Straight ahead, 4 m from keyframe to keyframe, three scans each. The pose graph stretches
  // every keyframe's step by 60 cm: nine scans must share what three keyframes gained.
  SessionData session;
  MergedSession stretched;
  stretched.status = SessionStatus::kMerged;
  for (int k = 0; k < 8; ++k) {
    KeyframeRecord& keyframe = session.keyframes.emplace_back();
    keyframe.sequence = static_cast<std::uint32_t>(k);
    keyframe.T_odometry_keyframe = shifted(4.0 * k);
    keyframe.reference_scan = 1;
    for (int i = 0; i < 3; ++i) {
      keyframe.scans.push_back({static_cast<std::uint32_t>(3 * k + i), 100000000LL * (3 * k + i),
                                shifted(4.0 * k + 4.0 / 3.0 * (i - 1))});
    }
    stretched.T_map_keyframe.push_back(shifted(4.6 * k));
  }
  const auto trajectory = session_trajectory(session, stretched);
  REQUIRE(trajectory.size() == 24);
  for (std::size_t i = 1; i + 2 < trajectory.size(); ++i) {
    INFO("scan " << i);
    const Pose& here = trajectory[i].T_map_sensor;
    CHECK(trajectory[i + 1].T_map_sensor.translation.x() - here.translation.x() ==
          Approx(4.6 / 3.0).margin(1e-9));
  }
}

TEST_CASE("A trajectory has one pose per scan, in a folder of its own if it is unconnected",
          "[export]") {
  Random random(6);
  const std::vector<SessionData> sessions{random_session(random, "alpha", 3),
                                          random_session(random, "beta", 2)};
  MergeResult result;
  for (const SessionData& session : sessions) {
    result.sessions.emplace_back().T_map_keyframe.resize(session.keyframes.size());
  }
  result.sessions[0].status = SessionStatus::kCentral;
  result.sessions[1].status = SessionStatus::kUnconnected;
  const TemporaryDirectory scratch;
  export_map(scratch / "new/map", sessions, result);
  const std::string tum = read(scratch / "new/map/trajectories/alpha.tum");
  CHECK(std::count(tum.begin(), tum.end(), '\n') == 9);
  CHECK(tum.rfind("1.000000000 ", 0) == 0);
  CHECK(tum.find("\n1.100000000 ") != std::string::npos);
  CHECK(std::filesystem::exists(scratch / "new/map/unconnected/beta.tum"));
  CHECK_FALSE(std::filesystem::exists(scratch / "new/map/trajectories/beta.tum"));
}

TEST_CASE("What cannot be exported is an error in words", "[export]") {
  const TemporaryDirectory scratch;
  MergeResult result;
  // The file has 16 bits for the session.
  result.map.push_back({Eigen::Vector3f::Zero(), 65536, 1});
  CHECK_THROWS_WITH(export_map(scratch / "many", {}, result), Catch::Contains("65536 sessions"));
  const std::filesystem::path file = scratch.write("file", "in the way");
  CHECK_THROWS_WITH(export_map(file / "map", {}, MergeResult()), Catch::Contains("file"));
}

TEST_CASE("Loops are written between sensor frames, by name, sequence and scan", "[export]") {
  Random random(4);
  const std::vector<SessionData> sessions{random_session(random, "alpha", 3),
                                          random_session(random, "beta", 4)};
  MergeResult result;
  LoopConstraint& loop = result.loops.emplace_back();
  loop.query = {1, 3};
  loop.match = {0, 2};
  loop.T_match_query = random.pose(3.0, 0.5);
  loop.confidence = 0.75F;
  loop.decision = {true, "radius"};
  const TemporaryDirectory scratch;
  write_loops(scratch / "loops.csv", sessions, result);
  const std::vector<LoopRecord> read_back = read_loops_csv(scratch / "loops.csv");
  REQUIRE(read_back.size() == 1);
  const LoopRecord& record = read_back[0];
  CHECK(record.query_session == "beta");
  CHECK(record.match_session == "alpha");
  CHECK((std::pair(record.query_keyframe, record.query_scan) == std::pair(11U, 110U)));
  CHECK((std::pair(record.match_keyframe, record.match_scan) == std::pair(9U, 107U)));
  CHECK(record.confidence == 0.75);
  CHECK(record.accepted);
  CHECK(record.reason == "radius");
  const KeyframeRecord& query = sessions[1].keyframes[3];
  const KeyframeRecord& match = sessions[0].keyframes[2];
  const auto T_keyframe_sensor = [](const KeyframeRecord& keyframe) {
    return keyframe.T_odometry_keyframe.inverse() * keyframe.scans[1].T_odometry_sensor;
  };
  const Pose expected =
      T_keyframe_sensor(match).inverse() * loop.T_match_query * T_keyframe_sensor(query);
  CHECK(difference(record.T_match_query, expected) < 1e-9);
}

TEST_CASE("The summary counts loops, shared points, changes and the sessions' points", "[export]") {
  Random random(5);
  std::vector<SessionData> sessions{random_session(random, "alpha", 2),
                                    random_session(random, "beta", 3)};
  for (KeyframeRecord& keyframe : sessions[1].keyframes) {
    keyframe.points_in = 1000;
    keyframe.points_dynamic = 10;
    keyframe.odometry_contradicted = true;
  }
  sessions[1].complete = true;
  sessions[1].keyframes_missing = 4;
  sessions[1].keyframes_damaged = 2;
  MergeResult result;
  result.sessions.resize(2);
  result.sessions[0] = {SessionStatus::kUnconnected, "no loops found", {}, {}, {}, {}, 1.0};
  result.sessions[1].status = SessionStatus::kCentral;
  const auto add = [&](std::size_t query, std::size_t match, bool accepted, const char* reason) {
    LoopConstraint& loop = result.loops.emplace_back();
    loop.query = {query, 0};
    loop.match = {match, 1};
    loop.decision = {accepted, reason};
  };
  add(0, 0, true, "descriptor");
  add(1, 1, true, "radius");
  add(1, 0, true, "descriptor");
  add(0, 1, true, "descriptor");
  add(1, 1, true, "radius");
  add(1, 0, false, "not level");
  for (const bool is_shared : {false, true, true, false}) {
    result.map.push_back({Eigen::Vector3f::Zero(), 0, is_shared ? 2U : 1U});
  }
  for (const bool appeared : {true, false, false}) {
    result.changes.push_back({Eigen::Vector3f::Zero(), 1, appeared});
  }
  const TemporaryDirectory scratch;
  write_summary(scratch / "summary.json", sessions, result);
  const auto json = read_json(scratch / "summary.json");
  CHECK(json["loops"] ==
        nlohmann::json(
            {{"intra", 3}, {"inter", 2}, {"rejected", 1}, {"by_descriptor", 3}, {"by_radius", 2}}));
  CHECK(json["map"] == nlohmann::json({{"points", 4}, {"seen_by_several_sessions", 2}}));
  CHECK(json["changes"] == nlohmann::json({{"appeared", 1}, {"gone", 2}}));
  CHECK(json["sessions"][0]["name"] == "alpha");
  CHECK(json["sessions"][0]["status"] == "unconnected");
  CHECK(json["sessions"][0]["reason"] == "no loops found");
  CHECK(json["sessions"][0]["complete"] == false);
  CHECK(json["sessions"][1] == nlohmann::json({{"name", "beta"},
                                               {"status", "central"},
                                               {"keyframes", 3},
                                               {"sensor", "os2-128"},
                                               {"complete", true},
                                               {"keyframes_up_known", 0},
                                               {"keyframes_odometry_contradicted", 3},
                                               {"keyframes_missing", 4},
                                               {"keyframes_by_summary", 0},
                                               {"keyframes_damaged", 2},
                                               {"points_in", 3000},
                                               {"points_dynamic", 30}}));
}

TEST_CASE("Points are written with their session, and changes with their direction", "[export]") {
  MergeResult result;
  result.map.push_back({{1.5F, -2.0F, 3.0F}, 7, 2});
  result.map.push_back({{4.0F, 5.0F, 6.0F}, 300, 1});
  result.changes.push_back({{1.0F, 2.0F, 3.0F}, 4, true});
  result.changes.push_back({{7.0F, 8.0F, 9.5F}, 513, false, 70000});
  const TemporaryDirectory scratch;
  write_map_points(scratch / "map.ply", result.map);
  write_changed_points(scratch / "changes.ply", result.changes);
  const std::string map = body(scratch / "map.ply");
  REQUIRE(map.size() == 2 * 19);
  const auto u16 = [](int number) { return static_cast<std::uint16_t>(number); };
  CHECK(map.substr(0, 12) == bytes(1.5F, -2.0F, 3.0F));
  CHECK(map.substr(15, 4) == bytes(u16(7), u16(2)));
  CHECK(map.substr(19, 12) == bytes(4.0F, 5.0F, 6.0F));
  CHECK(map.substr(34, 4) == bytes(u16(300), u16(1)));
  const std::string green("\x00\xC8\x00", 3);
  const std::string red("\xDC\x00\x00", 3);
  CHECK(body(scratch / "changes.ply") ==
        bytes(1.0F, 2.0F, 3.0F) + green + bytes(u16(4), std::uint8_t{1}, std::uint32_t{0}) +
            bytes(7.0F, 8.0F, 9.5F) + red + bytes(u16(513), std::uint8_t{0}, std::uint32_t{70000}));
}

TEST_CASE("Changed objects are written with kind, sessions and box", "[export]") {
  std::vector<SessionData> sessions(2);
  sessions[0].info.name = "monday";
  sessions[1].info.name = "tuesday";
  MergeResult result;
  result.changed_objects.resize(2);
  ChangedObject& gone = result.changed_objects[0];
  gone.kind = ChangeKind::kGone;
  gone.session = 0;
  gone.free_in = 1;
  gone.box = {{1.0, 2.0, 3.0}, 0.5, {4.0, 2.0, 1.5}};
  gone.voxels = 77;
  gone.confidence = 0.875;
  gone.seen_through = 0.125;
  ChangedObject& moved = result.changed_objects[1];
  moved.kind = ChangeKind::kMoved;
  moved.session = 1;
  moved.free_in = 0;
  moved.box = {{50.0, 2.0, 3.0}, 0.0, {1.0, 1.0, 1.0}};
  moved.before = UprightBox{{49.0, 2.0, 3.0}, 0.0, {1.0, 1.0, 1.0}};
  const TemporaryDirectory scratch;
  const auto written = [&](const ExportOptions& options) {
    write_changed_objects(scratch / "changes.json", sessions, result, options);
    return read_json(scratch / "changes.json").at("objects");
  };
  const nlohmann::json all = written({});
  REQUIRE(all.size() == 2);
  CHECK(all[0] ==
        nlohmann::json(
            {{"object", 0},
             {"kind", "gone"},
             {"session", "monday"},
             {"free_in", "tuesday"},
             {"box", {{"centre", {1.0, 2.0, 3.0}}, {"yaw", 0.5}, {"size", {4.0, 2.0, 1.5}}}},
             {"voxels", 77},
             {"confidence", 0.875},
             {"seen_through", 0.125}}));
  CHECK(all[1]["kind"] == "moved");
  CHECK(all[1]["before"]["centre"][0] == 49.0);
  ExportOptions part;
  part.box = MapBox{{40.0, 0.0, 0.0}, {60.0, 10.0, 10.0}};
  const nlohmann::json in_box = written(part);
  REQUIRE(in_box.size() == 1);
  CHECK(in_box[0]["object"] == 1);
}

TEST_CASE("Of a map a box, one point per voxel and tiles are written", "[export]") {
  MergeResult result;
  for (int i = 0; i < 40; ++i) {
    result.map.push_back({{0.25F * static_cast<float>(i) - 5.0F + 0.125F, 1.0F, 0.0F}, 0, 1});
  }
  result.changes.push_back({{4.0F, 1.0F, 0.0F}, 0, true});
  result.changes.push_back({{-4.0F, 1.0F, 0.0F}, 0, true});
  result.dynamic_points = {{4.0F, 1.0F, 0.0F}, {4.0F, 3.0F, 0.0F}};
  const TemporaryDirectory scratch;
  const auto vertices = [&](const char* file) {
    const std::string ply = read(scratch / file);
    const std::string key = "element vertex ";
    return std::stoi(ply.substr(ply.find(key) + key.size()));
  };
  export_map(scratch.path(), {}, result);
  CHECK(vertices("map.ply") == 40);
  CHECK(vertices("removed.ply") == 2);
  CHECK_FALSE(std::filesystem::exists(scratch / "tiles"));
  CHECK_FALSE(std::filesystem::exists(scratch / "grid.pgm"));
  ExportOptions options;
  options.box = MapBox{{0.0, 0.0, -1.0}, {9.0, 2.0, 1.0}};
  export_map(scratch.path(), {}, result, options);
  CHECK(vertices("map.ply") == 20);
  CHECK(vertices("changes.ply") == 1);
  CHECK(vertices("removed.ply") == 1);
  options = {};
  options.voxel_m = 0.5;
  options.tile_m = 2.0;
  export_map(scratch.path(), {}, result, options);
  CHECK(vertices("map.ply") == 20);
  CHECK(vertices("changes.ply") == 2);
  CHECK(vertices("tiles/-3_0.ply") == 2);
  CHECK(vertices("tiles/-1_0.ply") == 4);
  CHECK(vertices("tiles/2_0.ply") == 2);
}

TEST_CASE("A navigation grid is written from its upper row, with grey for the unknown",
          "[export]") {
  NavigationGrid grid;
  grid.resolution_m = 0.25;
  grid.origin = {-1.5, 20.25};
  grid.width = 3;
  grid.height = 2;
  grid.cells = {GridCell::kFree,    GridCell::kOccupied, GridCell::kUnknown,
                GridCell::kUnknown, GridCell::kUnknown,  GridCell::kFree};
  const TemporaryDirectory scratch;
  write_grid(scratch.path(), "grid", grid);
  CHECK(read(scratch / "grid.pgm") == std::string("P5\n3 2\n255\n\x80\x80\xFE\xFE\x00\x80", 17));
  CHECK(read(scratch / "grid.yaml") ==
        "image: grid.pgm\nmode: trinary\nresolution: 0.25\norigin: [-1.5, 20.25, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n");
}
