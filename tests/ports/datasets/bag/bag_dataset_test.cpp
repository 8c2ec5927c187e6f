// Tests of scans and poses out of a bag.
#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>

#include "ports/datasets/dataset.hpp"
#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kStart = 1000 * kSecond;
constexpr Encoding kEncoding = Encoding::kCdrLittle;

Pose at_x(double x) { return {Eigen::Matrix3d::Identity(), Eigen::Vector3d(x, 0, 0)}; }

std::int64_t stamp_of(int scan) { return kStart + scan * kSecond / 10; }
CloudOfMessage cloud_of(int scan) { return plain_cloud({{static_cast<float>(scan + 1), 0, 0}}); }

/// A bag with one second of scans at 10 Hz, the n-th with the only point (n + 1, 0, 0).
class Bag {
 public:
  Bag& scans(const std::string& topic = "/points", const std::string& frame = "lidar") {
    return scans(topic,
                 [&](int i) { return cloud_message(kEncoding, stamp_of(i), cloud_of(i), frame); });
  }
  /// With messages of another kind.
  Bag& scans(const std::string& topic, const std::function<std::string(int)>& message) {
    const auto channel = file_.topic(topic, "sensor_msgs/msg/PointCloud2");
    for (int i = 0; i <= 10; ++i) {
      file_.message(channel, stamp_of(i) + kSecond / 10, message(i));
    }
    file_.end_chunk();
    return *this;
  }

  /// Odometry at 20 Hz, 1 m/s along x from x = 0 at the first scan on.
  Bag& odometry(const std::string& topic = "/odom", const std::string& child = "base_link",
                double from_s = 0.0, double to_s = 1.0, const std::string& frame = "odom") {
    const auto channel = file_.topic(topic, "nav_msgs/msg/Odometry");
    for (double t = from_s; t < to_s + 0.01; t += 0.05) {
      const auto stamp = kStart + static_cast<std::int64_t>(t * 1e9 + 0.5);
      file_.message(channel, stamp, odometry_message(kEncoding, stamp, at_x(t), frame, child));
    }
    file_.end_chunk();
    return *this;
  }

  Bag& poses(const std::string& topic, int times_slower = 1) {
    const auto channel = file_.topic(topic, "geometry_msgs/msg/PoseStamped");
    for (const int i : {0, 1, 2, 3, 4}) {
      const std::int64_t stamp = kStart + (i * times_slower - times_slower / 5) * kSecond / 4;
      file_.message(channel, stamp, pose_message(kEncoding, stamp, at_x(0.25 * i)));
    }
    file_.end_chunk();
    return *this;
  }

  /// All poses so far in each message, or the last five.
  Bag& path(bool is_whole, std::int64_t recorded_later_ns = 0) {
    const auto channel = file_.topic("/path", "nav_msgs/msg/Path");
    for (int i = 0; i <= 20; ++i) {
      MessageWriter writer(kEncoding);
      const int first = is_whole ? 0 : std::max(0, i - 4);
      writer.header(stamp_of(i) / 2, "map").number(static_cast<std::uint32_t>(i - first + 1));
      for (int k = first; k <= i; ++k) {
        writer.header(kStart + k * kSecond / 20, "map").pose(at_x(0.05 * k));
      }
      file_.message(channel, kStart + i * kSecond / 20 + recorded_later_ns, writer.bytes());
    }
    file_.end_chunk();
    return *this;
  }

  Bag& fixed(const std::string& parent, const std::string& child, const Pose& pose) {
    const auto channel = file_.topic("/tf_static", "tf2_msgs/msg/TFMessage");
    file_.message(channel, kStart, transforms_message(kEncoding, {{kStart, parent, child, pose}}));
    file_.end_chunk();
    return *this;
  }

  /// The child moves at 1 m/s along x.
  Bag& moving(const std::string& parent, const std::string& child) {
    const auto channel = file_.topic("/tf", "tf2_msgs/msg/TFMessage");
    for (const int i : {0, 1, 2, 3, 4}) {
      const std::int64_t stamp = kStart + i * kSecond / 4;
      file_.message(channel, stamp,
                    transforms_message(kEncoding, {{stamp, parent, child, at_x(0.25 * i)}}));
    }
    file_.end_chunk();
    return *this;
  }

