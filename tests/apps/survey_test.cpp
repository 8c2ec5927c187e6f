// Tests of `unimapper map survey`: the point cloud of a static map as a session of a project.
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "src/apps/survey/survey_cloud.hpp"
#include "src/apps/survey/survey_keyframes.hpp"
#include "src/apps/survey/viewpoints.hpp"
#include "src/apps/survey/visible_points.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

using Points = std::vector<Eigen::Vector3f>;

void add_box(Points& points, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  constexpr float kStepM = 0.2F;
  for (float x = low.x(); x <= high.x(); x += kStepM) {
    for (float y = low.y(); y <= high.y(); y += kStepM) {
      for (float z = low.z(); z <= high.z(); z += kStepM) points.emplace_back(x, y, z);
    }
  }
}

/// A street of 60 m by 20 m between walls, with a kiosk in the middle of it.
Points street() {
  Points points;
  add_box(points, {0, -10, 0}, {60, 10, 0});
  for (const float y : {-10.0F, 10.0F}) add_box(points, {0, y, 0}, {60, y, 6});
  add_box(points, {28, -2, 0}, {32, 2, 3});
  return points;
}

/// A header, and the points behind it.
std::string file_of(const std::string& header, const Points& points) {
  static_assert(sizeof(Eigen::Vector3f) == 12);
  return header + std::string(reinterpret_cast<const char*>(points.data()), 12 * points.size());
}

std::string ply(const Points& points) {
  return file_of("ply\nformat binary_little_endian 1.0\nelement vertex " +
                     std::to_string(points.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                 points);
}

std::string pcd(const Points& points) {
  const std::string count = std::to_string(points.size());
  return file_of("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + count +
                     "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n",
                 points);
}

bool is_visible(const Points& seen, const Eigen::Vector3f& viewpoint, const Eigen::Vector3f& at) {
  return std::any_of(seen.begin(), seen.end(), [&](const Eigen::Vector3f& point) {
    return (viewpoint + point - at).norm() < 0.3F;
  });
}

/// A project with the file of a street beside it.
struct Street : Project {
  std::string file = directory.write("street.ply", ply(street()));
};

/// The poses of a trajectory: "stamp x y z qx qy qz qw".
std::vector<Pose> tum_poses(const fs::path& file) {
  std::vector<Pose> poses;
  for (const std::vector<double>& row : read_rows(file)) {
    poses.emplace_back(Eigen::Quaterniond(row.at(7), row[4], row[5], row[6]),
                       Eigen::Vector3d(row[1], row[2], row[3]));
  }
  return poses;
}

/// True poses of a simulated recording, one for each scan.
std::vector<Pose> true_poses(const fs::path& recording) {
  std::vector<Pose> poses;
  for (const std::vector<double>& row : read_rows(recording / "gt_poses.txt")) {
    REQUIRE(row.size() == 12);
    const Eigen::Matrix<double, 3, 4> rows =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(row.data());
    poses.emplace_back(Eigen::Quaterniond(Eigen::Matrix3d(rows.leftCols<3>())), rows.col(3));
  }
  return poses;
}

/// A drive through a simulated town: the recording NAME-data and its run NAME.
struct TownDrive {
  fs::path recording;
  fs::path run;

  TownDrive(const TemporaryDirectory& directory, const std::string& name, const std::string& seed,
            const std::string& day, const std::string& drift)
      : recording(directory / (name + "-data")), run(directory / name) {
    (void)run_well({"simulate", "--scene", "town", "--sensor", "vlp-16", "--columns", "512",
                    "--route", "A", "--scans", "150", "--seed", seed, "--day", day, "--drift",
                    drift, "--out", recording});
    (void)run_well({"onboard", recording, "--out", run});
  }
};

}  // namespace

TEST_CASE("a survey is read from PLY and PCD, and what is none is refused in words", "[survey]") {
  const SurveyCloud cloud = parse_survey(ply(street()), "s.ply");
  CHECK(cloud.points.size() > 30000);
  CHECK(cloud.not_finite == 0);
  CHECK(parse_survey(pcd(street()), "s.pcd").points == cloud.points);
  // Its identity is its content.
  CHECK(parse_survey(ply(street()), "other.ply").id == cloud.id);
  Points points = street();
  points[0].z() += 0.001F;
  CHECK(parse_survey(ply(points), "s.ply").id != cloud.id);
  points[7].x() = std::numeric_limits<float>::quiet_NaN();
  points[8].y() = std::numeric_limits<float>::infinity();
  CHECK(parse_survey(ply(points), "s.ply").not_finite == 2);

  Points small = points;
  for (Eigen::Vector3f& point : small) point *= 0.01F;
  Points large = small;
  for (Eigen::Vector3f& point : large) point *= 1e5F;
  const struct {
    std::string bytes;
    const char* file;
    const char* why;
  } refused[] = {{"", "s.ply", "s.ply:"},
                 {ply(street()), "s.las", "s.las: a survey is a PLY or PCD file"},
                 {ply({{1, 2, 3}}), "s.ply", "has 1 finite points, a survey 1000 at least"},
                 {ply(small), "s.ply", "extends over 0.6 m"},
                 {ply(large), "s.ply", "which single precision does not hold"}};
  for (const auto& [bytes, file, why] : refused) {
    CHECK_THROWS_WITH(parse_survey(bytes, file), Contains(why));
  }
}

