// Tests of `unimapper map position`, `positions` and of what exports say of them.
#include <cmath>
#include <cstdio>

#include "src/apps/map/position_file.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// A project of one session, "a".
struct OneSession : Project {
  OneSession() { done({"add", run("a", 34)}); }
  [[nodiscard]] std::string file(const std::string& text) const {
    return directory.write("positions.csv", text);
  }
};

std::vector<PositionRow> parsed(const std::string& text) {
  return parse_positions(text, "f.csv", std::nullopt);
}

constexpr const char* kNames = "keyframe,x,y,z,sigma_xy,sigma_z\n";

}  // namespace

TEST_CASE("a file of positions has named columns and strict lines", "[map_positions]") {
  const auto rows = parsed("# by a person\r\n\nkeyframe, x,y,z,sigma_xy,sigma_z\n7,1,2,3,0.5,1\n");
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].line == 4);
  CHECK(rows[0].sequence == 7U);
  CHECK(rows[0].position == Eigen::Vector3d(1, 2, 3));
  CHECK(rows[0].sigma_xy_m == 0.5);
  CHECK(rows[0].sigma_z_m == 1.0);
  const auto heights = parsed("stamp,z,sigma_z\n1700000000.123456789,4.5,0.1");
  REQUIRE(heights.size() == 1);
  CHECK(heights[0].stamp_ns == 1700000000123456789);
  CHECK_FALSE(heights[0].sigma_xy_m);
  CHECK(heights[0].position == Eigen::Vector3d(0, 0, 4.5));

  const std::string names = kNames;
  const std::string one = names + "7,1,2,3,1,1\n";
  const struct {
    std::string text, why;
  } refused[] = {
      {"", "f.csv: holds no position"},
      {names, "f.csv: holds no position"},
      {"7,1,2,3,1,1\n", "f.csv:1: the first line names the columns"},
      {names + "7,1,2,3,1\n", "f.csv:2: has 5 columns, not 6"},
      {names + "7,1,2,3,1,1,\n", "f.csv:2: has 7 columns, not 6"},
      {names + "7,1,2,nan,1,1\n", "f.csv:2: 'nan' is out of range"},
      {names + "7,1,2,3x,1,1\n", "f.csv:2: '3x' is no number"},
      {names + "7,1,,3,1,1\n", "is no number"},
      {names + "7,1,2,3,0,1\n", "f.csv:2: '0' is out of range"},
      {names + "7,1,2,3,inf,1\n", "is out of range"},
      {names + "-7,1,2,3,1,1\n", "f.csv:2: '-7' is no number of a keyframe"},
      {one + "8,1,2,3,1,1\n7,1,2,3,1,1\n", "f.csv:4: keyframe 7 is in line 2, too"},
      {"stamp,z,sigma_z\n1.0000000001,4,1\n", "is no stamp"},
      {"stamp,z,sigma_z\n1.5e3,4,1\n", "is no stamp"},
      {"stamp,latitude,longitude,height,sigma_xy,sigma_z\n1,48,11,500,1,1\n",
       "need a coordinate system"},
  };
  for (const auto& [text, why] : refused) CHECK_THROWS_WITH(parsed(text), Contains(why));
  CHECK_THROWS_WITH(parse_positions(one, "f.csv", Datum{}), Contains("--datum has no meaning"));
}

TEST_CASE("latitude and longitude become east, north and up of the datum", "[map_positions]") {
  const Datum datum{48.0, 11.0, 500.0};
  CHECK(east_north_up(datum, datum).norm() == 0.0);
  // A degree of the meridian is 111.2 km here: the radius of curvature of WGS84 times one degree.
  const double sine = std::sin(48.0 / 57.29577951308232);
  constexpr double kE2 = 0.0066943799901413165;
  const double w = std::sqrt(1.0 - kE2 * sine * sine);
  const double meridian_m = 6378137.0 * (1.0 - kE2) / (w * w * w);
  const double step = 1e-4;
  const Eigen::Vector3d north = east_north_up({48.0 + step, 11.0, 500.0}, datum);
  CHECK(north.y() == Approx((meridian_m + 500.0) * step / 57.29577951308232).epsilon(1e-6));
  CHECK(std::abs(north.x()) < 1e-6);
  const Eigen::Vector3d up = east_north_up({48.0, 11.0, 512.5}, datum);
  CHECK((up - Eigen::Vector3d(0, 0, 12.5)).norm() < 1e-6);
  const Eigen::Vector3d east = east_north_up({48.0, 11.0 + step, 500.0}, datum);
  CHECK(east.x() == Approx((6378137.0 / w + 500.0) * std::cos(48.0 / 57.29577951308232) * step /
                           57.29577951308232)
                        .epsilon(1e-6));
}

