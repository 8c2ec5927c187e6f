// Keyframes quantised to the grid of the wire: what moves, what is left out, in which order
#include "tests/test.hpp"
#include "tests/wire/records.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;

namespace {

/// The record as it arrives.
KeyframeRecord sent(KeyframeRecord record) {
  if (record.scans.empty()) record.scans.resize(1);
  const DecodedKeyframe decoded = decode_keyframe(encode_keyframe(record));
  REQUIRE(decoded.record.has_value());
  return *decoded.record;
}

}  // namespace

TEST_CASE("cells are moved within their part of the cell, sorted, and come without their points") {
  KeyframeRecord record;
  record.static_cells = {{{5.03F, 0.17F, 0.1F}, 256, 0, 0}, {{-5.03F, 1.0F, 2.19F}, 255, 7, 9}};
  record = sent(record);
  const FineCell expected[] = {{{-5.0575F, 1.0575F, 2.1F + 0.2F / 3.0F}, 0, 1, 0},
                               {{5.0575F, 0.1425F, 0.1F}, 0, 0, 0}};
  REQUIRE(record.static_cells.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const FineCell& cell = record.static_cells[i];
    CHECK(cell.position.isApprox(expected[i].position, 1e-6F));
    CHECK(cell.points == 0);
    CHECK(cell.ground == expected[i].ground);
    CHECK(cell.intensity == (i == 0 ? 9 : 0));
  }
  CHECK(record.left_out == 0);
}

TEST_CASE("no coordinate of the odometry moves by more than a good quarter of a cell") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    KeyframeRecord before = wire_test::random_record(seed, 1);
    before.static_cells[0].position *= 0.3F;  // within the smallest grid
    const KeyframeRecord after = sent(before);
    REQUIRE(after.static_cells.size() == 1);
    const Eigen::Vector3f moved =
        before.T_odometry_keyframe.rotation.cast<float>() *
        (after.static_cells[0].position - before.static_cells[0].position);
    const Eigen::Array3f most = before.cell_size_m * Eigen::Array3f(0.2876F, 0.2876F, 0.1668F);
    CHECK((moved.array().abs() <= most + 1e-4F).all());
  }
}

TEST_CASE("a rotation that is one to a few digits only costs the cells no precision") {
  KeyframeRecord record;
  record.T_odometry_keyframe.rotation(0, 1) = 4e-4;
  record.static_cells = {{{-300.05F, 299.85F, 0.1F}, 1, 0, 0}};
  record = sent(record);
  REQUIRE(record.static_cells.size() == 1);
  CHECK((record.static_cells[0].position - Eigen::Vector3f(-300.05F, 299.85F, 0.1F)).norm() < 0.1F);
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  CHECK(encode_keyframe(sent(record)) == bytes);
}

TEST_CASE("cells beyond the wire's range or not finite are left out and counted") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  KeyframeRecord record;
  record.static_cells = {{{819.19F, -819.19F, 0.0F}, 1, 0, 0},
                         {{819.21F, 0.0F, 0.0F}, 1, 0, 0},
                         {{0.0F, -819.21F, 0.0F}, 1, 0, 0},
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
