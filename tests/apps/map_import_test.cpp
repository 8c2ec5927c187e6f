// Tests of `unimapper map import`: poses that another program has optimised.
#include <cmath>
#include <cstdio>
#include <sstream>

#include "src/apps/map/g2o_poses.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

std::vector<Pose> parsed(const std::string& text, std::size_t count = 2) {
  return parse_g2o_poses(text, "g.g2o", count);
}

const std::string kFirst = "VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\n";
const std::string kSecond = "VERTEX_SE3:QUAT 1 4 5 6 0 0 0.6 0.8\n";

std::string edge(const std::string& vertices) {
  std::string text = "EDGE_SE3:QUAT " + vertices + " 1 0 0 0 0 0 1";
  for (int i = 0; i < 21; ++i) text += " 1";
  return text + "\n";
}

/// Numbers of all vertices of a graph, in the order of lines.
std::vector<double> vertex_numbers(const std::string& graph) {
  std::vector<double> numbers;
  std::istringstream lines(graph);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    for (double number = 0; tag == "VERTEX_SE3:QUAT" && words >> number;) numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

TEST_CASE("vertices of a g2o file are read in any order", "[map_import]") {
  const auto poses = parsed("# comment\n" + kSecond + edge("0 1") + "\nFIX 0\r\n" + kFirst);
  REQUIRE(poses.size() == 2);
  CHECK(poses[0].translation == Eigen::Vector3d(1, 2, 3));
  CHECK(poses[1].translation == Eigen::Vector3d(4, 5, 6));
  CHECK(poses[1].quaternion().z() == Approx(0.6));
}

TEST_CASE("damaged g2o files are refused with the line", "[map_import]") {
  const std::string vertex = kFirst + "VERTEX_SE3:QUAT ";
  const struct {
    std::string text, why;
  } damaged[] = {
      {"", "g.g2o: has no vertex 0; the map has 2 keyframes"},
      {kFirst, "g.g2o: has no vertex 1"},
      {kFirst + kFirst, "g.g2o:2: vertex 0 is there twice"},
      {vertex + "2 4 5 6 0 0 0 1\n", "g.g2o:2: vertex 2 is of no keyframe"},
      {vertex + "-1 4 5 6 0 0 0 1\n", "'-1' is no number of a vertex"},
      {vertex + "1 4 5 6 0 0 0\n", "g.g2o:2: has 8 columns, not 9"},
      {vertex + "1 4 5 6 0 0 0 1 1\n", "has 10 columns, not 9"},
      {vertex + "1 4 nan 6 0 0 0 1\n", "'nan' is no finite number"},
      {vertex + "1 4 inf 6 0 0 0 1\n", "'inf' is no finite number"},
      {vertex + "1 4 5x 6 0 0 0 1\n", "'5x' is no finite number"},
      {vertex + "1 1e300 5 6 0 0 0 1\n", "the position is out of range"},
      {vertex + "1 4 5 6 0 0 0 0\n", "qx qy qz qw are no unit quaternion"},
      {kFirst + "VERTEX_SE2 1 4 5 6\n", "'VERTEX_SE2' is none of"},
      {kFirst + kSecond + edge("0 7"), "g.g2o:3: vertex 7 is of no keyframe"},
      {kFirst + kSecond + "EDGE_SE3:QUAT 0 1 1 2\n", "g.g2o:3: has 5 columns, not 31"},
      {kFirst + kSecond + "FIX\n", "g.g2o:3: has 1 columns, not 2"},
  };
  for (const auto& [text, why] : damaged) CHECK_THROWS_WITH(parsed(text), Contains(why));
  // Cut off anywhere, a file is refused or is whole without what is missing.
  const std::string whole = kFirst + kSecond;
  for (std::size_t size = 0; size + 5 < whole.size(); ++size) {
    CHECK_THROWS_AS(parsed(whole.substr(0, size)), std::runtime_error);
  }
}

TEST_CASE("imported poses are an epoch, exported as they were given, and undone", "[map_import]") {
  const Project project;
  const auto graph_of = [&](const std::string& name) {
    return read_text(project.exported(name) / "graph.g2o");
  };
  project.done({"add", project.run("a", 34), project.run("b", 24)});
  const std::string none = project.directory / "none.g2o";
  project.refused({"import", none}, "there is no map whose poses could be replaced");
  project.done({"merge"});
  const std::string first = graph_of("first");

  // Every vertex 10 m farther along x.
  std::string moved;
  std::istringstream lines(first);
  for (std::string line; std::getline(lines, line);) {
    int vertex = 0;
    double x = 0;
    int length = 0;
    if (std::sscanf(line.c_str(), "VERTEX_SE3:QUAT %d %lf%n", &vertex, &x, &length) == 2) {
      char text[64];
      std::snprintf(text, sizeof text, "VERTEX_SE3:QUAT %d %.9f", vertex, x + 10.0);
      line = text + line.substr(static_cast<std::size_t>(length));
    }
    moved += line + "\n";
  }
  const std::string file = project.directory.write("moved.g2o", moved);
  CHECK_THAT(project.done({"import", file}).out,
             Contains("which moves keyframes by up to 10.000 m"));
  const std::vector<double> wanted = vertex_numbers(moved);
  const std::vector<double> found = vertex_numbers(graph_of("second"));
  REQUIRE(found.size() == wanted.size());
  for (std::size_t i = 0; i < found.size(); ++i) CHECK(std::abs(found[i] - wanted[i]) < 3e-9);

  project.done({"undo"});
  CHECK((graph_of("third") == first));
  write_text(file, moved + "VERTEX_SE3:QUAT 99 0 0 0 0 0 0 1\n");
  project.refused({"import", file}, "vertex 99 is of no keyframe");
  project.refused({"import", none}, "none.g2o");
}
