// Tests of the validation of parameters.
#include "unimapper/place/config.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <string>

using namespace unimapper;

TEST_CASE("the defaults of description and search are valid") {
  CHECK(DescriptorConfig{}.validate().code == ErrorCode::kOk);
  CHECK(LoopSearchConfig{}.validate().code == ErrorCode::kOk);
}

TEST_CASE("a value out of range is refused by its name") {
  const auto refused_for = [](const auto& config, const std::string& name) {
    const Error error = config.validate();
    return error.code == ErrorCode::kInvalidConfig &&
           std::string(error.message).find(name) != std::string::npos;
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  DescriptorConfig descriptor;
  descriptor.range_m = nan;
  CHECK(refused_for(descriptor, "range_m must lie in [10, 120] m"));
  descriptor = {};
  descriptor.max_keypoints = 256;
  CHECK(refused_for(descriptor, "max_keypoints"));
  descriptor = {};
  descriptor.max_candidates = 10;
  CHECK(refused_for(descriptor, "max_candidates"));

  LoopSearchConfig search;
  search.max_places = 0;
  CHECK(refused_for(search, "max_places"));
  search = {};
  search.side_tolerance_m = nan;
  CHECK(refused_for(search, "side_tolerance_m"));
  search = {};
  search.triangles.max_side_m = 1.0F;
  CHECK(refused_for(search, "triangles.max_side_m"));
  search = {};
  search.accept_confidence = 1.5F;
  CHECK(refused_for(search, "accept_confidence"));
}
