// Tests of the reader and writer of loops.csv.
#include "unimapper/merge/loops_csv.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

using namespace unimapper;

namespace {

/// The records after they went through a file.
std::vector<LoopRecord> read_back(const std::vector<LoopRecord>& loops) {
  std::string file = (std::filesystem::temp_directory_path() / "unimapper-loops-XXXXXX").string();
  const int descriptor = mkstemp(file.data());
  if (descriptor < 0) throw std::runtime_error("no temporary file");
  close(descriptor);
  std::ofstream(file) << merge::format_loops_csv(loops);
  std::vector<LoopRecord> read = merge::read_loops_csv(file);
  std::filesystem::remove(file);
  return read;
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
  const std::vector<LoopRecord> read = read_back(loops);
  REQUIRE(read.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(read[i].query_session == loops[i].query_session);
    CHECK(read[i].query_keyframe == loops[i].query_keyframe);
    CHECK(read[i].query_scan == loops[i].query_scan);
    CHECK(read[i].match_session == loops[i].match_session);
    CHECK(read[i].match_keyframe == loops[i].match_keyframe);
    CHECK(read[i].match_scan == loops[i].match_scan);
    CHECK(read[i].confidence == loops[i].confidence);
    CHECK(read[i].accepted == loops[i].accepted);
    CHECK(read[i].reason == loops[i].reason);
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
