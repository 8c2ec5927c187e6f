// Tests of positions by satellites, from a bag to a map in its place.
#include <random>

#include "src/apps/map/projection.hpp"
#include "tests/apps/project.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

constexpr const char* kSystem = "EPSG:25832";
constexpr Encoding kCdr = Encoding::kCdrLittle;

/// Where a drive's odometry lies in the system: turned by 0.5 rad.
const Pose kT_site_odometry{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())),
                            Eigen::Vector3d(686121.0, 5330438.0, 520.0)};

/// The place on WGS84 of a position in a system, by Newton's method.
Datum place_of(const Projection& system, const Eigen::Vector3d& position) {
  constexpr double kEastPerDegree_m = 74471.0;
  constexpr double kNorthPerDegree_m = 111202.0;
  Datum place{48.1, 11.5, position.z()};
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d off = position - system.project(place);
    place.latitude_deg += off.y() / kNorthPerDegree_m;
    place.longitude_deg += off.x() / kEastPerDegree_m;
    place.height_m += off.z();
  }
  return place;
}

std::string cloud_of(std::int64_t stamp_ns, const datasets::Scan& scan) {
  CloudOfMessage cloud;
  cloud.width = static_cast<std::uint32_t>(scan.points.size());
  cloud.fields = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};
  cloud.point_step = 12;
  cloud.row_step = cloud.width * cloud.point_step;
  for (const auto& p : scan.points) cloud.data += packed(p.x, p.y, p.z);
  return cloud_message(kCdr, stamp_ns, cloud);
}

/// A drive with a receiver 0.5 m ahead of the LiDAR and 1 m above it: 2 cm of noise; a
/// second long 30 m off, as reflected signals are.
std::string bag_of(const SmallRecording& drive) {
  const Pose T_lidar_antenna({Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.5, 0.0, 1.0)});
  const Projection system(kSystem);
  std::mt19937 random(7);
  std::normal_distribution<double> noise_m(0.0, 0.02);
  McapFile file;
  const auto points = file.topic("/points", "sensor_msgs/msg/PointCloud2");
  const auto odometry = file.topic("/odom", "nav_msgs/msg/Odometry");
  const auto transforms = file.topic("/tf_static", "tf2_msgs/msg/TFMessage");
  const auto fixes = file.topic("/fix", "sensor_msgs/msg/NavSatFix");
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const std::int64_t stamp_ns = drive.stamps_ns[i];
    if (i == 0) {
      file.message(transforms, stamp_ns,
                   transforms_message(kCdr, {{stamp_ns, "lidar", "gps", T_lidar_antenna}}));
    }
    file.message(odometry, stamp_ns,
                 odometry_message(kCdr, stamp_ns, drive.poses[i], "odom", "lidar"));
    file.message(points, stamp_ns, cloud_of(stamp_ns, drive.scans[i]));
    Eigen::Vector3d at = (kT_site_odometry * drive.poses[i] * T_lidar_antenna).translation;
    for (double& axis : at) axis += noise_m(random);
    if (i / 10 == 1) at.x() += 30.0;
    const Datum place = place_of(system, at);
    file.message(fixes, stamp_ns,
                 fix_message(kCdr, stamp_ns,
                             {0, place.latitude_deg, place.longitude_deg, place.height_m, 0.02}));
  }
  file.end_chunk();
  return file.bytes();
}

}  // namespace

TEST_CASE("positions by satellites are written as lines that are read again", "[fixes]") {
  const std::vector<datasets::Fix> fixes = {
      {2'000'000'001, 48.123456789, -11.5, 520.25, 0.02, 0.05, Eigen::Vector3d(0.5, 0.0, 1.0)},
      {1'500'000'000, 48.0, 11.0, 520.0, 5.0, 10.0, std::nullopt},
      {1'500'000'000, 49.0, 11.0, 520.0, 5.0, 10.0, std::nullopt}};
  const auto as_given = [](const Datum& place) {
    return Eigen::Vector3d(place.longitude_deg, place.latitude_deg, place.height_m);
  };
  const auto rows = parse_positions(format_positions(fixes), "f.csv", std::nullopt, as_given);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].stamp_ns == 1'500'000'000);
  CHECK(rows[0].lever == Eigen::Vector3d::Zero());
  CHECK(rows[1].stamp_ns == 2'000'000'001);
  CHECK((rows[1].position - Eigen::Vector3d(-11.5, 48.123456789, 520.25)).norm() < 1e-8);
  CHECK(rows[1].sigma_xy_m == 0.02);
  CHECK(rows[1].sigma_z_m == 0.05);
  CHECK(rows[1].lever == Eigen::Vector3d(0.5, 0.0, 1.0));
  CHECK_THROWS_WITH(parse_positions("stamp,z,sigma_z,lever_x,lever_y,lever_z\n1,2,1,0,0,101\n",
                                    "f.csv", std::nullopt),
                    Contains("f.csv:2: '101' is out of range"));
}

TEST_CASE("a drive with fixes becomes a map in its place", "[fixes]") {
  const TemporaryDirectory directory;
  const SmallRecording drive(40);
  const fs::path bag = directory.write("drive.mcap", bag_of(drive));
  const fs::path run = directory / "a";
  CHECK_THAT(run_well({"onboard", bag, "--out", run, "--sensor", "vlp-16"}).err,
             Contains("known positions: /fix (sensor_msgs/NavSatFix, 40 messages): 40 taken") &&
                 Contains("a/positions.csv"));
  const fs::path map = directory / "map";
  CHECK_THAT(run_well({"merge", run, "--out", map, "--crs", kSystem}).err,
             Contains("m off the others") && Contains("3 of 4 known positions used"));
  const nlohmann::json placed = read_json(map / "georeference.json");
  CHECK(placed["positions_known"] == 4);
  CHECK(placed["positions_used"] == 3);
  const auto o = placed["origin"].get<std::vector<double>>();
  const auto rows = read_rows(map / "trajectories/a.tum");
  REQUIRE(rows.size() > 30);
  double worst_m = 0.0;
  for (const auto& row : rows) {
    const auto stamp_ns = static_cast<std::int64_t>(std::llround(row[0] * 1e9));
    const auto scan = std::min_element(drive.stamps_ns.begin(), drive.stamps_ns.end(),
                                       [&](std::int64_t a, std::int64_t b) {
                                         return std::abs(a - stamp_ns) < std::abs(b - stamp_ns);
                                       });
    const Pose& pose = drive.poses[static_cast<std::size_t>(scan - drive.stamps_ns.begin())];
    const Eigen::Vector3d at(row[1] + o[0], row[2] + o[1], row[3] + o[2]);
    worst_m = std::max(worst_m, (at - (kT_site_odometry * pose).translation).norm());
  }
  CHECK(worst_m < 0.1);
}
