// Tests of coordinate systems and of what is written of them.
#include "src/apps/map/projection.hpp"

#include <cstdlib>

#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

constexpr Datum kPlace{48.1, 11.5, 520.0};

double distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (a - b).norm(); }

/// Reference scans of the keyframes of a run's only session.
std::vector<KeyframeScan> reference_scans(const Project& project) {
  store::StoreReader reader(project.store);
  std::vector<KeyframeScan> scans;
  for (const KeyframeRecord& keyframe : reader.read(reader.sessions().front()).keyframes) {
    scans.push_back(keyframe.scans[keyframe.reference_scan]);
  }
  return scans;
}

/// Places on WGS84 of keyframes of a drive that begins at `kPlace` and heads east.
std::string positions_of(const std::vector<KeyframeScan>& scans, const std::string& names) {
  std::string text = names;
  for (const KeyframeScan& scan : scans) {
    const Eigen::Vector3d& at = scan.T_odometry_sensor.translation;
    constexpr double kEastPerDegree_m = 74471.0;
    constexpr double kNorthPerDegree_m = 111202.0;
    char line[160];
    std::snprintf(line, sizeof line, "%.9f,%.9f,%.9f,%.3f,0.5,1\n",
                  1e-9 * static_cast<double>(scan.stamp_ns),
                  kPlace.latitude_deg + at.y() / kNorthPerDegree_m,
                  kPlace.longitude_deg + at.x() / kEastPerDegree_m, kPlace.height_m + at.z());
    text += line;
  }
  return text;
}

constexpr const char* kDegrees = "stamp,latitude,longitude,height,sigma_xy,sigma_z\n";

void check_placed(const fs::path& map) {
  const std::string las = read_text(map / "map.las");
  CHECK(las[6] == 16);  // the coordinate system is WKT
  CHECK_THAT(las.substr(375, 54 + 60), Contains("LASF_Projection"));
  CHECK_THAT(las.substr(375 + 54, 60), Contains("PROJCS[\"ETRS89 / UTM zone 32N\""));
  const nlohmann::json placed = read_json(map / "georeference.json");
  CHECK(placed["crs"] == "EPSG:25832");
  CHECK(placed["origin"] == nlohmann::json({686000.0, 5330000.0, 0.0}));
  CHECK(placed["positions_used"] == placed["positions_known"]);
  CHECK(read_json(map / "summary.json")["georeference"]["crs"] == "EPSG:25832");
}

}  // namespace

TEST_CASE("a place on WGS84 has east, north and height in a system", "[projection]") {
  // As PROJ's cs2cs prints them.
  CHECK(distance_m(Projection("EPSG:25832").project(kPlace), {686121.756, 5330438.130, 520.0}) <
        0.002);
  CHECK(distance_m(Projection("ETRS89 / UTM zone 32N").project(kPlace),
                   {686121.756, 5330438.130, 520.0}) < 0.002);
  const Projection geoid("EPSG:32632+5773");
  CHECK(distance_m(geoid.project(kPlace), {686121.756, 5330438.130, 474.427}) < 0.01);
  CHECK_THAT(geoid.system().wkt, Contains("VERT_CS[\"EGM96 height\""));
  const Projection local("+proj=tmerc +lat_0=48.1 +lon_0=11.5 +datum=WGS84");
  CHECK(distance_m(local.project(kPlace), {0, 0, 520}) < 1e-6);
  // This one names north first; files have east first.
  CHECK(Projection("EPSG:31468").project(kPlace).x() == Approx(4462866.685).margin(0.01));
  CHECK_THAT(Projection("EPSG:31468").system().wkt, !Contains("AXIS"));
  CHECK_THROWS_WITH(Projection("EPSG:25832+7837").project(kPlace), Contains("grid of its geoid"));
}

TEST_CASE("what is no system of east and north in metres is refused with a remedy",
          "[projection]") {
  const std::pair<const char*, const char*> refused[] = {
      {"EPSG:4326", "is no projected system"},
      {"EPSG:4978", "is no projected system"},
      {"EPSG:99999", "PROJ does not know it"},
      {"foo", "PROJ does not know it"},
      {"", "PROJ does not know it"},
      {"EPSG:2263", "its unit is the US survey foot"},
      {"EPSG:2048", "an axis of it points west"}};
  for (const auto& [name, why] : refused) {
    CHECK_THROWS_WITH(Projection(name), Contains(why) && Contains("EPSG:25832 (UTM zone 32"));
  }
}

