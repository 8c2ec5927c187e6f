// Tests of the ranking of frames and objects.
#include "src/evaluate/worst_frames.hpp"

#include "tests/evaluate/labelled_scan.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;
using namespace unimapper::evaluate::testing;

namespace {

/// A frame with that many lost and missed points.
DynamicScore frame(std::uint64_t lost, std::uint64_t missed) {
  DynamicScore score;
  for (std::uint64_t i = 0; i < lost; ++i) score.add(kWall, 5.0F, true);
  for (std::uint64_t i = 0; i < missed; ++i) score.add(kWalker, 5.0F, false);
  for (int i = 0; i < 100; ++i) score.add(kWall, 5.0F, false);
  return score;
}

}  // namespace

TEST_CASE("frames are ranked by wrong points, missed and lost alike") {
  const std::vector<DynamicScore> frames = {frame(3, 0), frame(2, 4), frame(0, 5)};
  CHECK(worst_frames(frames, 10, 1) == std::vector<std::size_t>{1, 2, 0});
  CHECK(worst_frames(frames, 2, 1) == std::vector<std::size_t>{1, 2});
}

TEST_CASE("a frame beside a worse one is left out, one far enough away is not") {
  std::vector<DynamicScore> frames(25, frame(0, 0));
  frames[10] = frame(9, 0);
  frames[11] = frame(8, 0);
  frames[1] = frame(7, 0);
  frames[20] = frame(6, 0);
  CHECK(worst_frames(frames, 10, 10) == std::vector<std::size_t>{10, 20});
}

TEST_CASE("frames without a wrong point are never among the worst") {
  CHECK(worst_frames(std::vector<DynamicScore>{frame(0, 0), frame(0, 0)}, 10).empty());
  CHECK(worst_frames({}, 10).empty());
}

TEST_CASE("errors are listed by object, the worst one first") {
  LabelledScan scan;
  scan.add({10, 0, 0}, kWall, kKept);
  scan.add({0, 8, 0}, kWalker, kKept);
  scan.add({0, 10, 0}, kWalker, kKept);
  scan.add({0, 30, 0}, kWalker, kRemoved);
  scan.add({4, 3, 0}, kWall, kRemoved);
  scan.add({NAN, 0, 0}, kWalker, kKept);
  scan.add({1, 1, 0}, 0, kRemoved);  // the truth says nothing
  const auto objects = errors_by_object(scan.scored());
  REQUIRE(objects.size() == 2);
  CHECK(objects[0].label == kWalker);
  CHECK(objects[0].tally.missed() == 2);
  CHECK(objects[0].tally.dynamic_points == 3);
  CHECK(objects[0].wrong_range_m == Approx(9));
  CHECK(objects[0].wrong_center_sensor.y() == Approx(9));
  CHECK(objects[1].tally.lost() == 1);
  CHECK(objects[1].wrong_range_m == Approx(5));
}

TEST_CASE("an object's way between two scans is measured in the world") {
  LabelledScan before;
  before.add({10, 0, 0}, kWalker, kKept);
  LabelledScan after;
  after.T_world_sensor.translation = {1, 0, 0};
  after.add({9, 2, 0}, kWalker, kKept);
  after.add({5, 0, 0}, kWall, kRemoved);
  const auto then = errors_by_object(before.scored());
  const auto now = errors_by_object(after.scored());
  REQUIRE(now.size() == 2);
  const ObjectErrors& walker = now[now[0].label == kWalker ? 0 : 1];
  const ObjectErrors& wall = now[now[0].label == kWalker ? 1 : 0];
  CHECK(displacement_m(walker, then) == Approx(2));
  CHECK(std::isnan(displacement_m(wall, then)));
}
