// Tests of change detection between sessions.
#include "src/merge/loops/max_clique.hpp"
#include "src/merge/map/changes.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;
using unimapper::merge::testing::yaw_pose;

namespace {

/// A sheet across the view, `x_m` ahead, as cells `spacing_m` apart.
void add_sheet(KeyframeRecord& keyframe, float x_m, float half_m, float spacing_m) {
  const int steps = static_cast<int>(std::lround(2.0F * half_m / spacing_m));
  for (int row = 0; row <= steps; ++row) {
    for (int column = 0; column <= steps; ++column) {
      const float y = spacing_m * static_cast<float>(column) - half_m;
      const float z = spacing_m * static_cast<float>(row) - half_m;
      keyframe.static_cells.push_back({Eigen::Vector3f(x_m, y, z), 3, 0, 0});
    }
  }
}

/// What a robot at the origin sees: a wall, and what stands in front of it, if anything.
KeyframeRecord look_at_wall(std::int64_t stamp_ns) {
  KeyframeRecord keyframe;
  keyframe.scans.push_back({0, stamp_ns, Pose{}});
  add_sheet(keyframe, 12.0F, 6.0F, 0.15F);
  return keyframe;
}

/// Changes in front of the wall of sessions in any order of time; a session named `apart` is not in
/// the map. Frames of the second session's keyframes may be turned in the map.
std::vector<ChangedPoint> changes_of(const std::vector<SessionData>& sessions,
                                     const MapConfig& config = {},
                                     std::size_t most_voxels = kMostComparedVoxels,
                                     const Pose& T_map_second = {}) {
  MergeConfig merge_config;
  merge_config.map = config;
  merge_config.threads = 1;
  std::vector<MergedSession> merged(sessions.size());
  std::vector<SessionVoxels> voxels;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    merged[s].T_map_keyframe.assign(sessions[s].keyframes.size(), s == 1 ? T_map_second : Pose{});
    merged[s].refined.resize(sessions[s].keyframes.size());
    voxels.push_back(voxelise(sessions[s], merged[s], config.voxel_size_m).fixed);
  }
  std::vector<const SessionVoxels*> given;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    given.push_back(sessions[s].info.name == "apart" ? nullptr : &voxels[s]);
  }
  auto changes = find_changes(sessions, merged, given, merge_config, most_voxels).points;
  std::erase_if(changes, [](const ChangedPoint& change) { return change.position.x() > 6.45F; });
  return changes;
}

std::size_t count(const std::vector<ChangedPoint>& changes, std::size_t session, bool appeared) {
  return static_cast<std::size_t>(
      std::count_if(changes.begin(), changes.end(), [&](const ChangedPoint& change) {
        return change.session == session && change.appeared == appeared;
      }));
}

/// Points of the first day's session that are gone on the second day.
std::size_t count_gone(const SessionData& first, const SessionData& second,
                       const MapConfig& config = {}, const Pose& T_map_second = {}) {
  return count(changes_of({first, second}, config, kMostComparedVoxels, T_map_second), 0, false);
}

/// So many keyframes that see something 6 m ahead.
SessionData with_box(std::size_t keyframes = 1, std::int64_t stamp_ns = 1) {
  SessionData day;
  for (std::size_t k = 0; k < keyframes; ++k) {
    day.keyframes.push_back(look_at_wall(stamp_ns++));
    add_sheet(day.keyframes.back(), 6.0F, 0.4F, 0.2F);
  }
  return day;
}

/// Of so many keyframes some saw through it, some observed a surface just behind it, too far away
/// to be the same and too near for the position to be free.
SessionData without_box(int free, int occupied, std::int64_t stamp_ns = 1'000'000'000) {
  SessionData day;
  for (int k = 0; k < free + occupied; ++k) {
    day.keyframes.push_back(look_at_wall(stamp_ns + k));
    if (k >= free) add_sheet(day.keyframes.back(), 6.57F, 1.2F, 0.1F);
  }
  return day;
}

}  // namespace

TEST_CASE("A position is free if enough saw through it, more than twice as many as observed it",
          "[changes]") {
  CHECK(count_gone(with_box(), without_box(2, 0)) >= 20);
  CHECK(count_gone(with_box(), without_box(1, 0)) == 0);
  CHECK(count_gone(with_box(), without_box(3, 1)) >= 20);
  CHECK(count_gone(with_box(), without_box(2, 1)) == 0);
  CHECK(count_gone(with_box(), without_box(4, 2)) == 0);
}

