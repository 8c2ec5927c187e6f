// Tests of the serialisation of keyframe records.
#include "unimapper/wire/keyframe_codec.hpp"

#include "tests/test.hpp"
#include "tests/wire/golden.hpp"
#include "tests/wire/model.hpp"
#include "tests/wire/records.hpp"
#include "tests/wire/same_record.hpp"
#include "unimapper/wire/byte_io.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::wire::wire_test;

namespace {

std::string error_of(const std::vector<std::uint8_t>& bytes) {
  const DecodedKeyframe decoded = decode_keyframe(bytes);
  CHECK(decoded.record.has_value() == decoded.error.empty());
  return decoded.error;
}

}  // namespace

TEST_CASE("the decoded keyframe equals the quantised one, to the last bit") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    KeyframeRecord record = random_record(seed, static_cast<std::uint32_t>(seed * 97));
    record.odometry_contradicted = seed % 2 == 1;
    const std::vector<std::uint8_t> from_raw = encode_keyframe(record);
    quantise(record);
    const std::vector<std::uint8_t> bytes = encode_keyframe(record);
    CHECK(from_raw == bytes);
    const DecodedKeyframe decoded = decode_keyframe(bytes);
    INFO("seed " << seed << ": " << decoded.error);
    REQUIRE(decoded.record.has_value());
    check_same(record, *decoded.record);
    CHECK(encode_keyframe(*decoded.record) == bytes);
  }
}

TEST_CASE("a keyframe that saw nothing travels too") {
  KeyframeRecord record;
  record.scans.resize(1);
  const DecodedKeyframe decoded = decode_keyframe(encode_keyframe(record));
  REQUIRE(decoded.record.has_value());
  check_same(record, *decoded.record);
}

TEST_CASE("a crowd of cells in one spot comes back whole") {
  KeyframeRecord record = small_record();
  record.static_cells.assign(70000, FineCell{{1.0F, 1.0F, 1.0F}, 5, 0, 0});
  quantise(record);
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  const DecodedKeyframe decoded = decode_keyframe(bytes);
  REQUIRE(decoded.record.has_value());
  CHECK(decoded.record->static_cells.size() == 70000);
  CHECK(encode_keyframe(*decoded.record) == bytes);
}

TEST_CASE("the bytes of schema 6 never change") {
  const std::vector<std::uint8_t> golden =
      bytes_of(kHead + kUp + kCellEdge + kSecondScan + kDescriptor + kFirstScan + kCodedCells +
               kCodedImages);
  KeyframeRecord record = small_record();
  record.up = {true, 0x1p-12F, -0x1p-14F, 0x1p-13F};
  CHECK(encode_keyframe(record) == golden);
  REQUIRE(decode_keyframe(golden).record.has_value());
  CHECK(decode_keyframe(golden).record->up == record.up);
}

TEST_CASE("a slip takes a flag and 24 bytes behind the edge of a cell, and nothing without") {
  KeyframeRecord record = small_record();
  const std::vector<std::uint8_t> without = encode_keyframe(record);
  record.slip = along({1.0F, -2.0F, 0.5F});
  const auto slipped = static_cast<std::ptrdiff_t>(kCellEdgeAt) + 2;
  std::vector<std::uint8_t> expected = forged(without, kSchemaAt + 2, "02");
  const std::vector<std::uint8_t> slip =
      bytes_of("0000803F 000000C0 0000003F 00008040 000080BF 0000803E");
  expected.insert(expected.begin() + slipped, slip.begin(), slip.end());
  CHECK(encode_keyframe(record) == expected);
  REQUIRE(decode_keyframe(expected).record.has_value());
  CHECK(decode_keyframe(expected).record->slip == record.slip);
  const auto at = static_cast<std::size_t>(slipped);
  for (const auto& [where, digits] :
       {std::pair{at, "0000C07F"}, {at, "000080BF"}, {at, "00008049"}, {at + 4, "000080C0"}}) {
    INFO(where << " " << digits);
    CHECK_THAT(error_of(forged(expected, where, digits)), Catch::Contains("slip"));
  }
  const std::string none(48, '0');
  CHECK_THAT(error_of(forged(expected, at, none)), Catch::Contains("slip"));
}