TEST_CASE("a survey that is cut off or forged anywhere is refused, and nothing else", "[survey]") {
  const Points all = street();
  for (const bool is_ply : {true, false}) {
    const char* file = is_ply ? "s.ply" : "s.pcd";
    const std::string whole =
        is_ply ? ply({all.begin(), all.begin() + 1500}) : pcd({all.begin(), all.begin() + 1500});
    for (std::size_t size = 0; size < whole.size(); size += size < 300 ? 1 : 997) {
      CHECK_THROWS_AS(parse_survey(whole.substr(0, size), file), std::runtime_error);
    }
    // Whatever a byte of the header becomes, there is a cloud or an error in words.
    for (std::size_t at = 0; at < 130; ++at) {
      for (const char byte : {'\0', '9', '-', ' ', '\n', '\xFF'}) {
        std::string forged = whole;
        forged[at] = byte;
        try {
          (void)parse_survey(forged, file);
        } catch (const std::runtime_error& error) {
          CHECK(std::strlen(error.what()) > 0);
        }
      }
    }
  }
}

TEST_CASE("viewpoints stand on free ground, one in a square, and never in a wall", "[survey]") {
  const auto places = viewpoints(street(), {5.0, 1.8});
  CHECK(places.size() >= 30);
  CHECK(places.size() <= 60);
  for (const Eigen::Vector3f& place : places) {
    CHECK(place.z() == Approx(1.8).margin(0.05));
    CHECK(std::abs(place.y()) < 9.5F);
    const bool is_in_kiosk = place.x() > 28 && place.x() < 32 && std::abs(place.y()) < 2;
    CHECK_FALSE(is_in_kiosk);
  }
  // A path: places are hardly farther from the one before than squares are from each other.
  float length = 0.0F;
  for (std::size_t i = 1; i < places.size(); ++i) length += (places[i] - places[i - 1]).norm();
  CHECK(length < 8.0F * static_cast<float>(places.size()));
  Points wall;
  add_box(wall, {0, 0, 0}, {60, 0, 6});
  CHECK(viewpoints(wall, {5.0, 1.8}).empty());
  wall.emplace_back(15000, 15000, 0);
  CHECK_THROWS_WITH(viewpoints(wall, {5.0, 1.8}), Contains("cut it into parts"));
}

TEST_CASE("what a surface hides is not seen, and the ground before it is", "[survey]") {
  const PointTiles cloud(street());
  const Eigen::Vector3f viewpoint(20, 0, 1.8F);
  const Points seen = visible_points(cloud, viewpoint, 60.0F);
  CHECK(is_visible(seen, viewpoint, {25, 0, 0}));
  CHECK(is_visible(seen, viewpoint, {28, 0, 2}));
  CHECK(is_visible(seen, viewpoint, {40, 10, 4}));
  CHECK_FALSE(is_visible(seen, viewpoint, {40, 0, 0}));
  CHECK_FALSE(is_visible(visible_points(cloud, viewpoint, 15.0F), viewpoint, {40, 10, 4}));
}

TEST_CASE("keyframes of a survey are the same each time, static and without images", "[survey]") {
  const PointTiles cloud(street());
  const auto places = viewpoints(street(), {15.0, 1.8});
  const auto make = [&] {
    std::vector<wire::ReceivedKeyframe> keyframes;
    make_survey_keyframes(cloud, {1, 2}, places, 40.0F, [&](wire::ReceivedKeyframe&& keyframe) {
      keyframes.push_back(std::move(keyframe));
    });
    return keyframes;
  };
  const auto keyframes = make();
  REQUIRE(keyframes.size() == places.size());
  const auto again = make();
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const KeyframeRecord& record = keyframes[i].record;
    CHECK(record.sequence == i);
    CHECK((record.T_odometry_keyframe.translation - places[i].cast<double>()).norm() < 1e-6);
    CHECK(record.up.known);
    CHECK(record.static_cells.size() > 1000);
    CHECK(record.dynamic_cells.empty());
    CHECK(record.points_dynamic == 0);
    CHECK(record.images.empty());
    CHECK(keyframes[i].bytes == again[i].bytes);
  }
  // Parts of a survey that are far from each other are no jump.
  Points two = street();
  for (Eigen::Vector3f point : street()) two.emplace_back(point + Eigen::Vector3f(3000, 0, 0));
  const auto far_places = viewpoints(two, {30.0, 1.8});
  std::size_t made = 0;
  make_survey_keyframes(PointTiles(two), {1, 2}, far_places, 40.0F,
                        [&](wire::ReceivedKeyframe&&) { ++made; });
  CHECK(made == far_places.size());
}