TEST_CASE("What is free does not depend on how a keyframe's frame is turned", "[changes]") {
  for (const double turn : {0.5, 1.5707963267948966, 2.2, -1.2}) {
    INFO("turned by " << turn);
    SessionData second = without_box(2, 0);
    for (KeyframeRecord& keyframe : second.keyframes) {
      for (FineCell& cell : keyframe.static_cells) {
        const Eigen::Vector3d in_map = cell.position.cast<double>();
        cell.position = (yaw_pose(turn).inverse() * in_map).cast<float>();
      }
    }
    CHECK(count_gone(with_box(), second, {}, yaw_pose(turn)) >= 20);
  }
}

TEST_CASE("Only keyframes within range say what is free", "[changes]") {
  MapConfig config;
  config.change_range_m = 6.5F;
  CHECK(count_gone(with_box(), without_box(2, 0), config) >= 20);
  config.change_range_m = 5.9F;
  CHECK(count_gone(with_box(), without_box(2, 0), config) == 0);
}

TEST_CASE("A surface within the change distance is the same one", "[changes]") {
  // On the second day one keyframe of four observed a surface 0.57 m farther away.
  MapConfig config;
  config.change_distance_m = 0.5F;
  CHECK(count_gone(with_box(), without_box(3, 1), config) >= 20);
  config.change_distance_m = 0.7F;
  CHECK(count_gone(with_box(), without_box(3, 1), config) == 0);
}

