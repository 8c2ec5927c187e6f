// Range limit of removal
#include "src/onboard/range_limit.hpp"

#include <catch2/catch.hpp>

#include "stages.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("of the candidates the nearest are kept, in whole rings, as many as there is time for") {
  // Two cells in every ring of one metre, from the second ring on.
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 80; ++i) {
    points.emplace_back(0.5F * static_cast<float>(i) + 1.05F, 0.1F, 0.1F);
  }
  for (const std::uint32_t limit : {80U, 31U, 30U}) {
    Stages stages;
    stages.add(points);
    stages.build_cells();
    REQUIRE(stages.cells.size() == 80);
    for (std::uint32_t row = 0; row < 80; ++row) stages.cells.set(row, &CellMarks::candidate);
    const RangeLimit result = keep_nearest(stages.cells, Eigen::Vector3f::Zero(), 64.0F, limit);
    const std::uint32_t kept = limit == 80 ? 80 : 30;
    CHECK(result.kept == kept);
    CHECK(result.shed == 80 - kept);
    CHECK(result.range_m == (limit == 80 ? 0.0F : 16.0F));
    for (std::uint32_t row = 0; row < 80; ++row) {
      const bool near = stages.cells.position(row).norm() < 16.0F;
      CHECK(stages.cells.has(row, &CellMarks::candidate) == (limit == 80 || near));
    }
  }
}