TEST_CASE("a survey is a session that is fixed, and the same file is one session",
          "[survey][slow]") {
  const Street project;
  CHECK_THAT(project.done({"survey", project.file}).out,
             Contains("epoch 1: added the survey street ("));
  CHECK_THAT(project.done({"survey", project.file}).out, Contains("nothing changed"));
  project.refused({"survey", project.file, "--spacing", "5"}, "is in the store with other content");
  const nlohmann::json said = project.statements();
  REQUIRE(said.size() == 2);
  CHECK(said[0]["kind"] == "reference");
  CHECK(said[1]["kind"] == "position");
  project.done({"merge"});
  const fs::path out = project.exported("map");
  const auto placed = read_json(out / "georeference.json");
  CHECK(placed["origin"] == nlohmann::json({0.0, 0.0, 0.0}));
  CHECK(placed["positions_used"] == placed["positions_known"]);
  for (const nlohmann::json& position : placed["positions"]) {
    for (const nlohmann::json& axis : position["residual_m"]) {
      CHECK(std::abs(axis.get<double>()) < 0.02);
    }
  }
  // Taken out and in again it says the same.
  project.done({"remove", "street"});
  project.done({"survey", project.file});
  CHECK(project.statements().size() == 2);
  project.done({"remove", "--purge", "street"});
  CHECK(project.statements().empty());
  project.done({"survey", project.file, "--unplaced", "--name", "yard"});
  CHECK(project.statements().size() == 1);
  CHECK(project.show()["sessions"][0]["name"] == "yard");

  project.refused({"survey", project.directory / "none.ply"}, "none.ply");
  Points wall;
  add_box(wall, {0, 0, 0}, {60, 0, 6});
  project.refused({"survey", project.directory.write("wall.ply", ply(wall))},
                  "has no ground on which a sensor could stand");
}

TEST_CASE("a survey does not take the reference from the session that has it", "[survey]") {
  const Street project;
  project.done({"add", project.run("a", 12)});
  project.done({"pin", "a"});
  project.done({"survey", project.file});
  const nlohmann::json said = project.statements();
  REQUIRE(said.size() == 2);
  CHECK(said[0]["kind"] == "reference");
  CHECK(said[0]["session"] == "a");
}

TEST_CASE("a drive of another day is placed in the survey of a town, and one elsewhere is not",
          "[survey][slow]") {
  const Street project;
  // The survey is the map of a drive without drift, and nothing but its points.
  const TownDrive surveyed(project.directory, "surveyed", "11", "0", "none");
  const fs::path survey = project.directory / "survey";
  (void)run_well({"merge", surveyed.run, "--out", survey});
  project.done({"survey", survey / "map.ply", "--name", "survey"});
  const TownDrive drive(project.directory, "drive", "11", "1", "lio");
  const TownDrive elsewhere(project.directory, "elsewhere", "111", "1", "lio");
  project.done({"add", drive.run, elsewhere.run});
  project.done({"merge"});
  const fs::path out = project.exported("map");

  const auto sessions = read_json(out / "summary.json")["sessions"];
  REQUIRE(sessions.size() == 3);
  for (const nlohmann::json& session : sessions) {
    INFO(session.dump());
    const bool is_elsewhere = session["name"] == "elsewhere";
    CHECK((session["status"] == "unconnected" || session["status"] == "provisional") ==
          is_elsewhere);
  }
  const std::vector<Pose> of_survey = tum_poses(survey / "trajectories/surveyed.tum");
  const std::vector<Pose> placed = tum_poses(out / "trajectories/drive.tum");
  const std::vector<Pose> survey_truth = true_poses(surveyed.recording);
  const std::vector<Pose> truth = true_poses(drive.recording);
  REQUIRE(placed.size() == truth.size());
  const Pose T_map_world = of_survey.front() * survey_truth.front().inverse();
  for (std::size_t k = 0; k < placed.size(); k += 10) {
    CHECK(((T_map_world * truth[k]).translation - placed[k].translation).norm() < 0.5);
  }
}