TEST_CASE("Every keyframe of a long session may have seen through", "[changes]") {
  for (const auto& [one, other] :
       {std::pair(0U, 32U), std::pair(1U, 15U), std::pair(15U, 16U), std::pair(16U, 31U)}) {
    SessionData day;
    day.keyframes.resize(33);
    // The others saw a single cell behind them.
    for (std::size_t k = 0; k < day.keyframes.size(); ++k) {
      day.keyframes[k].scans.push_back({0, 1'000'000'000, Pose{}});
      day.keyframes[k].static_cells.push_back({{-5.0F, 0.0F, 0.0F}, 3, 0, 0});
    }
    day.keyframes[one] = look_at_wall(1'000'000'000);
    CHECK(count_gone(with_box(), day) == 0);
    day.keyframes[other] = look_at_wall(1'000'000'000);
    CHECK(count_gone(with_box(), day) >= 20);
  }
}

TEST_CASE("Changes smaller than the least cluster are left out", "[changes]") {
  SessionData day;
  day.keyframes.push_back(look_at_wall(1));
  for (const Eigen::Vector3f& point :
       {Eigen::Vector3f(6.1F, 0.1F, 0.1F), Eigen::Vector3f(6.1F, 0.3F, 0.1F),
        Eigen::Vector3f(6.1F, 0.1F, 0.3F), Eigen::Vector3f(6.1F, 0.3F, 0.3F),
        Eigen::Vector3f(6.3F, 0.1F, 0.1F)}) {
    day.keyframes[0].static_cells.push_back({point, 3, 0, 0});
  }
  MapConfig config;
  config.min_object_height_m = 0.1F;
  config.min_cluster = 5;
  CHECK(count_gone(day, without_box(2, 0), config) == 5);
  config.min_cluster = 6;
  CHECK(count_gone(day, without_box(2, 0), config) == 0);
}

TEST_CASE("Ground of the other session beside it does not hide what is gone", "[changes]") {
  // On the second day the ground is seen below and beside where the box stood.
  SessionData second = without_box(2, 0);
  for (KeyframeRecord& keyframe : second.keyframes) {
    for (float y = -0.6F; y < 0.61F; y += 0.1F) {
      for (float x = 5.8F; x < 6.3F; x += 0.1F) {
        keyframe.static_cells.push_back({Eigen::Vector3f(x, y, -0.5F), 3, 1, 0});
      }
    }
  }
  CHECK(count_gone(with_box(), second) >= 20);
}

TEST_CASE("What moved past beside it does not hide what is gone", "[changes]") {
  // In one of five looks something wide stood beside the box; the other four saw through it.
  SessionData first = with_box(5);
  for (float y = 0.5F; y < 3.0F; y += 0.2F) {
    for (float z = -0.8F; z < 0.9F; z += 0.2F) {
      first.keyframes[2].static_cells.push_back({Eigen::Vector3f(6.0F, y, z), 3, 0, 0});
    }
  }
  CHECK(count_gone(first, without_box(2, 0)) >= 20);
}

TEST_CASE("A voxel is compared unless most of its cells are ground", "[changes]") {
  // Every cell of the box has copies that are ground.
  const auto with_ground = [](std::size_t copies) {
    SessionData day;
    day.keyframes.push_back(look_at_wall(1));
    KeyframeRecord box;
    add_sheet(box, 6.1F, 0.4F, 0.2F);
    for (FineCell cell : box.static_cells) {
      // In the middle of its voxel, whatever the rounding.
      cell.position += Eigen::Vector3f(0.0F, 0.1F, 0.1F);
      day.keyframes[0].static_cells.push_back(cell);
      cell.ground = 1;
      day.keyframes[0].static_cells.insert(day.keyframes[0].static_cells.end(), copies, cell);
    }
    return day;
  };
  CHECK(count_gone(with_ground(1), without_box(2, 0)) >= 20);
  CHECK(count_gone(with_ground(2), without_box(2, 0)) == 0);
}

namespace {

SessionData day_with_box(std::int64_t stamp_ns) { return with_box(2, stamp_ns); }
SessionData day_without(std::int64_t stamp_ns) { return without_box(2, 0, stamp_ns); }

/// A day that knows nothing of what is in front of the wall: its robot looked the other way.
SessionData day_elsewhere(std::int64_t stamp_ns) {
  SessionData session;
  session.keyframes.resize(1);
  session.keyframes[0].scans.push_back({0, stamp_ns, Pose{}});
  add_sheet(session.keyframes[0], -12.0F, 6.0F, 0.15F);
  return session;
}

}  // namespace

TEST_CASE("Time tells what appeared from what is gone, not the order of the sessions",
          "[changes]") {
  const auto gone = changes_of({day_without(2000), day_with_box(1000)});
  CHECK(count(gone, 1, false) >= 20);
  CHECK(count(gone, 1, false) == gone.size());
  const auto appeared = changes_of({day_without(1000), day_with_box(2000)});
  CHECK(count(appeared, 1, true) == gone.size());
  CHECK(count(appeared, 1, true) == appeared.size());
}

TEST_CASE("The first session before or after that observed a position decides", "[changes]") {
  // The second day saw nothing of it, the third day saw through.
  const auto skipped = changes_of({day_with_box(1000), day_elsewhere(2000), day_without(3000)});
  CHECK(count(skipped, 0, false) >= 20);
  CHECK(count(skipped, 0, false) == skipped.size());
  // On the second day it still stood there: gone is what the second day saw.
  const auto later = changes_of({day_with_box(1000), day_with_box(2000), day_without(3000)});
  CHECK(count(later, 1, false) >= 20);
  CHECK(count(later, 1, false) == later.size());
  // It was away for a day.
  const auto away = changes_of({day_with_box(1000), day_without(2000), day_with_box(3000)});
  CHECK(count(away, 0, false) >= 20);
  CHECK(count(away, 2, true) >= 20);
  CHECK(count(away, 0, false) + count(away, 2, true) == away.size());
}

TEST_CASE("Sessions that are not in the map, or that are empty, take no part in changes",
          "[changes]") {
  SessionData apart = day_without(2000);
  apart.info.name = "apart";
  CHECK(changes_of({day_with_box(1000), apart}).empty());
  CHECK(changes_of({day_with_box(1000), SessionData{}}).empty());
  CHECK_FALSE(changes_of({day_with_box(1000), SessionData{}, day_without(2000)}).empty());
  CHECK(changes_of({}).empty());
}

TEST_CASE("The clique search finds the largest group hidden in noise", "[acceptance]") {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const std::size_t n = 60;
    AdjacencyMatrix graph(n);
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) {
        const bool hidden = a % 5 == 0 && b % 5 == 0;
        if (hidden || random.uniform() < 0.2) graph.connect(a, b);
      }
    }
    std::vector<std::size_t> all(n);
    for (std::size_t i = 0; i < n; ++i) all[i] = i;
    const auto clique = max_clique(graph, all);
    CHECK(clique.size() >= 12);
    for (std::size_t i = 0; i < clique.size(); ++i) {
      for (std::size_t j = i + 1; j < clique.size(); ++j) {
        CHECK(graph.connected(clique[i], clique[j]));
      }
    }
    // Out of steps, the greedy answer is still a clique.
    CHECK(max_clique(graph, all, 30).size() >= 2);
  }
  CHECK(max_clique(AdjacencyMatrix(0), {}).empty());
}

TEST_CASE("An object across the border of two regions is found once, and whole", "[changes]") {
  // Tiles meet at the origin, in the middle of the box.
  const std::vector<SessionData> days{day_with_box(1), day_without(1'000'000'000)};
  const auto whole = changes_of(days);
  REQUIRE(whole.size() >= 20);
  const auto is_left = [](const ChangedPoint& point) { return point.position.y() < 0.0F; };
  REQUIRE(std::any_of(whole.begin(), whole.end(), is_left));
  REQUIRE_FALSE(std::all_of(whole.begin(), whole.end(), is_left));
  const auto divided = changes_of(days, {}, 1);
  REQUIRE(divided.size() == whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    CHECK(divided[i].position == whole[i].position);
    CHECK(divided[i].object == whole[i].object);
  }
}
