// Tests of scans and poses out of a bag.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <set>

#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"

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

/// The n-th message of a topic.
using Message = std::function<std::string(int)>;

/// A bag with one second of scans at 10 Hz, the n-th with the only point (n + 1, 0, 0).
class Bag {
 public:
  Bag& scans(const std::string& topic = "/points", const std::string& frame = "lidar") {
    return scans(topic,
                 [&](int i) { return cloud_message(kEncoding, stamp_of(i), cloud_of(i), frame); });
  }
  /// With messages of another kind.
  Bag& scans(const std::string& topic, const Message& message) {
    return add(topic, "sensor_msgs/msg/PointCloud2", 11,
               [&](int i) { return std::pair(stamp_of(i) + kSecond / 10, message(i)); });
  }

  /// One with each scan.
  Bag& messages(const std::string& topic, const char* type, const Message& message) {
    return add(topic, type, 11, [&](int i) { return std::pair(stamp_of(i), message(i)); });
  }

  /// Odometry at 20 Hz, 1 m/s along x from x = 0 at the first scan on.
  Bag& odometry(const std::string& topic = "/odom", const std::string& child = "base_link",
                double from_s = 0.0, double to_s = 1.0, const std::string& frame = "odom") {
    const auto count = static_cast<int>((to_s - from_s + 0.01) / 0.05) + 1;
    return add(topic, "nav_msgs/msg/Odometry", count, [&](int i) {
      const double t = from_s + 0.05 * i;
      const auto stamp = kStart + static_cast<std::int64_t>(std::llround(t * 1e9));
      return std::pair(stamp, odometry_message(kEncoding, stamp, at_x(t), frame, child));
    });
  }

  /// Odometry at 40 Hz, every second pose of another trajectory 7 m beside it.
  Bag& two_odometries(const std::string& frame, const std::string& child) {
    return add("/odom", "nav_msgs/msg/Odometry", 41, [&](int i) {
      const std::int64_t stamp = kStart + i * kSecond / 40;
      const bool is_other = i % 2 == 1;
      Pose pose = at_x(0.025 * i);
      if (is_other) pose.translation.y() = 7.0;
      return std::pair(stamp, odometry_message(kEncoding, stamp, pose, is_other ? frame : "odom",
                                               is_other ? child : "lidar"));
    });
  }

  Bag& poses(const std::string& topic, int times_slower = 1) {
    return add(topic, "geometry_msgs/msg/PoseStamped", 5, [&](int i) {
      const std::int64_t stamp = kStart + (i * times_slower - times_slower / 5) * kSecond / 4;
      return std::pair(stamp, pose_message(kEncoding, stamp, at_x(0.25 * i)));
    });
  }

  /// All poses so far in each message, or the last five.
  Bag& path(bool is_whole, std::int64_t recorded_later_ns = 0) {
    return add("/path", "nav_msgs/msg/Path", 21, [&](int i) {
      MessageWriter writer(kEncoding);
      const int first = is_whole ? 0 : std::max(0, i - 4);
      writer.header(stamp_of(i) / 2, "map").number(static_cast<std::uint32_t>(i - first + 1));
      for (int k = first; k <= i; ++k) {
        writer.header(kStart + k * kSecond / 20, "map").pose(at_x(0.05 * k));
      }
      return std::pair(kStart + i * kSecond / 20 + recorded_later_ns, writer.bytes());
    });
  }

  /// One with each scan.
  Bag& fixes(const std::string& topic, const std::vector<FixOfMessage>& fixes) {
    return add(topic, "sensor_msgs/msg/NavSatFix", static_cast<int>(fixes.size()), [&](int i) {
      return std::pair(stamp_of(i),
                       fix_message(kEncoding, stamp_of(i), fixes[static_cast<std::size_t>(i)]));
    });
  }