TEST_CASE("positions are kept, numbered, replaced, withdrawn and undone", "[map_positions]") {
  const OneSession project;
  project.done({"position", "a:1", "--at", "700001", "5300002", "503", "--sigma", "0.5", "2"});
  project.done({"position", "a:0", "--height", "502", "--sigma", "0.3"});
  const auto two = project.file(std::string(kNames) + "0,700000,5300000,502,1,1\n2,1,2,3,1,1\n");
  CHECK_THAT(project.done({"positions", "a", "--file", two}).out, Contains("2 positions of a"));
  nlohmann::json said = project.statements();
  REQUIRE(said.size() == 3);
  CHECK(said[0]["kind"] == "position");
  CHECK(said[0]["session"] == "a");
  CHECK(said[0]["positions"][0]["keyframe"] == 1);
  CHECK(said[0]["positions"][0]["position"][1] == 5300002.0);
  CHECK(said[0]["positions"][0]["sigma_z"] == 2.0);
  CHECK(said[1]["positions"][0]["height"] == 502.0);
  CHECK(said[2]["positions"].size() == 2);
  // Of the same keyframe, and of a file for the same session, the later one counts.
  project.done({"position", "a:1", "--at", "700001", "5300002", "504", "--sigma", "0.5"});
  project.done({"positions", "a", "--file", two});
  said = project.statements();
  REQUIRE(said.size() == 3);
  project.done({"withdraw", std::to_string(said[2]["statement"].get<int>())});
  CHECK(project.statements().size() == 2);
  project.done({"undo"});
  CHECK(project.statements().size() == 3);
  CHECK_THAT(project.done({"show"}).out, Contains("position a of 2 keyframes"));

  const struct {
    const char* keyframe;
    Words given;
    const char* why;
    int exit_code;
  } wrong[] = {
      {"a:99", {"--at", "1", "2", "3", "--sigma", "1"}, "there is no keyframe a:99", 1},
      {"b:1", {"--at", "1", "2", "3", "--sigma", "1"}, "there is no session \"b\"", 1},
      {"a:1", {"--at", "1", "2", "nan", "--sigma", "1"}, "out of range", 1},
      {"a:1", {"--at", "1", "2", "3", "--sigma", "-1"}, "--sigma", 1},
      {"a:1", {"--height", "3", "--sigma", "1", "2"}, "a height has one standard deviation", 1},
      {"a:1", {"--sigma", "1"}, "--at", 2},
  };
  for (const auto& [keyframe, given, why, exit_code] : wrong) {
    Words arguments = {"position", keyframe};
    arguments.insert(arguments.end(), given.begin(), given.end());
    project.refused(arguments, why, exit_code);
  }
  project.refused({"positions", "a", "--file", project.file("stamp,z,sigma_z\n1000000,2,1\n")},
                  "positions.csv: no position lies within session a, which lasts from ");
  project.refused(
      {"positions", "a", "--file", project.file(std::string(kNames) + "99,1,2,3,1,1\n")},
      "positions.csv:2: there is no keyframe a:99");
  project.refused({"positions", "a", "--file", project.directory / "none"}, "none");
}

TEST_CASE("an export lies in the frame of the positions", "[map_positions]") {
  const OneSession project;
  project.done({"merge"});
  const nlohmann::json before = read_json(project.exported("before") / "summary.json");
  CHECK_FALSE(before.contains("georeference"));
  CHECK_FALSE(fs::exists(project.directory / "before/georeference.json"));

  project.done({"position", "a:1", "--at", "700001.25", "5300002.5", "503", "--sigma", "0.5"});
  CHECK_THAT(project.done({"merge"}).out,
             Contains("and 1 of 1 known positions (which leave the heading unknown)"));
  const nlohmann::json placed = read_json(project.exported("placed") / "georeference.json");
  CHECK(placed["origin"] == nlohmann::json({700000.0, 5300000.0, 0.0}));
  CHECK(placed["horizontal"] == true);
  CHECK(placed["heading_sigma_rad"].is_null());
  CHECK(placed["positions"][0]["keyframe"] == "a:1");
  CHECK(placed["positions"][0]["used"] == true);
  const auto residual = placed["positions"][0]["residual_m"].get<std::vector<double>>();
  for (const double axis : residual) CHECK(std::abs(axis) < 0.01);
  // The vertex of that keyframe is where it was said to be, from the origin.
  const std::string graph = read_text(project.directory / "placed/graph.g2o");
  const std::size_t at = graph.find("VERTEX_SE3:QUAT 1 ");
  REQUIRE(at != std::string::npos);
  Eigen::Vector3d p;
  REQUIRE(std::sscanf(graph.c_str() + at, "VERTEX_SE3:QUAT 1 %lf %lf %lf", &p.x(), &p.y(),
                      &p.z()) == 3);
  CHECK((p - Eigen::Vector3d(1.25, 2.5, 503.0)).cwiseAbs().maxCoeff() < 0.01);

  // A wrong one is said, and not used.
  project.done({"position", "a:0", "--at", "701001", "5300002", "503", "--sigma", "0.5"});
  project.done({"position", "a:2", "--height", "503", "--sigma", "0.5"});
  const CommandResult merged = project.done({"merge"});
  CHECK_THAT(merged.err, Contains("warning: position of a:0 not used: contradicts another one"));
  CHECK_THAT(project.done({"show"}).out, Contains("positions  3 known, 1 used"));
  const nlohmann::json height = read_json(project.exported("height") / "georeference.json");
  CHECK(height["horizontal"] == false);
  CHECK(height["origin"] == nlohmann::json({0.0, 0.0, 0.0}));
  // Without statements the map is what it was.
  for (const nlohmann::json& statement : project.statements()) {
    project.done({"withdraw", std::to_string(statement["statement"].get<int>())});
  }
  project.done({"merge"});
  CHECK(read_json(project.exported("after") / "summary.json") == before);
  const bool is_same = read_text(project.directory / "after/map.ply") ==
                       read_text(project.directory / "before/map.ply");
  CHECK(is_same);
}