  std::unique_ptr<Dataset> open(const OpenOptions& options = {}) {
    return open_dataset(directory_.write("drive.mcap", file_.bytes()), options);
  }
  std::string error(const OpenOptions& options = {}) {
    return error_of([&] { open(options); });
  }
  const TemporaryDirectory& directory() const { return directory_; }

 private:
  McapFile file_;
  TemporaryDirectory directory_;
};

OpenOptions with_topic(const std::string& topic) {
  OpenOptions options;
  options.topic = topic;
  return options;
}
OpenOptions with_odometry(const std::string& topic) {
  OpenOptions options;
  options.odometry_topic = topic;
  return options;
}
OpenOptions with_frame(const std::string& frame) {
  OpenOptions options;
  options.frame = frame;
  return options;
}

}  // namespace

#ifdef UNIMAPPER_BUILD_BAGS
TEST_CASE("a recording that npm's @mcap/core wrote is read") {
  const auto dataset = open_dataset(foreign_file("drive.mcap"));
  check_foreign_recording(*dataset);
  const std::string notes = notes_text(*dataset);
  CHECK_THAT(notes, Contains("- scans: /points (sensor_msgs/PointCloud2, 4 messages), fields x y z "
                             "intensity t ring"));
  CHECK_THAT(notes, Contains("- poses: /odom (nav_msgs/Odometry, 16 messages), of 'base_link' in "
                             "'odom'; LiDAR 'lidar' in it: x 0.500, y 0.000, z 1.200 m, roll 0.0, "
                             "pitch 0.0, yaw 90.0 degrees"));
  CHECK_THAT(notes, Contains("1 scan of 4 without a pose left out: 0 before the first pose, 1 "
                             "after the last one, 0 where"));
}
#endif

TEST_CASE("scans take their poses by stamp from the only odometry, by the LiDAR's place") {
  Bag bag;
  const auto dataset = bag.scans().odometry().fixed("base_link", "lidar", at_x(0.5)).open();
  REQUIRE(dataset->scan_count() == 11);
  CHECK(dataset->pose(3).translation.x() == Approx(0.8));
  CHECK(dataset->scan_name(3) == "000003");
  CHECK(dataset->stamp_ns(3) == kStart + 3 * kSecond / 10);
  Scan scan;
  dataset->read_scan(3, scan);
  CHECK(scan.points[0].x == 4.0F);
  CHECK_THAT(notes_text(*dataset), !Contains("!"));
}

TEST_CASE("scans before the first and after the last pose are left out and counted") {
  Bag bag;
  const auto dataset = bag.scans().odometry("/odom", "lidar", 0.15, 0.65).open();
  CHECK(dataset->scan_count() == 5);
  CHECK(dataset->scan_name(0) == "000002");
  CHECK_THAT(notes_text(*dataset), Contains("! 6 scans of 11 without a pose left out: 2 before the "
                                            "first pose, 4 after the last one"));
}