  Bag& fixed(const std::string& parent, const std::string& child, double x) {
    return fixed(parent, child, at_x(x));
  }
  Bag& fixed(const std::string& parent, const std::string& child, const Pose& pose) {
    return add("/tf_static", "tf2_msgs/msg/TFMessage", 1, [&](int /*i*/) {
      return std::pair(kStart, transforms_message(kEncoding, {{kStart, parent, child, pose}}));
    });
  }
  /// The child moves at 1 m/s along x; a second publisher says 7 m ahead.
  Bag& moving(const std::string& parent, const std::string& child, int publishers = 1) {
    return add("/tf", "tf2_msgs/msg/TFMessage", 21 * publishers, [&](int i) {
      const int k = i / publishers;
      const std::int64_t stamp = kStart + k * kSecond / 20 + i % publishers * 1000;
      const Pose pose = at_x(0.05 * k + i % publishers * 7.0);
      return std::pair(stamp, transforms_message(kEncoding, {{stamp, parent, child, pose}}));
    });
  }

  std::unique_ptr<Dataset> open(const OpenOptions& options = {}) {
    return open_dataset(directory_.write("drive.mcap", file_.bytes()), options);
  }
  std::string error(const OpenOptions& options = {}) {
    return error_of([&] { open(options); });
  }
  const TemporaryDirectory& directory() const { return directory_; }

 private:
  /// Adds `count` messages, each with the time of its recording.
  template <typename Recorded>
  Bag& add(const std::string& topic, const char* type, int count, const Recorded& recorded) {
    const auto channel = file_.topic(topic, type);
    for (int i = 0; i < count; ++i) {
      const auto [time_ns, message] = recorded(i);
      file_.message(channel, time_ns, message);
    }
    file_.end_chunk();
    return *this;
  }

  McapFile file_;
  TemporaryDirectory directory_;
};

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
                           .fixed("base_link", "lidar", 0.5)
                           .fixed("map", "odom", 100)
                           .open();
  REQUIRE(dataset->scan_count() == 11);
  CHECK(dataset->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(notes_text(*dataset), Contains("- poses: the transforms from 'lidar' to 'odom'"));
}

