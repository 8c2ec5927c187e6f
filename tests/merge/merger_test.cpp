// Tests of merging whole sessions.
#include "unimapper/merge/merger.hpp"

#include "tests/merge/exported_files.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_sheets.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/export.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

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
    Town first = known_town();
    Town second = first;
    first.add_box(f.van.x() - 2.5, f.van.y() - 1.0, 5.0, 2.0, 2.2);
    second.add_box(f.kiosk.x() - 1.5, f.kiosk.y() - 1.5, 3.0, 3.0, 2.4);
    f.drives.push_back(record(first, mondays_way(), "alpha", 11));
    f.drives.push_back(record(second, fridays_way(), "beta", 12));
    f.drives.push_back(elsewhere(99, "other-town"));
    for (const auto& drive : f.drives) f.sessions.push_back(drive.session);
    return f;
  }();
  return shared;
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

}  // namespace

TEST_CASE("Two sessions of one town are merged, one of another town stays unconnected",
          "[merger][slow]") {
  const std::vector<Drive>& drives = fleet().drives;
  const MergeResult result = merge_sessions(fleet().sessions, MergeConfig{});
  REQUIRE(is_in_map(result.sessions[0].status));
  REQUIRE(is_in_map(result.sessions[1].status));
  CHECK(result.sessions[result.central_session].status == SessionStatus::kCentral);
  CHECK(result.sessions[2].status == SessionStatus::kUnconnected);
  CHECK_FALSE(result.sessions[2].reason.empty());
  CHECK(result.sessions[2].T_map_keyframe.size() == fleet().sessions[2].keyframes.size());
  CHECK(worst_error_m(result, {&drives[0], &drives[1]}) < 0.5);
  // Every loop is accounted for.
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
  // The map fuses what sessions share.
  const auto& map = result.map;
  CHECK(std::all_of(map.begin(), map.end(), [](const auto& point) { return point.session < 2; }));
  CHECK(std::count_if(map.begin(), map.end(),
                      [](const auto& point) { return point.sessions_seen > 1; }) > 1000);
  // Changes are found, and nothing else.
  const std::size_t gone = changes_near(result, fleet().van, false);
  const std::size_t new_here = changes_near(result, fleet().kiosk, true);
  CHECK(gone >= 20);
  CHECK(new_here >= 20);
  CHECK(changes_near(result, fleet().van, true) == 0);
  CHECK(changes_near(result, fleet().kiosk, false) == 0);
  CHECK(result.changes.size() <= (gone + new_here) * 5 / 4);
}

TEST_CASE("The number of threads changes nothing, byte for byte", "[merger]") {
  const std::vector<Drive> drives = same_way({{0, 0}, {1, 0}, {1, 0.5}});
  const std::vector<SessionData> two{drives[0].session, drives[1].session};
  const auto files = [&](unsigned threads) {
    const TemporaryDirectory scratch;
    MergeConfig config;
    config.threads = threads;
    export_map(scratch.path(), two, merge_sessions(two, config));
    return exported_files(scratch.path());
  };
  const auto by_one = files(1);
  for (const char* file : {"map.ply", "changes.ply", "graph.g2o", "loops.csv", "summary.json",
                           "trajectories/alpha.tum", "trajectories/beta.tum"}) {
    INFO(file);
    CHECK_FALSE(by_one.at(file).empty());
  }
  CHECK((files(3) == by_one));
}