TEST_CASE("without PROJ's database a coordinate system is refused with the remedy",
          "[projection]") {
  const TemporaryDirectory empty;
  REQUIRE(setenv("PROJ_DATA", empty.path().c_str(), 1) == 0);
  CHECK_THROWS_WITH(Projection("EPSG:25832"), Contains("need PROJ's database: install proj-data"));
  unsetenv("PROJ_DATA");
  CHECK_NOTHROW(Projection("EPSG:25832"));
}

TEST_CASE("coordinates far from where a system is used are doubted", "[projection]") {
  const Projection utm("EPSG:25832");
  CHECK(utm.doubt({686121.0, 5330438.0, 0.0}).empty());
  CHECK_THAT(utm.doubt({12.0, 40.0, 0.0}), Contains("is not where the system is used"));
  CHECK_THAT(utm.doubt({5330438.0, 686121.0, 0.0}), Contains("are these coordinates of it?"));
  // Its area spans the 180th meridian: New Zealand and the Chatham Islands.
  CHECK(Projection("EPSG:3851").doubt({3000000.0, 7000000.0, 0.0}).empty());
  // A metre of Web Mercator is two thirds of one at this latitude.
  CHECK_THAT(Projection("EPSG:3857").doubt({1291000.0, 6130000.0, 0.0}),
             Contains("a metre of it is 0.67 m on the ground"));
}

TEST_CASE("a project remembers its coordinate system, and exports write it", "[projection]") {
  const Project project;
  project.done({"add", project.run("a", 34)});
  const std::vector<KeyframeScan> scans = reference_scans(project);
  const std::string file = project.directory.write("p.csv", positions_of(scans, kDegrees));
  project.refused({"crs", "EPSG:4326"}, "is no projected system");
  project.refused({"positions", "a", "--file", file}, "need a coordinate system");
  CHECK_THAT(project.done({"crs", "EPSG:25832"}).out, Contains("coordinate system EPSG:25832"));
  project.done({"merge"});
  // Without a position the map is no map of that system.
  project.refused({"export", "--out", project.directory / "none", "--crs", "EPSG:25832"},
                  "--crs: no known position of x and y places this map");

  project.refused({"positions", "a", "--file", file, "--datum", "48", "11", "0"},
                  "--datum: positions of the project are of EPSG:25832");
  project.done({"positions", "a", "--file", file});
  CHECK(project.show()["crs"] == "EPSG:25832");
  CHECK_THAT(project.done({"show"}).out, Contains("system     EPSG:25832"));
  project.done({"merge"});
  check_placed(project.exported("placed", {"--las"}));
  // Another system is said to be doubtful where its area is another.
  CHECK_THAT(
      project.done({"crs", "EPSG:2154"}).err,
      Contains("EPSG:2154: the position") && Contains("positions stay in metres of EPSG:25832"));
  CHECK(project.show()["crs"] == "EPSG:2154");
  project.done({"undo"});
  CHECK(project.show()["crs"] == "EPSG:25832");
}

TEST_CASE("keyframes that name a position in a run of several sessions are refused",
          "[projection]") {
  const Project project;
  const fs::path run = project.run("a", 12);
  const fs::path log = run / "keyframes.lcmlog";
  write_text(log, read_text(log) + read_text(fs::path(project.run("b", 12)) / "keyframes.lcmlog"));
  write_text(run / "positions.csv",
             "keyframe,latitude,longitude,height,sigma_xy,sigma_z\n1,48.1,11.5,520,0.5,1\n");
  check_fails(
      run_unimapper({"merge", run, "--crs", "EPSG:25832", "--allow-unconnected", "--out",
                     project.directory / "map"}),
      "positions.csv: the run has 2 sessions, each with such keyframes: name stamps instead", 1);
}

TEST_CASE("a merge is placed by the positions beside its runs", "[projection]") {
  const Project project;
  const fs::path run = project.run("a", 34);
  project.done({"add", run});
  const auto merge = [&](const std::string& out, const Words& more) {
    return run_unimapper({"merge", run, "--las", "--out", project.directory / out}, more);
  };
  check_fails(merge("none", {"--crs", "EPSG:25832"}), "no position is known that places the map",
              1);
  write_text(run / "positions.csv", positions_of(reference_scans(project), kDegrees));
  const CommandResult merged = merge("placed", {"--crs", "EPSG:25832"});
  CHECK(merged.exit_code == 0);
  CHECK_THAT(merged.err, Contains("known positions used"));
  check_placed(project.directory / "placed");
}
