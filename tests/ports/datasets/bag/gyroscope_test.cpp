// Tests of the gyroscope out of a bag.
#include <catch2/catch.hpp>
#include <cmath>

#include "ports/datasets/formats.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000'000;
constexpr Encoding kEncoding = Encoding::kCdrLittle;
const Eigen::Vector3d kTurn_rad_s(0.1, 0.2, 0.3);

/// Turns x to y, y to -x.
const Pose kLeft(Eigen::Matrix3d{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, Eigen::Vector3d(1, 2, 3));

/// A bag with two scans in the frame 'lidar', and what else is added.
class Bag {
 public:
  explicit Bag(const std::string& scans = "/points") {
    const auto channel = file_.topic(scans, "sensor_msgs/msg/PointCloud2");
    const auto odometry = file_.topic("/odom", "nav_msgs/msg/Odometry");
    for (int i = 0; i < 2; ++i) {
      const std::int64_t stamp_ns = kStart_ns + i * 100'000'000;
      file_.message(channel, stamp_ns,
                    cloud_message(kEncoding, stamp_ns, plain_cloud({{1.0F, 0.0F, 0.0F}})));
      file_.message(odometry, stamp_ns, odometry_message(kEncoding, stamp_ns, {}, "odom", "lidar"));
    }
    file_.end_chunk();
  }
  Bag& imu(const std::string& topic, const std::vector<std::string>& messages) {
    const auto channel = file_.topic(topic, "sensor_msgs/msg/Imu");
    std::int64_t log_ns = kStart_ns;
    for (const std::string& message : messages) file_.message(channel, log_ns += 1000, message);
    file_.end_chunk();
    return *this;
  }
  Bag& imu(const std::string& topic, const std::string& frame) {
    return imu(topic,
               std::vector<std::string>{imu_message(kEncoding, kStart_ns, kTurn_rad_s, frame)});
  }
  Bag& fixed(const std::string& parent, const std::string& child) {
    file_.message(file_.topic("/tf_static", "tf2_msgs/msg/TFMessage"), kStart_ns,
                  transforms_message(kEncoding, {{kStart_ns, parent, child, kLeft}}));
    file_.end_chunk();
    return *this;
  }

  RecordedGyroscope gyroscope(const std::string& topic = {}) {
    return open_bag(write(), {.imu_topic = topic})->gyroscope();
  }
  std::string error(const std::string& topic) {
    return error_of([&] { static_cast<void>(gyroscope(topic)); });
  }

  std::filesystem::path write() const { return directory_.write("drive.mcap", file_.bytes()); }

 private:
  McapFile file_;
  TemporaryDirectory directory_;
};

}  // namespace

TEST_CASE("the gyroscope in the LiDAR's frame is taken as it is") {
  const RecordedGyroscope gyroscope = Bag().imu("/imu", "lidar").gyroscope();
  CHECK(gyroscope.description == "/imu (sensor_msgs/Imu, 1 message)");
  CHECK(gyroscope.notes.empty());
  REQUIRE(gyroscope.samples.size() == 1);
  CHECK(gyroscope.samples[0].stamp_ns == kStart_ns);
  CHECK(gyroscope.samples[0].rad_s == kTurn_rad_s);
}

TEST_CASE("a gyroscope elsewhere on the robot is turned to the LiDAR's axes") {
  Bag bag;
  bag.imu("/imu", "imu_link").fixed("base_link", "lidar").fixed("lidar", "imu_link");
  const RecordedGyroscope gyroscope = bag.gyroscope();
  REQUIRE(gyroscope.samples.size() == 1);
  CHECK(gyroscope.samples[0].rad_s.isApprox(Eigen::Vector3d(-0.2, 0.1, 0.3)));
}

