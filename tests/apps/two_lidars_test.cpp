// End-to-end tests of a bag with two LiDARs of one robot, compared with one folder of scans.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "ports/bag_writers/bag_writer.hpp"
#include "src/input/extrinsic.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::size_t kScans = 30;
constexpr double kSweep_s = 0.1;
constexpr double kRearLater_s = 0.03;

std::int64_t stamp_ns(double time_s) {
  return kStart_ns + static_cast<std::int64_t>(std::llround(1e9 * time_s));
}

/// T_odometry_base: 4 m/s with turns.
Pose base_at(double time_s) {
  return {
      Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * std::sin(0.7 * time_s), Eigen::Vector3d::UnitZ())),
      {4.0 * time_s, 0.3 * std::sin(time_s), 0.0}};
}

struct Box {
  Eigen::Vector3d low, high;
};

/// Where a ray enters and leaves a box.
std::array<double, 2> crossing(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                               const Box& box) {
  double enters = -std::numeric_limits<double>::infinity();
  double leaves = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.low[axis] - origin[axis]) / direction[axis];
    const double b = (box.high[axis] - origin[axis]) / direction[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return {enters, leaves};
}

/// Range in a street with walls, pillars and somebody who walks across; 0: no return.
double range_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double time_s) {
  const Box street{{-30.0, -9.0, 0.0}, {60.0, 8.0, 30.0}};
  double range = crossing(origin, direction, street)[1];
  if (origin.z() + range * direction.z() > 12.0) range = std::numeric_limits<double>::infinity();
  std::vector<Box> boxes;
  for (double x = -22.0; x < 60.0; x += 9.0) boxes.push_back({{x, 5.0, 0.0}, {x + 0.6, 5.6, 5.0}});
  for (double x = -18.0; x < 60.0; x += 13.0)
    boxes.push_back({{x, -7.0, 0.0}, {x + 2.0, -5.5, 2.0}});
  const Eigen::Vector3d walker(14.0 - 0.5 * time_s, -4.0 + 2.0 * time_s, 0.0);
  boxes.push_back({walker, walker + Eigen::Vector3d(0.7, 0.7, 1.8)});
  for (const Box& box : boxes) {
    const auto [enters, leaves] = crossing(origin, direction, box);
    if (enters > 0.0 && enters < leaves) range = std::min(range, enters);
  }
  return range < 100.0 ? range : 0.0;
}

struct Lidar {
  std::string topic, frame, extrinsic;
  double later_s = 0.0;

  [[nodiscard]] Pose T_base_lidar() const { return input::parse_extrinsic(extrinsic, "test"); }
  [[nodiscard]] double time_s(std::size_t scan) const {
    return kSweep_s * static_cast<double>(scan + 1) + later_s;
  }
  [[nodiscard]] Pose pose_at(double time_s) const { return base_at(time_s) * T_base_lidar(); }

  /// Points of a sweep as the driver publishes them: each in the frame of its own time.
  [[nodiscard]] std::vector<bags::CloudPoint> sweep(std::size_t scan) const {
    constexpr int kColumns = 450;
    constexpr int kRings = 16;
    std::vector<bags::CloudPoint> points;
    for (int column = 0; column < kColumns; ++column) {
      const double since_stamp_s = kSweep_s * (static_cast<double>(column) / kColumns - 1.0);
      const double at_s = time_s(scan) + since_stamp_s;
      const Pose pose = pose_at(at_s);
      const double azimuth = 2.0 * 3.14159265358979 * column / kColumns;
      for (int ring = 0; ring < kRings; ++ring) {
        const double elevation = (2.0 * ring - 15.0) / kDegreesPerRadian;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const double range = range_m(pose.translation, pose.rotation * ray, at_s);
        if (range == 0.0) continue;
        const Eigen::Vector3f p = (range * ray).cast<float>();
        points.push_back({p.x(), p.y(), p.z(), 0.5F, static_cast<std::uint16_t>(ring),
                          static_cast<float>(since_stamp_s)});
      }
    }
    return points;
  }
};

const std::array<Lidar, 2>& lidars() {
  static const std::array<Lidar, 2> both = {{
      {"/front/points", "lidar_front", "0.3,0,1.6,0,5,0", 0.0},
      {"/rear/points", "lidar_rear", "0.0,0.25,1.4,3,-8,170", kRearLater_s},
  }};
  return both;
}