TEST_CASE("A map of leaning odometry frames is level, and its sessions still coincide",
          "[merger]") {
  std::vector<Drive> drives = same_way({{0, 0}, {0.7, 0}});
  const Eigen::Vector3d axes[] = {{1.0, 0.3, 0.0}, {-0.2, 1.0, 0.0}};
  std::vector<SessionData> sessions;
  for (std::size_t s = 0; s < 2; ++s) {
    const Pose leaning = turned_about(axes[s], 0.1);
    for (KeyframeRecord& keyframe : drives[s].session.keyframes) {
      keyframe.T_odometry_keyframe = leaning * keyframe.T_odometry_keyframe;
      for (KeyframeScan& scan : keyframe.scans)
        scan.T_odometry_sensor = keyframe.T_odometry_keyframe;
      keyframe.up = {true, 1e-5F, 0.0F, 1e-5F};
    }
    sessions.push_back(drives[s].session);
  }
  const MergeResult result = merge_sessions(sessions, MergeConfig{});
  for (const MergedSession& session : result.sessions) {
    REQUIRE(is_in_map(session.status));
    for (const Pose& T_map_keyframe : session.T_map_keyframe) {
      CHECK(T_map_keyframe.rotation.col(2).head<2>().norm() < 0.0052);  // 0.3 degrees
    }
  }
  CHECK(worst_error_m(result, {&drives[0], &drives[1]}) < 0.5);
}

TEST_CASE("Zero sessions, one session, empty sessions", "[merger]") {
  const SessionData some =
      record(make_town(5, 1), drive_roads({{0, 0}, {0.5, 0}}), "some", 3).session;
  SessionData nothing;
  nothing.info.name = "nothing";
  const auto merged = [](const std::vector<SessionData>& sessions) {
    return merge_sessions(sessions, MergeConfig{});
  };
  CHECK(merged({}).sessions.empty());
  CHECK(merged({}).map.empty());
  const MergeResult one = merged({some});
  CHECK(one.sessions[0].status == SessionStatus::kCentral);
  CHECK(one.changes.empty());
  CHECK(one.sessions[0].reason.empty());
  MergeConfig drifting;
  drifting.odometry.translation_m_per_sqrt_m = 1.0;
  CHECK(merge_poses({some}, drifting).sessions[0].reason.find("are sure to") != std::string::npos);
  CHECK_FALSE(one.map.empty());
  const MergeResult beside = merged({nothing, some});
  CHECK(beside.central_session == 1);
  CHECK(beside.sessions[0].status == SessionStatus::kUnconnected);
  CHECK(beside.sessions[0].reason == "no keyframes");
  const MergeResult empty = merged({nothing});
  CHECK(empty.sessions[0].status == SessionStatus::kUnconnected);
  const TemporaryDirectory scratch;
  export_map(scratch.path(), {nothing}, empty);
  CHECK(std::filesystem::exists(scratch / "map.ply"));
}

TEST_CASE("Cells of an unconnected session are not refined by sessions of the map", "[merger]") {
  // The coordinates of both overlap by chance: where one saw a person, the other saw through.
  SessionData map;
  map.info.name = "map";
  for (std::uint32_t k = 0; k < 8; ++k) map.keyframes.push_back(keyframe_of(k, {kWall}));
  SessionData other;
  other.info.name = "other-town";
  other.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
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
  const auto refused = [&](const char* message, const auto& damage) {
    std::vector<SessionData> damaged = two;
    MergeConfig config;
    damage(damaged, config);
    CHECK_THROWS_WITH(merge_sessions(damaged, config), Catch::Contains(message));
  };
  refused("keyframe 3 has no valid pose", [](auto& sessions, MergeConfig&) {
    sessions[1].keyframes[3].T_odometry_keyframe.translation.x() = std::nan("");
  });
  refused("out of order", [](auto& sessions, MergeConfig&) {
    std::swap(sessions[1].keyframes[2], sessions[1].keyframes[3]);
  });
  refused("has no reference scan",
          [](auto& sessions, MergeConfig&) { sessions[0].keyframes[0].reference_scan = 9; });
  refused("cannot be a file name",
          [](auto& sessions, MergeConfig&) { sessions[0].info.name = "../alpha"; });
  refused("two sessions are named alpha",
          [](auto& sessions, MergeConfig&) { sessions[1].info.name = sessions[0].info.name; });
  refused("map.voxel_size_m", [](auto&, MergeConfig& config) { config.map.voxel_size_m = -1.0F; });
}