TEST_CASE("accelerations are turned likewise, and those that a message says it lacks are zero") {
  const auto message = [](std::int64_t after_ns, double first_covariance) {
    return imu_message(kEncoding, kStart_ns + after_ns, kTurn_rad_s, "imu_link", 0.0,
                       {1.0, 2.0, 9.0}, first_covariance);
  };
  Bag bag;
  bag.imu("/imu", {message(1, 0.0), message(2, -1.0)}).fixed("lidar", "imu_link");
  const RecordedGyroscope imu = bag.gyroscope();
  REQUIRE(imu.samples.size() == 2);
  CHECK(imu.samples[0].acceleration.isApprox(Eigen::Vector3d(-2.0, 1.0, 9.0)));
  CHECK(imu.samples[1].acceleration.isZero(0.0));
}

TEST_CASE("a gyroscope whose axes nothing tells is named and not used") {
  Bag bag;
  bag.imu("/imu", "imu_link");
  const RecordedGyroscope gyroscope = bag.gyroscope();
  CHECK(gyroscope.samples.empty());
  REQUIRE(gyroscope.notes.size() == 1);
  CHECK_THAT(gyroscope.notes[0].text, Contains("none is used: no fixed transform") &&
                                          Contains("/imu (sensor_msgs/Imu, 1 message)"));
  CHECK_THAT(bag.error("imu"), Contains("--imu-topic: no fixed transform"));
  CHECK(bag.gyroscope("off").notes.empty());
}

TEST_CASE("of several gyroscopes the LiDAR's is taken, by frame or by namespace") {
  CHECK_THAT(Bag()
                 .imu("/a", "imu_link")
                 .imu("/b", "lidar")
                 .fixed("lidar", "imu_link")
                 .gyroscope()
                 .description,
             Contains("/b"));
  CHECK_THAT(Bag("/ouster/points")
                 .imu("/a", "imu_link")
                 .imu("/ouster/imu", "imu_link")
                 .fixed("lidar", "imu_link")
                 .gyroscope()
                 .description,
             Contains("/ouster/imu"));
}

TEST_CASE("of gyroscopes that fit alike the one named is taken, else none") {
  Bag bag;
  bag.imu("/a", "lidar").imu("/b", "lidar");
  const RecordedGyroscope none = bag.gyroscope();
  CHECK(none.samples.empty());
  REQUIRE(none.notes.size() == 1);
  CHECK_THAT(none.notes[0].text, Contains("several fit: /a") && Contains("--imu-topic"));
  CHECK(bag.gyroscope("/b").samples.size() == 1);
  CHECK_THAT(bag.error("/points"), Contains("/points (sensor_msgs/PointCloud2, 2 messages) holds "
                                            "no sensor_msgs/Imu; topics of sensor_msgs/Imu: /a"));
}

TEST_CASE("samples are in the order of their stamps, without the odd ones, which are counted") {
  const auto message = [](std::int64_t after_ns, const std::string& frame = "lidar",
                          double first_covariance = 0.0) {
    return imu_message(kEncoding, kStart_ns + after_ns, kTurn_rad_s, frame, first_covariance);
  };
  Eigen::Vector3d not_finite = kTurn_rad_s;
  not_finite.y() = NAN;
  const RecordedGyroscope gyroscope =
      Bag()
          .imu("/imu", {message(20), message(10), message(30, "other"), message(40, "lidar", -1.0),
                        imu_message(kEncoding, kStart_ns + 50, not_finite), "short",
                        imu_message(kEncoding, 0, kTurn_rad_s)})
          .gyroscope();
  REQUIRE(gyroscope.samples.size() == 3);
  CHECK(gyroscope.samples[0].stamp_ns == kStart_ns + 10);
  CHECK(gyroscope.samples[1].stamp_ns == kStart_ns + 20);
  CHECK(gyroscope.samples[2].stamp_ns == kStart_ns + 7000);  // that of its recording
  REQUIRE(gyroscope.notes.size() == 1);
  CHECK_THAT(gyroscope.notes[0].text,
             Contains("4 messages of /imu are left out: 1 cannot be read") &&
                 Contains("2 have no angular velocity, 1 are of another frame"));
}

TEST_CASE("a gyroscope that is named for recorded poses is refused") {
  CHECK_THAT(open_error(Bag().write(), {.imu_topic = "/imu"}), Contains("--odometry own"));
}