TEST_CASE("intensities take a flag and a byte for each static cell, and nothing without") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    KeyframeRecord record = random_record(seed, 500);
    // Two of the same place, in either order.
    record.static_cells.push_back(record.static_cells.front());
    quantise(record);
    const std::vector<std::uint8_t> without = encode_keyframe(record);
    std::uint8_t next = 0;
    for (FineCell& cell : record.static_cells) cell.intensity = next += 77;
    const std::vector<std::uint8_t> bytes = encode_keyframe(record);
    CHECK(bytes.size() == without.size() + record.static_cells.size());
    CHECK(bytes[kSchemaAt + 2] == (without[kSchemaAt + 2] | 4));
    const DecodedKeyframe decoded = decode_keyframe(bytes);
    INFO("seed " << seed << ": " << decoded.error);
    REQUIRE(decoded.record.has_value());
    CHECK(encode_keyframe(*decoded.record) == bytes);
    std::reverse(record.static_cells.begin(), record.static_cells.end());
    CHECK(encode_keyframe(record) == bytes);
  }
}

TEST_CASE("intensities that are missing, unknown or out of order are refused") {
  KeyframeRecord record = small_record();
  record.images.clear();
  record.dynamic_cells.clear();
  record.static_cells.assign(2, {{1.0F, 2.0F, -1.5F}, 1, 0, 0x11});
  record.static_cells[1].intensity = 0x22;
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  REQUIRE(error_of(bytes).empty());
  // Behind them no dynamic cells (8 bytes) and no images (4).
  const std::size_t at = bytes.size() - 14;
  REQUIRE(bytes[at] == 0x11);
  CHECK_THAT(error_of(forged(bytes, at, "2211")), Catch::Contains("sorted"));
  CHECK_THAT(error_of(forged(bytes, at, "0000")), Catch::Contains("no intensity"));
  CHECK_THAT(error_of({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 1}),
             Catch::Contains("fewer bytes than intensities"));
}

namespace {

/// Walls and a floor, the same to the last bit on every processor: no library of linear algebra.
KeyframeRecord turned_scene() {
  Random random(5);
  KeyframeRecord record;
  record.scans.resize(1);
  record.T_odometry_keyframe.rotation << 0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0;
  record.T_odometry_keyframe.translation = {1234.5, -77.25, 3.125};
  for (int i = 0; i < 20000; ++i) {
    FineCell cell{};
    const auto x = static_cast<float>(random.uniform(-60.0, 60.0));
    const auto y = static_cast<float>(random.uniform(-60.0, 60.0));
    const auto z = static_cast<float>(random.uniform(-1.7, -1.6));
    cell.position = {x, y, z};
    cell.ground = i % 3 != 0 ? 1 : 0;
    if (i % 3 == 0) cell.position = {x, 12.5F, 10.0F + 50.0F * z / 8.0F};
    record.static_cells.push_back(cell);
  }
  return record;
}

}  // namespace

// On every processor: all that is computed before and in the coder counts.
TEST_CASE(
    "the code of a large scene never changes, and takes less than half of four bytes a cell") {
  const KeyframeRecord record = turned_scene();
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  CHECK(bytes.size() < 20000 * 4 / 2);
  CHECK(crc32(bytes) == 0xFA08A6A8U);
  const DecodedKeyframe decoded = decode_keyframe(bytes);
  REQUIRE(decoded.record.has_value());
  CHECK(encode_keyframe(*decoded.record) == bytes);
}

TEST_CASE("a covariance of up that is none is refused") {
  const std::vector<std::uint8_t> good = encode_keyframe(small_record());
  for (const char* up : {"00000000 00000000 00000000", "00008039 000080B8 00000039"}) {
    CHECK(error_of(forged(good, kUpAt, up)).empty());
  }
  for (const char* up :
       {"00000080 00000000 00000000", "00000000 00000000 00008039", "00008039 00000000 00000000",
        "00008039 00008039 00008039", "0000C07F 00000000 00008039", "00008039 0000C07F 00008039",
        "00008039 00000000 0000807F", "000080B9 00000000 00008039"}) {
    INFO(up);
    CHECK_THAT(error_of(forged(good, kUpAt, up)), Catch::Contains("covariance of up"));
  }
}

TEST_CASE("a keyframe cut anywhere is refused") {
  const std::vector<std::uint8_t> bytes = encode_keyframe(random_record(5, 50));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const std::vector<std::uint8_t> cut(bytes.data(), bytes.data() + length);
    if (error_of(cut).empty()) FAIL("accepted " << length << " of " << bytes.size());
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  CHECK_THAT(error_of(longer), Catch::Contains("left over"));
}

TEST_CASE("no flipped bit makes the decoder fall over or bend the rules") {
  const std::vector<std::uint8_t> bytes = encode_keyframe(random_record(6, 60));
  std::size_t refused = 0;
  // Every third one: of every byte two or three, and every digit of a byte in turn.
  for (std::size_t bit = 0; bit < bytes.size() * 8; bit += 3) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    const DecodedKeyframe decoded = decode_keyframe(damaged);
    // What is accepted is a different but proper keyframe; the chunks' checksum catches those.
    if (!decoded.record) {
      ++refused;
    } else if (encode_keyframe(*decoded.record) != damaged) {
      FAIL("bit " << bit << " has a second spelling");
    }
  }
  CHECK(refused > 0);
}

