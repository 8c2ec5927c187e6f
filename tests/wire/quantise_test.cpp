// Tests of quantisation to the grid of the wire.
#include "unimapper/core/quantise.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/wire/records.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using wire_test::Random;
using wire_test::random_vector;

namespace {

/// The record as it arrives.
KeyframeRecord sent(KeyframeRecord record) {
  if (record.scans.empty()) record.scans.resize(1);
  const DecodedKeyframe decoded = decode_keyframe(encode_keyframe(record));
  REQUIRE(decoded.record.has_value());
  return *decoded.record;
}

}  // namespace

TEST_CASE("a normal survives the wire to better than a ten-thousandth of a radian") {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f normal = random_vector(random, 1.0).normalized();
    const auto code = octahedral(normal);
    REQUIRE(code.has_value());
    const Eigen::Vector3f back = unit_vector(*code);
    CHECK((back - normal).norm() < 1e-4F);
    CHECK(std::abs(back.norm() - 1.0F) < 1e-6F);
  }
}

TEST_CASE("every normal has one code and every code in use is its own normal's") {
  const auto returns_to_itself = [](int u, int v) {
    const OctahedralNormal code{static_cast<std::int16_t>(u), static_cast<std::int16_t>(v)};
    const bool same = octahedral(unit_vector(code)) == code;
    return same == is_canonical(code);
  };
  // The rim and the fold lines, where two codes can mean one vector, completely.
  for (int i = -32767; i <= 32767; ++i) {
    const int fold = 32767 - std::abs(i);
    for (int rim : {-32767, 32767, fold, -fold, fold + 1, -fold - 1, 0}) {
      if (std::abs(rim) > 32767) continue;
      if (!returns_to_itself(i, rim) || !returns_to_itself(rim, i)) {
        FAIL("code " << i << ", " << rim);
      }
    }
  }
  Random random(2);
  for (int i = 0; i < 200000; ++i) {
    const int u = static_cast<int>(random.below(65535)) - 32767;
    const int v = static_cast<int>(random.below(65535)) - 32767;
    if (!returns_to_itself(u, v)) FAIL("code " << u << ", " << v);
  }
  CHECK_FALSE(is_canonical({std::numeric_limits<std::int16_t>::min(), 0}));
}

TEST_CASE("the axes are exact") {
  for (int axis = 0; axis < 3; ++axis) {
    for (float sign : {1.0F, -1.0F}) {
      const Eigen::Vector3f normal = sign * Eigen::Vector3f::Unit(axis);
      CHECK((unit_vector(*octahedral(normal)) - normal).norm() < 1e-7F);
    }
  }
}

TEST_CASE("a keypoint without a normal has no code") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  CHECK_FALSE(octahedral({0.0F, 0.0F, 0.0F}).has_value());
  CHECK_FALSE(octahedral({nan, 0.0F, 1.0F}).has_value());
  CHECK_FALSE(octahedral({infinity, 0.0F, 1.0F}).has_value());
}

TEST_CASE("cells are moved to the nearest centimetre, sorted, and their points saturate") {
  KeyframeRecord record;
  record.static_cells = {{{5.004F, 0.0F, 0.0F}, 256, 0, 0}, {{-5.006F, 1.0F, 2.0F}, 255, 7, 9}};
  record = sent(record);
  REQUIRE(record.static_cells.size() == 2);
  CHECK(record.static_cells[0].position == Eigen::Vector3f(-5.01F, 1.0F, 2.0F));
  CHECK(record.static_cells[0].points == 255);
  CHECK(record.static_cells[0].ground == 1);
  CHECK(record.static_cells[0].reserved == 0);
  CHECK(record.static_cells[1].position == Eigen::Vector3f(5.0F, 0.0F, 0.0F));
  CHECK(record.static_cells[1].points == 255);
  CHECK(record.static_cells[1].ground == 0);
  CHECK(record.left_out == 0);
}

TEST_CASE("cells beyond the wire's range or not finite are left out and counted") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  KeyframeRecord record;
  record.static_cells = {{{327.67F, -327.68F, 0.0F}, 1, 0, 0},
                         {{327.68F, 0.0F, 0.0F}, 1, 0, 0},
                         {{0.0F, -327.69F, 0.0F}, 1, 0, 0},
                         {{0.0F, 0.0F, nan}, 1, 0, 0},
                         {{3e38F, 0.0F, 0.0F}, 1, 0, 0}};
  record.dynamic_cells = {{{0.0F, 0.0F, 1e9F}, 1, 0, 0}};
  record.keypoints = {{{1000.0F, 0.0F, 0.0F}, up, 0, 0},
                      {{1001.0F, 0.0F, 0.0F}, up, 0, 0},
                      {{0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.0F}, 0, 0}};
  record.planes = {{{0.0F, 0.0F, 0.0F}, up}, {{400.0F, 0.0F, 0.0F}, up}, {up, {nan, nan, nan}}};
  record = sent(record);
  CHECK(record.static_cells.size() == 1);
  CHECK(record.dynamic_cells.empty());
  CHECK(record.keypoints.size() == 1);
  CHECK(record.planes.size() == 1);
  CHECK(record.left_out == 4 + 1 + 2 + 2);
}

TEST_CASE("the order in which cells come does not matter") {
  KeyframeRecord forwards = wire_test::random_record(3, 2000);
  KeyframeRecord backwards = forwards;
  std::reverse(backwards.static_cells.begin(), backwards.static_cells.end());
  forwards = sent(forwards);
  backwards = sent(backwards);
  REQUIRE(forwards.static_cells.size() == backwards.static_cells.size());
  for (std::size_t i = 0; i < forwards.static_cells.size(); ++i) {
    CHECK(forwards.static_cells[i].position == backwards.static_cells[i].position);
    CHECK(forwards.static_cells[i].points == backwards.static_cells[i].points);
  }
}
