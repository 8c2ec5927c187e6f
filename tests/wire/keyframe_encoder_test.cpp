// Tests of the encoder that runs on the robot.
#include "unimapper/wire/keyframe_encoder.hpp"

#include "tests/test.hpp"
#include "tests/wire/model.hpp"
#include "tests/wire/records.hpp"
#include "tests/wire/same_record.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;

namespace {

constexpr SessionId kSession{7, 0x0123456789ABCDEFULL};

/// A keyframe as the pipeline delivers it: cells off the grid, images as pixels.
struct Keyframe {
  KeyframeRecord record;
  std::vector<std::vector<std::uint16_t>> pixels;
  std::vector<FreeSpaceImage> images;
  KeyframeContent content;

  Keyframe(std::uint64_t seed, std::uint32_t cells)
      : Keyframe(wire_test::random_record(seed, cells)) {}
  explicit Keyframe(KeyframeRecord made) : record(std::move(made)) {
    record.session = kSession;
    for (const CodedImage& image : record.images) {
      auto& decoded = pixels.emplace_back(ImageProjection(record.image_shape).pixels());
      REQUIRE(decode_image(image.code, decoded));
    }
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      images.push_back({record.images[i].scan, pixels[i]});
    }
    content.sequence = record.sequence;
    content.reference_scan = record.reference_scan;
    content.T_odometry_keyframe = record.T_odometry_keyframe;
    content.up = record.up;
    content.slip = record.slip;
    content.scans = record.scans;
    content.cell_size_m = record.cell_size_m;
    content.static_cells = record.static_cells;
    content.dynamic_cells = record.dynamic_cells;
    content.image_shape = record.image_shape;
    content.image_full_weight_range_m = record.image_full_weight_range_m;
    content.images = images;
    content.place = record.place();
    content.points_in = record.points_in;
    content.points_dynamic = record.points_dynamic;
  }
  Keyframe(const Keyframe&) = delete;
  Keyframe& operator=(const Keyframe&) = delete;

  /// What the base gets of it.
  [[nodiscard]] KeyframeRecord sent() const {
    KeyframeRecord quantised = record;
    quantised.planes.clear();  // the base computes them
    quantised.left_out = 0;
    if (images.empty()) {
      quantised.image_shape = {};
      quantised.image_full_weight_range_m = 0.0F;
    }
    wire_test::quantise(quantised);
    return quantised;
  }
};

/// An encoder with its memory and what it wrote last.
struct OwnedEncoder {
  MemoryBlock memory;
  KeyframeEncoder encoder;
  std::vector<std::uint8_t> bytes;

  explicit OwnedEncoder(std::uint32_t max_cells)
      : memory(KeyframeEncoder::required_bytes(max_cells)) {
    auto made = KeyframeEncoder::create(max_cells, memory.span());
    REQUIRE(made.ok());
    encoder = made.value();
  }
  EncodeResult encode(const Keyframe& keyframe) {
    bytes.resize(1U << 20U);
    const EncodeResult result = encoder.encode(keyframe.content, kSession, bytes);
    bytes.resize(result.bytes);
    return result;
  }
  [[nodiscard]] KeyframeRecord decoded() const {
    const DecodedKeyframe decoded = decode_keyframe(bytes);
    REQUIRE(decoded.record.has_value());
    return *decoded.record;
  }
};

}  // namespace

TEST_CASE("the robot's encoder and the base's record give the same bytes") {
  OwnedEncoder owned(3000);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Keyframe keyframe(seed, static_cast<std::uint32_t>(seed * 50));
    if (seed % 4 == 1) keyframe.record.static_cells[0].position.x() = 1e5F;
    const EncodeResult result = owned.encode(keyframe);
    REQUIRE(result.error.code == ErrorCode::kOk);
    const KeyframeRecord expected = keyframe.sent();
    CHECK(owned.bytes == encode_keyframe(expected));
    CHECK(result.left_out == expected.left_out);
    wire_test::check_same(owned.decoded(), expected);
    CHECK((result.image_bytes > 0) == !expected.images.empty());
  }
}

TEST_CASE("a buffer that is too small is told how large it must be, and nothing lies beyond it") {
  OwnedEncoder owned(200);
  const Keyframe keyframe(3, 200);
  const std::size_t needed = owned.encoder.encode(keyframe.content, kSession, {}).bytes;
  REQUIRE(needed > 1000);
  for (std::size_t room = 0; room < needed; room += room < needed - 40 ? 37 : 1) {
    std::vector<std::uint8_t> buffer(room + 16, 0xA5);
    const EncodeResult result =
        owned.encoder.encode(keyframe.content, kSession, std::span(buffer).first(room));
    CHECK(result.error.code == ErrorCode::kBufferTooSmall);
    CHECK(result.bytes == needed);
    if (!std::all_of(buffer.end() - 16, buffer.end(), [](auto b) { return b == 0xA5; })) {
      FAIL("written beyond " << room);
    }
  }
  std::vector<std::uint8_t> buffer(needed);
  CHECK(owned.encoder.encode(keyframe.content, kSession, buffer).error.code == ErrorCode::kOk);
}

