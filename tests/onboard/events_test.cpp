// Events of the pipeline in the ring it is given, and as text
#include "unimapper/onboard/events.hpp"

#include "event_log.hpp"
#include "ports/events/event_text.hpp"
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

LabelledScan wall_scan() {
  Scene scene;
  scene.columns = 180;
  scene.boxes = {standing_box({8.0, 0.0, 1.5}, {0.3, 6.0, 1.5})};
  return scene.scan(sensor_at(0, 0), 0.0);
}

}  // namespace

TEST_CASE("keyframes, refusals, jumps and drops are written as events, in order") {
  EventLog log;
  PipelineConfig config = small_config();
  config.events = log.ring;
  config.voxel.max_cells = 500;
  OwnedPipeline pipeline(config);
  const LabelledScan scan = wall_scan();
  (void)pipeline->add_scan(scan.view(), sensor_at(0, 0), 100);
  CHECK(log.take().empty());
  (void)pipeline->add_scan(scan.view(), sensor_at(0, 0), 100);
  (void)pipeline->add_scan(PointView{}, sensor_at(0, 0), 200);
  (void)pipeline->add_scan(scan.view(), sensor_at(90, 0), 300);
  const auto records = log.take();
  REQUIRE(records.size() >= 5);
  const KeyframeView& view = pipeline->keyframe();
  const auto check = [&](std::size_t i, EventId id, std::int64_t first) {
    CHECK(records[i].id == static_cast<std::uint32_t>(id));
    CHECK(records[i].values[0] == first);
  };
  check(0, EventId::kScanRefused, static_cast<std::int64_t>(ErrorCode::kTimeReversed));
  CHECK(records[0].values[1] == 1);
  check(1, EventId::kScanRefused, static_cast<std::int64_t>(ErrorCode::kEmptyScan));
  check(2, EventId::kPoseJump, 3);
  CHECK(records[2].stamp_ns == 300);
  check(3, EventId::kKeyframeClosed, 0);
  CHECK(records[3].stamp_ns == 100);
  CHECK(records[3].values[1] == 1);
  CHECK(records[3].values[2] == static_cast<std::int64_t>(view.static_cells.size()));
  check(4, EventId::kDropped, static_cast<std::int64_t>(DropCause::kCellsFull));
  CHECK(records[4].values[1] ==
        static_cast<std::int64_t>(view.statistics->dropped_by(DropCause::kCellsFull)));
}

TEST_CASE("events of a keyframe carry the stamp of its last scan") {
  EventLog log;
  PipelineConfig config = small_config();
  config.events = log.ring;
  config.keyframe.scans = 3;
  OwnedPipeline pipeline(config);
  for (const std::int64_t stamp_ns : {100, 250, 600}) {
    (void)pipeline->add_scan(wall_scan().view(), sensor_at(0, 0), stamp_ns);
  }
  const auto records = log.take();
  REQUIRE(!records.empty());
  CHECK(records[0].id == static_cast<std::uint32_t>(EventId::kKeyframeClosed));
  for (const EventRecord& record : records) CHECK(record.stamp_ns == 600);
}

TEST_CASE("events read as sentences") {
  const auto text = [](EventId id, std::int64_t a, std::int64_t b, std::int64_t c) {
    return events::to_text({static_cast<std::uint32_t>(id), 0, 12300000000, {a, b, c, 31}});
  };
  CHECK(text(EventId::kKeyframeClosed, 4, 10, 5120) ==
        "12.300000000 keyframe 4 closed: 10 scans, 5120 static cells, 31 dynamic cells");
  CHECK_THAT(text(EventId::kScanRefused, 6, 17, 0), Contains("scan 17 refused: no valid point"));
  CHECK_THAT(text(EventId::kPoseJump, 17, 0, 0), Contains("scan 17 refused: the pose jumped"));
  CHECK_THAT(text(EventId::kDropped, 3, 88, 4), Contains("keyframe 4: 88 dropped, cells_full"));
  CHECK_THAT(text(EventId::kDeadlineMissed, 900, 500, 4), Contains("900 us of 500"));
  CHECK_THAT(text(EventId::kUpContradicted, 5230, 500, 4),
             Contains("5.23 deg from up") && Contains("promised 0.50 deg"));
  CHECK_THAT(text(EventId::kOdometryContradicted, 215, 40, 4),
             Contains("keyframe 4: the scans contradict the odometry, 21.5 % of the cells"));
  CHECK_THAT(text(EventId::kOdometryContradicted, 0, 0, 4),
             Contains("keyframe 4: the robot was shut in, as in a lift"));
  CHECK_THAT(text(EventId::kMountContradicted, 2, 2020, 130),
             Contains("mounted otherwise than the poses say, yaw by 2.02 degrees (standard "));
  CHECK_THAT(text(EventId::kMountContradicted, 3, -510, 60), Contains("x by -0.51 m"));
  CHECK_THAT(text(EventId::kClockContradicted, -150, 12, 4),
             Contains("the poses are 0.15 s early against the scans"));
  CHECK_THAT(text(EventId::kScaleContradicted, -91, 10, 4), Contains("1.10 times as long as the"));
  CHECK_THAT(text(EventId::kMotionContradicted, 1, 1000, 4),
             Contains("otherwise than the poses say: the poses look like T_sensor_world; invert"));
  CHECK_THAT(text(EventId::kMotionContradicted, 0, 1500, 4), Contains("1.50 times as long"));
  CHECK_THAT(text(EventId::kDropped, 99, 1, 0), Contains("dropped, 99"));
  CHECK_THAT(text(static_cast<EventId>(77), 1, 2, 3), Contains("event 77: 1 2 3 31"));
}

TEST_CASE("draining a ring tells how many events were lost") {
  EventLog log;
  for (int i = 0; i < 262; ++i) log.ring->push({3, 0, 0, {i, 0, 0, 0}});
  std::vector<std::string> lines;
  const auto write = [&lines](const std::string& line) { lines.push_back(line); };
  const std::uint32_t lost = events::drain(*log.ring, 0, write);
  CHECK(lost == 6);
  REQUIRE(lines.size() == 257);
  CHECK(lines.back() == "6 events lost: ring full");
  CHECK(events::drain(*log.ring, lost, write) == 6);
  CHECK(lines.size() == 257);
}
