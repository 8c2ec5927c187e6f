// Pose graph of a merged map as a g2o file.
#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "src/merge/export_files.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// Sessions with so many keyframes each, and a result with their statuses and no edges.
struct Map {
  std::vector<SessionData> sessions;
  MergeResult result;
  void add(std::size_t keyframes, SessionStatus status) {
    sessions.emplace_back().keyframes.resize(keyframes);
    MergedSession& merged = result.sessions.emplace_back();
    merged.status = status;
    merged.T_map_keyframe.resize(keyframes);
  }
};

/// The lines of the file that start with `tag`, without it, as numbers.
std::vector<std::vector<double>> lines_of(const Map& map, const std::string& tag) {
  const TemporaryDirectory directory;
  write_pose_graph(directory / "graph.g2o", map.sessions, map.result);
  std::ifstream file(directory / "graph.g2o");
  std::vector<std::vector<double>> found;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first != tag) continue;
    found.emplace_back();
    for (double number = 0.0; words >> number;) found.back().push_back(number);
  }
  return found;
}

/// x becomes y, y becomes z and z becomes x: a third of a turn about (1, 1, 1).
Pose cyclic() { return {Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), Eigen::Vector3d(4.0, 5.0, 6.0)}; }

}  // namespace

TEST_CASE("An edge's information is written for errors in the frame of its second vertex",
          "[export]") {
  Map map;
  map.add(2, SessionStatus::kCentral);
  map.add(3, SessionStatus::kMerged);
  LoopConstraint edge;
  edge.match = {0, 1};
  edge.query = {1, 2};
  edge.T_match_query = cyclic();
  edge.information.setZero();
  edge.information.diagonal() << 1, 2, 3, 40, 50, 60;
  edge.information(0, 3) = edge.information(3, 0) = 0.5;
  map.result.graph_edges.push_back(edge);
  const auto edges = lines_of(map, "EDGE_SE3:QUAT");
  REQUIRE(edges.size() == 1);
  // The query's axes x, y, z are y, z, x of the match; rotations are in the query's frame already.
  const std::vector<std::vector<double>> parts{{1, 4},                         // vertices
                                               {4, 5, 6, 0.5, 0.5, 0.5, 0.5},  // pose
                                               {2, 0, 0, 0, 0, 0},
                                               {3, 0, 0, 0, 0},  // upper triangle, row by row
                                               {1, 0.5, 0, 0},
                                               {40, 0, 0},
                                               {50, 0},
                                               {60}};
  std::vector<double> expected;
  for (const auto& part : parts) expected.insert(expected.end(), part.begin(), part.end());
  REQUIRE(edges[0].size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    INFO("number " << i);
    CHECK(edges[0][i] == Approx(expected[i]).margin(1e-9));
  }
}

TEST_CASE("Vertices are numbered session by session, and one of each piece is fixed", "[export]") {
  Map map;
  map.add(2, SessionStatus::kMerged);
  map.add(0, SessionStatus::kUnconnected);
  map.add(3, SessionStatus::kCentral);
  map.add(1, SessionStatus::kUnconnected);
  map.result.sessions[2].T_map_keyframe[1] = cyclic();
  const auto vertices = lines_of(map, "VERTEX_SE3:QUAT");
  REQUIRE(vertices.size() == 6);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    REQUIRE(vertices[i].size() == 8);
    CHECK(vertices[i][0] == static_cast<double>(i));
  }
  CHECK(vertices[3] == std::vector<double>{3, 4, 5, 6, 0.5, 0.5, 0.5, 0.5});
  CHECK(vertices[4] == std::vector<double>{4, 0, 0, 0, 0, 0, 0, 1});
  CHECK(lines_of(map, "FIX") == std::vector<std::vector<double>>{{2}, {5}});
}