TEST_CASE("cells beyond the encoder's capacity are left out and counted") {
  OwnedEncoder owned(100);
  const Keyframe keyframe(5, 150);
  const EncodeResult result = owned.encode(keyframe);
  REQUIRE(result.error.code == ErrorCode::kOk);
  CHECK(result.left_out == 50);
  CHECK(owned.decoded().static_cells.size() == 100);
  CHECK(owned.decoded().left_out == 50);
}

TEST_CASE("all bits of a cell's key decide its order") {
  // Cells that differ in one step of one coordinate, or in their ground only.
  KeyframeRecord record = wire_test::random_record(1, 10);
  record.T_odometry_keyframe = Pose();
  record.cell_size_m = 0.2F;
  record.static_cells.clear();
  for (const float far :
       {0.0F, 0.1F, 0.2F, 6.39F, 6.41F, 100.0F, 819.0F, -0.01F, -6.41F, -819.0F}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const std::uint8_t ground : {std::uint8_t{0}, std::uint8_t{1}}) {
        record.static_cells.push_back({far * Eigen::Vector3f::Unit(axis), 0, ground, 0});
      }
    }
  }
  const Keyframe keyframe(std::move(record));
  OwnedEncoder owned(static_cast<std::uint32_t>(keyframe.record.static_cells.size()));
  (void)owned.encode(keyframe);
  wire_test::check_same(owned.decoded(), keyframe.sent());
}

TEST_CASE("an invalid keyframe is refused with the reason") {
  OwnedEncoder owned(100);
  const auto refuses = [&](const std::string& reason, const auto& spoil) {
    Keyframe keyframe(2, 50);
    keyframe.content.image_shape = {120.0F, 2.0F, -20.0F, 30.0F, 2.5F};
    keyframe.pixels.assign(
        1, std::vector<std::uint16_t>(ImageProjection(keyframe.content.image_shape).pixels()));
    keyframe.images.assign(1, {0, keyframe.pixels[0]});
    keyframe.content.images = keyframe.images;
    spoil(keyframe);
    const EncodeResult result = owned.encode(keyframe);
    CHECK(result.error.code == ErrorCode::kInvalidKeyframe);
    CHECK_THAT(result.error.message, Catch::Contains(reason));
    CHECK(result.bytes == 0);
  };
  refuses("no scans", [](Keyframe& k) { k.content.scans = {}; });
  refuses("the reference scan", [](Keyframe& k) { k.content.reference_scan = 1000; });
  refuses("not finite", [](Keyframe& k) {
    k.content.T_odometry_keyframe.translation.x() = std::numeric_limits<double>::quiet_NaN();
  });
  refuses("another shape", [](Keyframe& k) { k.images[0].pixels = k.images[0].pixels.first(5); });
  refuses("scan of a free-space image", [](Keyframe& k) { k.images[0].scan = 1000; });
  refuses("field of view", [](Keyframe& k) { k.content.image_shape.elevation_max_deg = -30.0F; });
  refuses("cells of such a size", [](Keyframe& k) { k.content.cell_size_m = 0.001F; });
  refuses("cells of such a size", [](Keyframe& k) { k.content.cell_size_m = std::nanf(""); });
  refuses("full-weight", [](Keyframe& k) { k.content.image_full_weight_range_m = -1.0F; });
  refuses("more points removed", [](Keyframe& k) { k.content.points_dynamic = 1U << 30U; });
}

TEST_CASE("an encoder without its memory is refused, or does nothing") {
  alignas(64) std::byte small[128];
  CHECK(KeyframeEncoder::create(1000, small).error().code == ErrorCode::kMemoryTooSmall);
  const std::size_t bytes = KeyframeEncoder::required_bytes(10);
  std::vector<std::byte> memory(bytes + 128);
  auto* odd = memory.data() + (reinterpret_cast<std::uintptr_t>(memory.data()) % 64 == 0 ? 1 : 0);
  CHECK(KeyframeEncoder::create(10, {odd, bytes}).error().code == ErrorCode::kMemoryMisaligned);
  const Keyframe keyframe(4, 5);
  KeyframeEncoder none;
  CHECK(none.encode(keyframe.content, kSession, {}).error.code == ErrorCode::kMemoryTooSmall);
}