TEST_CASE("an option chooses the frame of the transforms, also where there is odometry") {
  Bag bag;
  bag.scans().odometry().moving("odom", "base_link").fixed("map", "odom", 100);
  bag.fixed("base_link", "lidar", 0.5);
  CHECK_THAT(notes_text(*bag.open()), Contains("LiDAR 'lidar' in it: x 0.500, y 0.000"));
  CHECK(bag.open({.frame = "map"})->pose(3).translation.x() == Approx(100.8));
  CHECK(bag.open({.odometry_topic = "/tf"})->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(bag.error({.frame = "earth"}),
             Contains("no pose of the LiDAR's frame 'lidar' in 'earth'; there are: odom, map"));
}

TEST_CASE("several frames that the LiDAR moves in are listed") {
  Bag bag;
  bag.scans().moving("start", "base_link").fixed("world_a", "start", 1);
  bag.fixed("base_link", "lidar", 0.5);
  CHECK_THAT(bag.error(), Contains("moves in several frames: start, world_a; choose one with "
                                   "--frame"));
  CHECK(bag.open({.frame = "start"})->pose(3).translation.x() == Approx(0.8));
}

TEST_CASE("several topics of scans are listed, and one is chosen by name") {
  Bag bag;
  bag.scans("/front").scans("/rear").odometry("/odom", "lidar");
  CHECK_THAT(bag.error(), Contains("drive.mcap: holds several topics of scans: /front "
                                   "(sensor_msgs/PointCloud2, 11 messages), /rear "
                                   "(sensor_msgs/PointCloud2, 11 messages); choose one with "
                                   "--topic"));
  CHECK(bag.open({.topic = "/rear"})->scan_count() == 11);
  CHECK(bag.open({.topic = "rear"})->scan_count() == 11);
  CHECK_THAT(bag.error({.topic = "/left"}),
             Contains("holds no topic '/left'; topics of scans: /front"));
  CHECK_THAT(bag.error({.topic = "/odom"}), Contains("/odom (nav_msgs/Odometry, 21 messages) "
                                                     "holds no scans"));
}

TEST_CASE("several topics of odometry are listed, and one is chosen by name") {
  Bag bag;
  bag.scans().odometry("/wheels", "lidar").odometry("/lidar_odometry", "lidar");
  CHECK_THAT(bag.error(), Contains("several topics of odometry: /wheels") &&
                              Contains("choose one with --odometry-topic"));
  CHECK(bag.open({.odometry_topic = "/wheels"})->scan_count() == 11);
  bag.moving("odom", "lidar");
  CHECK(bag.open({.frame = "odom"})->scan_count() == 11);
  CHECK_THAT(bag.error({.odometry_topic = "/gps"}),
             Contains("holds no topic '/gps'; topics of poses: /wheels"));
}

TEST_CASE("of the trajectories on one topic the one with most poses is taken, with a warning") {
  for (const auto& [frame, child] : {std::pair("map", "lidar"), std::pair("odom", "base_link"),
                                     std::pair("odom", ""), std::pair("", "lidar")}) {
    CAPTURE(frame, child);
    Bag bag;
    const auto dataset = bag.scans().two_odometries(frame, child).open();
    REQUIRE(dataset->scan_count() == 11);
    for (std::size_t i = 0; i < 11; ++i) CHECK(dataset->pose(i).translation.y() == 0.0);
    CHECK_THAT(notes_text(*dataset),
               Contains("! /odom (nav_msgs/Odometry, 41 messages) holds poses of several frames: "
                        "those of 'lidar' in 'odom' are taken, left out are 20 of '" +
                        std::string(child) + "' in '" + frame + "'"));
  }
  Bag bag;
  CHECK_THAT(notes_text(*bag.scans().odometry("/odom", "lidar").open()),
             !Contains("several frames"));
}

TEST_CASE("two publishers of one trajectory are refused, on a topic and among transforms") {
  Bag topic;
  CHECK_THAT(topic.scans().two_odometries("odom", "lidar").error(),
             Contains("the poses of /odom (nav_msgs/Odometry, 41 messages) alternate between two "
                      "trajectories: 39 of 40 steps jump and come back; does a second node "
                      "publish there?"));
  Bag transforms;
  CHECK_THAT(transforms.scans().moving("odom", "lidar", 2).error(),
             Contains("the poses of 'lidar' in 'odom' of the transforms alternate"));
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
  CHECK_THAT(notes_text(*with_transforms.open({.odometry_topic = "/goal"})),
             Contains("- poses: /goal"));
  CHECK_THAT(Bag().scans().poses("/a").poses("/b").error(),
             Contains("several topics of poses: /a") && Contains("--odometry-topic"));
}

TEST_CASE("fixes have their deviation and the antenna's place, and what is none is counted") {
  const double nan = std::nan("");
  const std::vector<FixOfMessage> fixes = {{},
                                           {.sigma_m = 0.001},
                                           {.covariance_type = 0},
                                           {.sigma_m = nan},
                                           {.status = -1},
                                           {.latitude_deg = nan},
                                           {.latitude_deg = 91.0},
                                           {.latitude_deg = 0.0, .longitude_deg = 0.0},
                                           {.height_m = 1e9}};
  Bag bag;
  bag.scans().odometry().fixed("base_link", "lidar", 0.5).fixes("/fix", fixes);
  const std::string unplaced = notes_text(*bag.open());
  CHECK_THAT(unplaced, Contains("! no transform tells where the antenna 'gps' is on the LiDAR"));
  const auto dataset = bag.fixed("base_link", "gps", 2.0).open();
  const std::vector<Fix> found = dataset->fixes();
  REQUIRE(found.size() == 4);
  CHECK(found[1].stamp_ns == stamp_of(1));
  CHECK(found[0].latitude_deg == 48.1);
  REQUIRE(found[0].lever);
  CHECK(*found[0].lever == Eigen::Vector3d(1.5, 0.0, 0.0));
  const double sigmas[] = {0.5, 0.005, 5.0, 5.0};
  for (std::size_t i = 0; i < 4; ++i) CHECK(found[i].sigma_xy_m == sigmas[i]);
  CHECK(found[2].sigma_z_m == 10.0);
  CHECK_THAT(notes_text(*dataset),
             Contains("- known positions: /fix (sensor_msgs/NavSatFix, 9 messages): 4 taken, 1 "
                      "without a fix, 4 of no place, 2 taken with 5 m, 10 m in height, for no "
                      "deviation is given") &&
                 !Contains("no transform tells"));
  // Of two receivers the one that knows better.
  bag.fixes("/rtk", std::vector<FixOfMessage>(3, {.sigma_m = 0.005}));
  CHECK(bag.open()->fixes().size() == 3);
  CHECK_THAT(notes_text(*bag.open()), Contains("/rtk (sensor_msgs/NavSatFix, 3 messages): 3 taken; "
                                               "left out are 1 other topics, which tell less"));
}

TEST_CASE("poses that another program made from a bag are handed in as a file") {
  Bag bag;
  bag.scans();
  const auto poses = bag.directory().write(
      "poses.txt", "1000.0 0 0 0 0 0 0 1\n1000.4 4 0 0 0 0 0 1\n1000.7 7 0 0 0 0 0 1\n");
  const auto dataset = bag.open({.poses = poses});
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

TEST_CASE("a recording whose scans or poses are missing or do not fit is refused") {
  CHECK_THAT(Bag().scans().fixed("base_link", "lidar", 0.5).error(),
             Contains("own odometry lost 11 of 11 scans") && Contains("--poses"));
  CHECK_THAT(Bag().odometry().error(),
             Contains("holds no scans") && Contains("/odom (nav_msgs/Odometry, 21 messages)"));
  CHECK_THAT(Bag().scans("/cloud_registered", "odom").odometry().error(),
             Contains("no longer as the LiDAR saw them"));
  CHECK_THAT(Bag().scans().odometry("/odom", "lidar", 500, 501).error(),
             Contains("none of its 11 scans (1000.000 to 1001.000 s) has a pose") &&
                 Contains("1500.000 to") && Contains("clocks"));
  CHECK_THAT(Bag().scans().poses("/pose", 10).error(),
             Contains("poses are 2.5 s apart") &&
                 Contains("11 of 11 scans lie between poses farther apart"));
  Bag bag;
  bag.scans().odometry("/odom", "lidar", -1.05, -1.0).odometry("/other", "lidar", 2.05, 2.1);
  CHECK_THAT(bag.error({.odometry_topic = "/odom"}), Contains("are their clocks the same?"));
}

TEST_CASE("stamps that are all one, and poses without stamps, are refused as such") {
  CHECK_THAT(
      Bag()
          .scans("/points", [](int i) { return cloud_message(kEncoding, kStart, cloud_of(i)); })
          .odometry("/odom", "lidar", -1.0, 1.0)
          .error(),
      Contains("10 of 11 scans of /points have the stamp of another"));
  Bag unstamped;
  unstamped.scans().messages("/odom", "nav_msgs/msg/Odometry", [](int i) {
    return odometry_message(kEncoding, 0, at_x(0.1 * i), "odom", "lidar");
  });
  CHECK_THAT(unstamped.error(), Contains("these poses have no stamps"));
}

TEST_CASE("odometry of which no pose can be used is named where others take its place") {
  Bag bag;
  bag.scans().moving("odom", "lidar").messages("/odom", "nav_msgs/msg/Odometry", [](int i) {
    return odometry_message(kEncoding, stamp_of(i), at_x(std::nan("")), "odom", "lidar");
  });
  CHECK_THAT(notes_text(*bag.open()), Contains("! 11 poses of /odom (nav_msgs/Odometry, 11 "
                                               "messages) are not finite or no rotation"));
}

TEST_CASE("odd messages of a scan topic are left out, counted and named, up to a tenth") {
  Bag bag;
  const auto with_odd = [&](const std::set<int>& which, const Message& message) -> Bag& {
    bag.scans("/points", [&](int i) {
      return which.contains(i) ? message(i) : cloud_message(kEncoding, stamp_of(i), cloud_of(i));
    });
    return bag.odometry("/odom", "lidar");
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
      counts.push_back(scan_of(dataset, i).points.size());
    }
    return counts;
  };
  SECTION("one whose points are cut off") {
    const auto dataset = with_odd({3}, cut).open();
    CHECK(points(*dataset) == std::vector<std::size_t>{1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1});
    CHECK_THAT(notes_text(*dataset), Contains("! 1 of 11 scans cannot be read and is left out; "
                                              "the first: ") &&
                                         Contains("/points message 3: "));
  }
  SECTION("one whose header is cut off") {
    const auto dataset = with_odd({3}, too_short).open();
    CHECK(dataset->scan_count() == 10);
    CHECK_THAT(notes_text(*dataset), Contains("! 1 message cannot be read") &&
                                         Contains("the first: /points message 3: "));
  }
  SECTION("clouds without points need no fields") {
    const auto dataset = with_odd({1, 4, 7, 9}, placeholder).open();
    CHECK(points(*dataset) == std::vector<std::size_t>{1, 0, 1, 1, 0, 1, 1, 0, 1, 0, 1});
    CHECK_THAT(notes_text(*dataset), !Contains("!"));
  }
  SECTION("a sixth of them is no single odd message") {
    const auto dataset = with_odd({3, 8}, cut).open();
    CHECK_THROWS_WITH(points(*dataset), Contains("2 of 11 scans cannot be read"));
  }
  SECTION("nor are a sixth without a header") {
    CHECK_THAT(with_odd({3, 8}, too_short).error(), Contains("2 messages of /points"));
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
  known.fixed("base_link", "front", 0.5).fixed("base_link", "rear", -0.5);
  const auto both = known.open();
  REQUIRE(both->scan_count() == 6);
  CHECK(both->pose(0).translation.x() == Approx(0.5));
  const Scan scan = scan_of(*both, 0);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.points[0].x == 1.0F);
  CHECK(scan.points[1].x == Approx(2.0 + 0.1 - 1.0));
  const auto rear = known.open({.topic = "/points@rear"});
  CHECK(rear->scan_count() == 5);
  CHECK(rear->pose(0).translation.x() == Approx(-0.4));
  CHECK_THAT(known.error({.topic = "/points@left"}),
             Contains("no scans of 'left'; there are 'front' (6 messages), 'rear' (5 messages)"));
  CHECK_THAT(Bag().scans("/points", in_turn).odometry().error(),
             Contains("'front' (6 messages), 'rear' (5 messages)") &&
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

TEST_CASE("a transform to the LiDAR that is inverted is said, a right one is not") {
  const Pose T_base_lidar(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                          Eigen::Vector3d(0.5, 0.2, 1.0));
  const bool is_inverted = GENERATE(true, false);
  Bag bag;
  bag.odometry().fixed("base_link", "lidar", is_inverted ? T_base_lidar.inverse() : T_base_lidar);
  bag.scans("/points", [&](int i) {
    const Pose T_lidar_odometry = (at_x(0.1 * i) * T_base_lidar).inverse();
    std::vector<Eigen::Vector3f> points;
    for (int k = 0; k < 1500; ++k) {
      // Two walls beside the robot, and one ahead.
      const double x = 0.008 * k;
      const double z = 0.05 * (k % 40);
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(x, 4.0, z), Eigen::Vector3d(x, -4.0, z),
                                       Eigen::Vector3d(14.0, x - 6.0, z)}) {
        points.push_back((T_lidar_odometry * p).cast<float>());
      }
    }
    return cloud_message(kEncoding, stamp_of(i), plain_cloud(points));
  });
  const auto dataset = bag.open();
  CHECK((notes_text(*dataset).find("looks inverted") != std::string::npos) == is_inverted);
}

TEST_CASE("poses whose frames are named the wrong way round are those of the LiDAR's base") {
  Bag bag;
  bag.scans().odometry("/odom", "odom", 0.0, 1.0, "base_link");
  const auto dataset = bag.fixed("base_link", "lidar", 0.5).open();
  CHECK(dataset->pose(3).translation.x() == Approx(0.8));
  CHECK_THAT(notes_text(*dataset),
             Contains("! the frames of /odom") && Contains("named the wrong way round") &&
                 Contains("the scans do not tell whether poses are inverted, too"));
}
