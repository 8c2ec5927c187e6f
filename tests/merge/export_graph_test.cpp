// Pose graph and loops of a merged map as files
#include <numbers>

#include "src/merge/export/export_files.hpp"
#include "src/merge/export/loops_csv.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

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

namespace {

/// The records after they went through a file.
std::vector<LoopRecord> read_back(const std::vector<LoopRecord>& loops) {
  const TemporaryDirectory scratch;
  return merge::read_loops_csv(scratch.write("loops.csv", merge::format_loops_csv(loops)));
}

/// All but the pose.
auto fields(const LoopRecord& loop) {
  return std::tuple(loop.query_session, loop.query_keyframe, loop.query_scan, loop.match_session,
                    loop.match_keyframe, loop.match_scan, loop.confidence, loop.accepted,
                    loop.reason);
}

LoopRecord example() {
  LoopRecord loop;
  loop.query_session = "alpha, \"wet\"";
  loop.query_keyframe = 4000000000U;
  loop.query_scan = 17;
  loop.match_session = "beta";
  loop.match_keyframe = 3;
  loop.match_scan = 31;
  loop.confidence = 0.1 + 0.2;  // not the double nearest to 0.3
  loop.accepted = true;
  loop.reason = "radius";
  loop.T_match_query = {Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                        {1.0 / 3.0, -2e-9, 5e6}};
  return loop;
}

}  // namespace

TEST_CASE("Loops read back from their table with the same bits", "[loops_csv]") {
  LoopRecord refused = example();
  refused.accepted = false;
  refused.reason = "overlap 0.41 (limit 0.45), \"too little\"";
  const std::vector<LoopRecord> loops{example(), refused};
  CHECK_THAT(merge::format_loops_csv(loops),
             Catch::StartsWith("query_session,query_keyframe,query_scan,match_session,"
                               "match_keyframe,match_scan,confidence,accepted,reason,"
                               "x,y,z,qx,qy,qz,qw\n"));
  const std::vector<LoopRecord> read = read_back(loops);
  REQUIRE(read.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK((fields(read[i]) == fields(loops[i])));
    CHECK(read[i].T_match_query.translation == loops[i].T_match_query.translation);
    CHECK((read[i].T_match_query.rotation - loops[i].T_match_query.rotation).norm() < 1e-15);
  }
}

TEST_CASE("The quaternion of a loop is written with w >= 0", "[loops_csv]") {
  LoopRecord loop = example();
  const double angle = 1.1 * std::numbers::pi;
  loop.T_match_query.rotation =
      Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  REQUIRE(loop.T_match_query.quaternion().w() < 0.0);  // of the two, Eigen takes the other
  const std::string text = merge::format_loops_csv({&loop, 1});
  const double w = std::stod(text.substr(text.rfind(',') + 1));
  CHECK(w == Approx(std::abs(std::cos(0.5 * angle))));
  CHECK((read_back({loop})[0].T_match_query.rotation - loop.T_match_query.rotation).norm() < 1e-15);
}

TEST_CASE("A line break in a reason does not break the table", "[loops_csv]") {
  LoopRecord loop = example();
  loop.reason = "first\nsecond";
  CHECK(read_back({loop, example()}).front().reason == "first second");
}