/// A bag of both LiDARs, the odometry of the base at 100 Hz, and where the LiDARs are mounted.
void write_bag(const fs::path& file, bags::Container container, bool says_mounting) {
  const auto bag = bags::create_bag(container, file);
  using bags::MessageType;
  const std::size_t odometry = bag->add_topic({"/odom", MessageType::kOdometry});
  const std::size_t mounting = bag->add_topic({"/tf_static", MessageType::kTransforms, true});
  std::array<std::size_t, 2> points{};
  for (std::size_t l = 0; l < 2; ++l) {
    points[l] = bag->add_topic({lidars()[l].topic, MessageType::kPointCloud2});
  }
  if (says_mounting) {
    bags::Transforms transforms;
    for (const Lidar& lidar : lidars()) {
      bags::Transform& mounted = transforms.emplace_back();
      mounted.header.stamp_ns = kStart_ns;
      mounted.header.frame_id = "base_link";
      mounted.child_frame_id = lidar.frame;
      mounted.transform = lidar.T_base_lidar();
    }
    bag->write(mounting, kStart_ns, transforms);
  }
  constexpr int kPerScan = 10;
  for (int k = 0; k <= kPerScan * static_cast<int>(kScans + 1); ++k) {
    const double time_s = kSweep_s * k / kPerScan;
    bag->write(odometry, stamp_ns(time_s),
               bags::Odometry{{stamp_ns(time_s), "odom"}, "base_link", base_at(time_s)});
  }
  for (std::size_t i = 0; i < kScans; ++i) {
    for (std::size_t l = 0; l < 2; ++l) {
      const std::int64_t stamp = stamp_ns(lidars()[l].time_s(i));
      const std::vector<bags::CloudPoint> sweep = lidars()[l].sweep(i);
      bag->write(points[l], stamp, bags::PointCloud2{{stamp, lidars()[l].frame}, sweep});
    }
  }
  bag->close();
}

/// The same as one folder of scans: what a single scanner at the place of the front LiDAR would
/// have recorded at its stamps, had it seen the points of both.
SmallRecording reference() {
  SmallRecording recording(0);
  const Lidar& front = lidars()[0];
  for (std::size_t i = 0; i < kScans; ++i) {
    const Pose T_front_odometry = front.pose_at(front.time_s(i)).inverse();
    datasets::Scan scan;
    for (const Lidar& lidar : lidars()) {
      for (const bags::CloudPoint& p : lidar.sweep(i)) {
        const Pose pose = lidar.pose_at(lidar.time_s(i) + static_cast<double>(p.time_s));
        const Eigen::Vector3f at_stamp =
            (T_front_odometry * (pose * Eigen::Vector3d(p.x, p.y, p.z))).cast<float>();
        scan.points.push_back({at_stamp.x(), at_stamp.y(), at_stamp.z(), p.intensity});
      }
    }
    recording.scans.push_back(std::move(scan));
    recording.poses.push_back(front.pose_at(front.time_s(i)));
    recording.stamps_ns.push_back(stamp_ns(front.time_s(i)));
  }
  return recording;
}

/// The farthest that a point of the bag lies from the same point of the reference.
double farthest_m(const datasets::Dataset& bag, const SmallRecording& expected) {
  double farthest = 0.0;
  REQUIRE(bag.scan_count() == kScans);
  datasets::Scan scan;
  for (std::size_t i = 0; i < kScans; ++i) {
    CHECK(bag.stamp_ns(i) == expected.stamps_ns[i]);
    CHECK((bag.pose(i).inverse() * expected.poses[i]).translation.norm() < 1e-3);
    bag.read_scan(i, scan);
    REQUIRE(scan.points.size() == expected.scans[i].points.size());
    for (std::size_t k = 0; k < scan.points.size(); ++k) {
      const auto& p = scan.points[k];
      const auto& q = expected.scans[i].points[k];
      farthest = std::max(farthest, Eigen::Vector3d(p.x - q.x, p.y - q.y, p.z - q.z).norm());
    }
  }
  return farthest;
}

}  // namespace