TEST_CASE("poses come from the transforms where there is no odometry") {
  Bag bag;
  const auto dataset = bag.scans()
                           .moving("odom", "base_link")
                           .fixed("base_link", "lidar", at_x(0.5))
                           .fixed("map", "odom", at_x(100))
                           .open();
  REQUIRE(dataset->scan_count() == 11);
  CHECK(dataset->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(notes_text(*dataset), Contains("- poses: the transforms from 'lidar' to 'odom'"));
}

TEST_CASE("an option chooses the frame of the transforms, also where there is odometry") {
  Bag bag;
  bag.scans().odometry().moving("odom", "base_link").fixed("map", "odom", at_x(100));
  bag.fixed("base_link", "lidar", at_x(0.5));
  CHECK_THAT(notes_text(*bag.open()), Contains("LiDAR 'lidar' in it: x 0.500, y 0.000"));
  CHECK(bag.open(with_frame("map"))->pose(3).translation.x() == Approx(100.8));
  CHECK(bag.open(with_odometry("/tf"))->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(bag.error(with_frame("earth")),
             Contains("no pose of the LiDAR's frame 'lidar' in 'earth'; there are: odom, map"));
}

TEST_CASE("several frames that the LiDAR moves in are listed") {
  Bag bag;
  bag.scans().moving("start", "base_link").fixed("world_a", "start", at_x(1));
  bag.fixed("base_link", "lidar", at_x(0.5));
  CHECK_THAT(bag.error(), Contains("moves in several frames: start, world_a; choose one with "
                                   "--frame"));
  CHECK(bag.open(with_frame("start"))->pose(3).translation.x() == Approx(0.8));
}

TEST_CASE("several topics of scans are listed, and one is chosen by name") {
  Bag bag;
  bag.scans("/front").scans("/rear").odometry("/odom", "lidar");
  CHECK_THAT(bag.error(), Contains("drive.mcap: holds several topics of scans: /front "
                                   "(sensor_msgs/PointCloud2, 11 messages), /rear "
                                   "(sensor_msgs/PointCloud2, 11 messages); choose one with "
                                   "--topic"));
  CHECK(bag.open(with_topic("/rear"))->scan_count() == 11);
  CHECK(bag.open(with_topic("rear"))->scan_count() == 11);
  CHECK_THAT(bag.error(with_topic("/left")),
             Contains("holds no topic '/left'; topics of scans: /front"));
  CHECK_THAT(bag.error(with_topic("/odom")), Contains("/odom (nav_msgs/Odometry, 21 messages) "
                                                      "holds no scans"));
}

TEST_CASE("several topics of odometry are listed, and one is chosen by name") {
  Bag bag;
  bag.scans().odometry("/wheels", "lidar").odometry("/lidar_odometry", "lidar");
  CHECK_THAT(bag.error(), Contains("several topics of odometry: /wheels") &&
                              Contains("choose one with --odometry-topic"));
  CHECK(bag.open(with_odometry("/wheels"))->scan_count() == 11);
  bag.moving("odom", "lidar");
  CHECK(bag.open(with_frame("odom"))->scan_count() == 11);
  CHECK_THAT(bag.error(with_odometry("/gps")),
             Contains("holds no topic '/gps'; topics of poses: /wheels"));
}

TEST_CASE("poses without odometry are used, those of a goal beside odometry are not") {
  Bag poses_only;
  const auto dataset = poses_only.scans().poses("/pose").open();
  CHECK(dataset->pose(3).translation.x() == Approx(0.3));
  CHECK_THAT(notes_text(*dataset), Contains("does not say whose poses it holds"));
  Bag both;
  CHECK(both.scans().poses("/goal").odometry("/odom", "lidar").open()->scan_count() == 11);
  // Transforms come before them, too, unless they are asked for.
  Bag with_transforms;
  with_transforms.scans().poses("/goal").moving("odom", "lidar");
  CHECK_THAT(notes_text(*with_transforms.open()), Contains("- poses: the transforms"));
  CHECK_THAT(notes_text(*with_transforms.open(with_odometry("/goal"))), Contains("- poses: /goal"));
  Bag several;
  CHECK_THAT(several.scans().poses("/a").poses("/b").error(),
             Contains("several topics of poses: /a") && Contains("--odometry-topic"));
}

TEST_CASE("a recording without poses is refused, and what to run is named") {
  Bag bag;
  CHECK_THAT(
      bag.scans().fixed("base_link", "lidar", at_x(0.5)).error(),
      Contains("holds scans but no poses") && Contains("kiss_icp_pipeline") && Contains("--poses"));
}

TEST_CASE("poses that another program made from a bag are handed in as a file") {
  Bag bag;
  bag.scans();
  OpenOptions options;
  options.poses = bag.directory().write(
      "poses.txt", "1000.0 0 0 0 0 0 0 1\n1000.4 4 0 0 0 0 0 1\n1000.7 7 0 0 0 0 0 1\n");
  const auto dataset = bag.open(options);
  CHECK(dataset->scan_count() == 8);
  CHECK(dataset->pose(3).translation.x() == Approx(3.0));
}

TEST_CASE("a LiDAR whose place on the robot is not in the bag is a warning") {
  Bag bag;
  const auto dataset = bag.scans().odometry().open();
  CHECK(dataset->scan_count() == 11);
  CHECK_THAT(notes_text(*dataset),
             Contains("! no transform between 'base_link' and the LiDAR's frame 'lidar'"));
}

TEST_CASE("scans that lie in the odometry's own frame are refused") {
  Bag bag;
  CHECK_THAT(bag.scans("/cloud_registered", "odom").odometry().error(),
             Contains("no longer as the LiDAR saw them"));
}

TEST_CASE("scans and odometry of different clocks are refused with both times") {
  Bag bag;
  CHECK_THAT(bag.scans().odometry("/odom", "lidar", 500, 501).error(),
             Contains("none of its 11 scans (1000.000 to 1001.000 s) has a pose") &&
                 Contains("1500.000 to") && Contains("clocks"));
}

TEST_CASE("a bag without scans is refused with its topics") {
  Bag bag;
  CHECK_THAT(bag.odometry().error(),
             Contains("holds no scans") && Contains("/odom (nav_msgs/Odometry, 21 messages)"));
}

TEST_CASE("a folder with a bag in it is a bag") {
  Bag bag;
  bag.scans().odometry("/odom", "lidar").open();
  CHECK(open_dataset(bag.directory().path())->scan_count() == 11);
}

TEST_CASE("odd messages of a scan topic are left out, counted and named, up to a tenth") {
  const auto odd = [](std::vector<int> which, const std::function<std::string(int)>& message) {
    return [=](int i) {
      const bool is_odd = std::find(which.begin(), which.end(), i) != which.end();
      return is_odd ? message(i) : cloud_message(kEncoding, stamp_of(i), cloud_of(i));
    };
  };
  const auto cut = [](int i) {
    const std::string whole = cloud_message(kEncoding, stamp_of(i), cloud_of(i));
    return whole.substr(0, whole.size() / 2);
  };
  const auto too_short = [](int) { return std::string(9, 0); };
  const auto placeholder = [](int i) {
    return cloud_message(kEncoding, stamp_of(i), CloudOfMessage{});
  };
  const auto points = [](const Dataset& dataset) {
    std::vector<std::size_t> counts;
    for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
      Scan scan;
      dataset.read_scan(i, scan);
      counts.push_back(scan.points.size());
    }
    return counts;
  };
  Bag bag;
  SECTION("one whose points are cut off") {
    const auto dataset = bag.scans("/points", odd({3}, cut)).odometry("/odom", "lidar").open();
    CHECK(points(*dataset) == std::vector<std::size_t>{1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1});
    CHECK_THAT(notes_text(*dataset), Contains("! 1 of 11 scans cannot be read and is left out; "
                                              "the first: ") &&
                                         Contains("/points message 3: "));
  }
  SECTION("one whose header is cut off") {
    const auto dataset =
        bag.scans("/points", odd({3}, too_short)).odometry("/odom", "lidar").open();
    CHECK(dataset->scan_count() == 10);
    CHECK_THAT(notes_text(*dataset), Contains("! 1 message cannot be read") &&
                                         Contains("the first: /points message 3: "));
  }
  SECTION("clouds without points need no fields") {
    const auto dataset =
        bag.scans("/points", odd({1, 4, 7, 9}, placeholder)).odometry("/odom", "lidar").open();
    CHECK(points(*dataset) == std::vector<std::size_t>{1, 0, 1, 1, 0, 1, 1, 0, 1, 0, 1});
    CHECK_THAT(notes_text(*dataset), !Contains("!"));
  }
  SECTION("a sixth of them is no single odd message") {
    const auto dataset = bag.scans("/points", odd({3, 8}, cut)).odometry("/odom", "lidar").open();
    CHECK_THROWS_WITH(points(*dataset), Contains("2 of 11 scans cannot be read"));
    Bag shorter;
    shorter.scans("/points", odd({3, 8}, too_short)).odometry("/odom", "lidar");
    CHECK_THAT(shorter.error(), Contains("2 messages of /points"));
  }
}

TEST_CASE("scans whose stamp contradicts the order of recording are left out, not their twins") {
  Bag bag;
  const auto stamped = [](int i) {
    const std::int64_t glitch = i == 4 ? 3 * kSecond / 10 : 0;
    return cloud_message(kEncoding, stamp_of(i) + glitch, cloud_of(i));
  };
  const auto dataset = bag.scans("/points", stamped).odometry("/odom", "lidar").open();
  REQUIRE(dataset->scan_count() == 10);
  CHECK(dataset->scan_name(6) == "000007");
  CHECK_THAT(notes_text(*dataset),
             Contains("! 1 message of /points") && Contains("left out, the first message 4"));
}

TEST_CASE("a clock of the LiDAR that steps does not part scans from their poses") {
  Bag bag;
  const auto stamped = [](int i) {
    return cloud_message(kEncoding, stamp_of(i) + (i < 5 ? 0 : 5 * kSecond), cloud_of(i));
  };
  const auto dataset = bag.scans("/points", stamped).odometry("/odom", "lidar", -6.0, 6.0).open();
  REQUIRE(dataset->scan_count() == 11);
  for (std::size_t i = 1; i < 11; ++i) {
    CHECK(dataset->stamp_ns(i) - dataset->stamp_ns(i - 1) == kSecond / 10);
  }
  // The longer part is by the right clock.
  CHECK(dataset->pose(10).translation.x() == Approx(6.0));
  CHECK_THAT(notes_text(*dataset), Contains("steps by +5.000 s at message 5"));
}

TEST_CASE("two LiDARs on one topic are told apart by their frames") {
  const auto in_turn = [](int i) {
    return cloud_message(kEncoding, stamp_of(i), cloud_of(i), i % 2 == 0 ? "front" : "rear");
  };
  Bag known;
  known.scans("/points", in_turn).odometry();
  known.fixed("base_link", "front", at_x(0.5)).fixed("base_link", "rear", at_x(-0.5));
  const auto both = known.open();
  REQUIRE(both->scan_count() == 6);
  CHECK(both->pose(0).translation.x() == Approx(0.5));
  Scan scan;
  both->read_scan(0, scan);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.points[0].x == 1.0F);
  CHECK(scan.points[1].x == Approx(2.0 + 0.1 - 1.0));
  const auto rear = known.open(with_topic("/points@rear"));
  CHECK(rear->scan_count() == 5);
  CHECK(rear->pose(0).translation.x() == Approx(-0.4));
  CHECK_THAT(known.error(with_topic("/points@left")),
             Contains("no scans of 'left'; there are 'front' (6 messages), 'rear' (5 messages)"));
  Bag unknown;
  unknown.scans("/points", in_turn).odometry();
  CHECK_THAT(unknown.error(), Contains("'front' (6 messages), 'rear' (5 messages)") &&
                                  Contains("choose one with --topic /points@front") &&
                                  Contains("--topic /points@front,/points@rear and --extrinsic"));
}