TEST_CASE("whatever the bytes of the cells, a keyframe that is accepted has one encoding") {
  const std::vector<std::uint8_t> good = encode_keyframe(small_record());
  Random random(99);
  std::size_t accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::uint8_t> bytes = good;
    for (std::size_t at = kCellsAt + 8; at < bytes.size(); ++at) {
      if (random.below(3) == 0) bytes[at] = static_cast<std::uint8_t>(random.below(256));
    }
    const DecodedKeyframe decoded = decode_keyframe(bytes);
    if (!decoded.record) continue;
    ++accepted;
    if (encode_keyframe(*decoded.record) != bytes) FAIL("a second spelling");
  }
  INFO(accepted);
  CHECK(accepted < 20000);
}

TEST_CASE("forged fields are refused with the reason") {
  const std::vector<std::uint8_t> good = encode_keyframe(small_record());
  CHECK(error_of(good).empty());
  CHECK_THAT(error_of({}), Catch::Contains("not a keyframe"));
  const std::tuple<std::size_t, const char*, const char*> forgeries[] = {
      {0, "58", "not a keyframe"},
      {kSchemaAt, "07", "unknown schema version"},
      {kSchemaAt + 2, "04", "fewer bytes than cells"},
      {kSchemaAt + 2, "08", "unknown flags"},
      {kSchemaAt + 3, "01", "unknown flags"},
      {kReferenceScanAt, "02", "reference scan"},
      {kPoseAt, "000000000000F87F", "not finite"},
      {kPoseAt, "0000000000000040", "not a rotation"},
      {kScanCountAt, "FFFFFFFF", "beyond the limit"},
      {kScanCountAt, "FFFF", "fewer bytes"},
      {kCellEdgeAt, "0000", "cells of such a size"},
      {kCellsAt, "FFFFFFFF", "fewer bytes than cells"},
      {kCellsAt, "01", "more cells than announced"},
      {kCellsAt + 4, "00", "fewer bytes than cells"}};
  for (const auto& [at, digits, reason] : forgeries) {
    CAPTURE(at, digits);
    CHECK_THAT(error_of(forged(good, at, digits)), Catch::Contains(reason));
  }
  CHECK_FALSE(error_of(forged(good, kScanCountAt, "00")).empty());
}

TEST_CASE("a keyframe that would take more memory than allowed is refused for what it announces") {
  const KeyframeRecord record = small_record();
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  std::uint64_t taken =
      (record.static_cells.size() + record.dynamic_cells.size()) * sizeof(FineCell);
  for (const CodedImage& image : record.images) taken += image.code.size();
  CHECK(decode_keyframe(bytes, taken).record);
  CHECK_THAT(decode_keyframe(bytes, taken - 1).error, Catch::Contains("more memory than allowed"));
  CHECK_THAT(decode_keyframe(bytes, 1).error, Catch::Contains("more memory than allowed"));
}

TEST_CASE("a record that is no keyframe is not encoded") {
  const auto refuses = [](const char* reason, const std::function<void(KeyframeRecord&)>& spoil) {
    KeyframeRecord record = small_record();
    spoil(record);
    CHECK_THROWS_WITH(encode_keyframe(record), Catch::Contains(reason));
  };
  refuses("no scans", [](auto& r) { r.scans.clear(); });
  refuses("reference scan", [](auto& r) { r.reference_scan = 2; });
  refuses("do not ascend", [](auto& r) { r.scans[1].scan_index = 420; });
  refuses("backwards", [](auto& r) { r.scans[1].stamp_ns = 0; });
  refuses("more points removed", [](auto& r) { r.points_dynamic = 1001; });
  refuses("not a rotation", [](auto& r) { r.T_odometry_keyframe.rotation *= -1.0; });
  refuses("off the Earth", [](auto& r) { r.scans[0].T_odometry_sensor.translation.x() = 1e9; });
  refuses("scan of a free-space image", [](auto& r) { r.images[0].scan = 2; });
  refuses("damaged", [](auto& r) { r.images[0].code.pop_back(); });
  refuses("no image has such", [](auto& r) { r.image_shape.elevation_max_deg = -1.0F; });
  refuses("such a full-weight range", [](auto& r) { r.image_full_weight_range_m = std::nanf(""); });
  refuses("such a full-weight range", [](auto& r) { r.image_full_weight_range_m = -0.0F; });
  refuses("too many free-space images", [](auto& r) { r.images.resize(33, r.images[0]); });
  refuses("not finite", [](auto& r) {
    r.scans[0].T_odometry_sensor.translation.x() = std::numeric_limits<double>::infinity();
  });
}
