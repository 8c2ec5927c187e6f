// Relabelling of cells with the evidence of later keyframes
#include "src/free_space/relabelling.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

EvidenceSum cells(std::uint32_t count, std::int64_t log_odds) {
  EvidenceSum sum;
  sum.cells = count;
  sum.log_odds = log_odds;
  return sum;
}

}  // namespace

TEST_CASE("in a dynamic group only confirmed static cells stay static", "[relabelling]") {
  CHECK(is_dynamic_relabelled(ComponentClass::kDynamic, {false, false, false}));
  CHECK_FALSE(is_dynamic_relabelled(ComponentClass::kDynamic, {false, true, false}));
  CHECK(is_dynamic_relabelled(ComponentClass::kDynamic, {true, true, false}));
}

TEST_CASE("in a static group only confirmed dynamic cells are dynamic", "[relabelling]") {
  CHECK_FALSE(is_dynamic_relabelled(ComponentClass::kStatic, {true, false, false}));
  CHECK(is_dynamic_relabelled(ComponentClass::kStatic, {false, false, true}));
}

TEST_CASE("in a mixed group each cell has its own label", "[relabelling]") {
  CHECK(is_dynamic_relabelled(ComponentClass::kMixed, {true, true, false}));
  CHECK_FALSE(is_dynamic_relabelled(ComponentClass::kMixed, {false, false, true}));
}

TEST_CASE("a component goes by its share unless the rest contradicts it", "[relabelling]") {
  CHECK(class_by_share(cells(10, 0), 4, 0.4F, 0.1F) == ComponentClass::kDynamic);
  CHECK(class_by_share(cells(10, 0), 3, 0.4F, 0.1F) == ComponentClass::kMixed);
  CHECK(class_by_share(cells(20, 0), 1, 0.4F, 0.1F) == ComponentClass::kStatic);
  // 0.2 a cell.
  CHECK(class_by_share(cells(10, -2000), 4, 0.4F, 0.1F) == ComponentClass::kDynamic);
  CHECK(class_by_share(cells(10, -2010), 4, 0.4F, 0.1F) == ComponentClass::kMixed);
}

TEST_CASE("cells without a component are removed by more than a tie", "[relabelling]") {
  CHECK(class_by_mean(cells(10, 4250), 425) == ComponentClass::kMixed);
  CHECK(class_by_mean(cells(10, 4251), 425) == ComponentClass::kDynamic);
  CHECK(class_by_mean(cells(10, 0), 425) == ComponentClass::kMixed);
  CHECK(class_by_mean(cells(10, -1), 425) == ComponentClass::kStatic);
}