TEST_CASE("a path is the poses of its last message, and of those before what it has not") {
  const bool is_whole = GENERATE(true, false);
  // The recorder may have another clock, as where a recording is played back and recorded again.
  for (const std::int64_t later_ns : {std::int64_t{0}, 1000 * kSecond, -1000 * kSecond}) {
    Bag bag;
    const auto dataset = bag.scans().path(is_whole, later_ns).open();
    REQUIRE(dataset->scan_count() == 11);
    CHECK(dataset->pose(3).translation.x() == Approx(0.3));
    CHECK(dataset->pose(10).translation.x() == Approx(1.0));
  }
}

TEST_CASE("poses that are too far apart are said to be so") {
  Bag bag;
  bag.scans().odometry("/odom", "lidar", -1.05, -1.0).odometry("/other", "lidar", 2.05, 2.1);
  CHECK_THAT(bag.error(with_odometry("/odom")), Contains("are their clocks the same?"));
  Bag sparse;
  sparse.scans().poses("/pose", 10);
  CHECK_THAT(sparse.error(), Contains("poses are 2.5 s apart") &&
                                 Contains("11 of 11 scans lie between poses farther apart"));
}

TEST_CASE("poses whose frames are named the wrong way round are those of the LiDAR's base") {
  Bag bag;
  bag.scans().odometry("/odom", "odom", 0.0, 1.0, "base_link");
  const auto dataset = bag.fixed("base_link", "lidar", at_x(0.5)).open();
  CHECK(dataset->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(notes_text(*dataset),
             Contains("! the frames of /odom") && Contains("named the wrong way round") &&
                 Contains("the scans do not tell whether poses are inverted, too"));
}
