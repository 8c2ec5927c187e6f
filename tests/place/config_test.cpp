// Validation of the parameters of description and search.
#include "unimapper/place/config.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using Catch::Matchers::Contains;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

template <typename Config, typename Change>
std::string refused(const Change& change) {
  Config config;
  REQUIRE(config.validate().ok());
  change(config);
  CHECK(config.validate().code == ErrorCode::kInvalidConfig);
  return config.validate().message;
}

}  // namespace

TEST_CASE("the defaults are valid, and a value out of range is refused by its name") {
  const auto descriptor = [](auto change) { return refused<DescriptorConfig>(change); };
  CHECK_THAT(descriptor([](auto& c) { c.range_m = kNan; }),
             Contains("range_m must lie in [10, 120] m"));
  CHECK_THAT(descriptor([](auto& c) { c.max_keypoints = 256; }), Contains("max_keypoints"));
  CHECK_THAT(descriptor([](auto& c) { c.max_candidates = 10; }), Contains("max_candidates"));
  const auto search = [](auto change) { return refused<LoopSearchConfig>(change); };
  CHECK_THAT(search([](auto& c) { c.max_places = 0; }), Contains("max_places"));
  CHECK_THAT(search([](auto& c) { c.side_tolerance_m = kNan; }), Contains("side_tolerance_m"));
  CHECK_THAT(search([](auto& c) { c.triangles.max_side_m = 1.0F; }),
             Contains("triangles.max_side_m"));
  CHECK_THAT(search([](auto& c) { c.accept_confidence = 1.5F; }), Contains("accept_confidence"));
}