TEST_CASE("two LiDARs of one robot in a bag are one scan of all points in the first one's frame") {
  const TemporaryDirectory directory;
  const SmallRecording expected = reference();
  datasets::OpenOptions options;
  options.topic = "/front/points, /rear/points";
  for (const auto& [name, container] : {std::pair{"drive.mcap", bags::Container::kMcap},
                                        {"drive.bag", bags::Container::kRosbag1}}) {
    write_bag(directory / name, container, true);
    CHECK(farthest_m(*datasets::open_dataset(directory / name, options), expected) < 0.02);
  }
  // Where the LiDARs are may be said by hand.
  write_bag(directory / "unmounted.mcap", bags::Container::kMcap, false);
  for (const Lidar& lidar : lidars()) options.T_base_lidar.push_back(lidar.T_base_lidar());
  CHECK(farthest_m(*datasets::open_dataset(directory / "unmounted.mcap", options), expected) <
        0.02);
}

TEST_CASE("the map of two LiDARs in a bag is that of one folder with the points of both") {
  const TemporaryDirectory directory;
  reference().write(directory / "folder");
  write_bag(directory / "drive.mcap", bags::Container::kMcap, true);
  const auto keyframes = [&](const std::string& input, const std::string& out, const Words& more) {
    const CommandResult result =
        run_well({"onboard", directory / input, "--out", directory / out}, more);
    CHECK_THAT(result.err, !Contains("warning: input"));
    return read_json(directory / out / "stats.json")["keyframes"];
  };
  CHECK(keyframes("folder", "of_folder", {}) ==
        keyframes("drive.mcap", "of_bag", {"--topic", "/front/points,/rear/points"}));
  const LabelPairs labels = label_pairs(directory / "of_folder", directory / "of_bag");
  CHECK(labels.dynamic > 100);  // who walks across
  CHECK(static_cast<double>(labels.equal) > 0.995 * static_cast<double>(labels.all));
}

TEST_CASE("two LiDARs in a bag are named, and it must be known where each is mounted") {
  const TemporaryDirectory directory;
  const fs::path bag = directory / "drive.mcap";
  write_bag(bag, bags::Container::kMcap, false);
  check_fails(run_unimapper({"inspect", bag}),
              "choose one with --topic, or take LiDARs of one robot as one: --topic "
              "/front/points,/rear/points");
  const Words both = {"inspect", bag, "--topic", "/front/points,/rear/points"};
  const Words front = {"--extrinsic", lidars()[0].extrinsic};
  const struct {
    Words more;
    const char* message;
  } refused[] = {
      {{}, "no transform between 'base_link' and the LiDAR's frame 'lidar_front'"},
      {front, "1 mounting is given: give --extrinsic"},
      {{"--poses", "poses.txt"}, "--poses are those of one LiDAR or of the robot"},
  };
  for (const auto& [more, message] : refused) {
    const CommandResult result = run_unimapper(both, more);
    check_fails(result, message);
    CHECK_THAT(result.err, Contains("in the order of --topic"));
  }
  CHECK_THAT(run_well(both, {front[0], front[1], "--extrinsic", lidars()[1].extrinsic}).out,
             Contains("LiDAR 2 added to 30 of 30 scans, 0.44 m from the first") &&
                 Contains("nothing unusual"));
}

TEST_CASE("a LiDAR's own data sheet says where it is mounted, unless the option does") {
  const TemporaryDirectory directory;
  const fs::path bag = directory / "drive.mcap";
  write_bag(bag, bags::Container::kMcap, false);
  const std::string sheet =
      directory.write("sheet.json",
                      R"({"name": "rear", "pattern": "spinning", "horizontal_fov_deg": 360,
      "elevation_deg": [-15, 15], "range_m": [0.5, 100], "rings": 16, "columns": [450],
      "scan_rate_hz": 10, "extrinsic": [0.0, 0.25, 1.4, 3, -8, 170]})");
  const auto inspect = [&](const Words& more) {
    const CommandResult result =
        run_well({"inspect", bag, "--json", "--topic", "/rear/points"}, more);
    auto json = nlohmann::json::parse(result.out);
    json.erase("sensor");
    json.erase("checks");  // one more where a sheet is given
    return json;
  };
  const auto by_option = inspect({"--extrinsic", lidars()[1].extrinsic});
  CHECK(by_option["severity"] == "fine");
  CHECK(inspect({"--sensor-file", sheet}) == by_option);
  const auto unmounted = inspect({"--extrinsic", "0,0,0,0,0,0"});
  CHECK(inspect({"--sensor-file", sheet, "--extrinsic", "0,0,0,0,0,0"}) == unmounted);
  CHECK(unmounted["severity"] != "fine");
}
