// Tests of the free-space image code.
#include "src/core/image_code.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;

namespace {

using Pixels = std::vector<std::uint16_t>;
using Code = std::vector<std::uint8_t>;

Code encoded(const Pixels& pixels) {
  Code code(max_image_code(pixels.size()));
  code.resize(encode_image(pixels, code));
  return code;
}

bool is_code(const Code& code, std::size_t count) {
  Pixels pixels(count);
  const bool valid = is_image_code(code, count);
  CHECK(decode_image(code, pixels) == valid);
  return valid;
}

Pixels decoded(const Code& code, std::size_t count) {
  Pixels pixels(count);
  REQUIRE(decode_image(code, pixels));
  return pixels;
}

}  // namespace

TEST_CASE("ranges come back at most one per cent nearer, never farther") {
  for (std::uint32_t range = 0; range <= 65535; range += 13) {
    const Pixels pixels{static_cast<std::uint16_t>(range)};
    const std::uint16_t back = decoded(encoded(pixels), 1)[0];
    CHECK(back <= range);
    // A quarter of a metre and less is as good as nothing.
    if (range >= 32) CHECK(range - back <= range / 100 + 1);
  }
}

TEST_CASE("a decoded image encodes to the same code again") {
  Pixels pixels(5000);
  test::Random random(7);
  for (std::uint16_t& pixel : pixels) {
    pixel = static_cast<std::uint16_t>(random.below(3) == 0 ? 0 : random.below(65536));
  }
  const Code code = encoded(pixels);
  const Pixels once = decoded(code, pixels.size());
  CHECK(encoded(once) == code);
}

TEST_CASE("a smooth image takes a fraction of its pixels' bytes") {
  Pixels wall(900 * 60);
  for (std::size_t i = 0; i < wall.size(); ++i) {
    wall[i] = static_cast<std::uint16_t>(1280 + i % 900 / 3);
  }
  CHECK(encoded(wall).size() < wall.size() / 4);
  CHECK(encoded(Pixels(100000, 0)).size() < 800);
}

TEST_CASE("the worst image fits the stated room") {
  Pixels worst(1001);
  for (std::size_t i = 0; i < worst.size(); ++i) worst[i] = i % 2 == 0 ? 60000 : 0;
  CHECK(encoded(worst).size() <= max_image_code(worst.size()));
  CHECK(encoded({}).empty());
}

TEST_CASE("every image has one code: any other is refused") {
  CHECK(is_code({0x01}, 2));
  CHECK_FALSE(is_code({0x00, 0x00}, 2));              // one run, cut in two
  CHECK_FALSE(is_code({0xE0, 0x00}, 1));              // the level before, as a jump
  CHECK_FALSE(is_code({0xE0, 0x5D, 0xB0}, 2));        // the level before, as a step
  CHECK_FALSE(is_code({0xE0, 0x5D, 0xE0, 0x5E}, 2));  // a step, as a jump
  CHECK_FALSE(is_code({0x81}, 1));                    // a step below nothing
  CHECK_FALSE(is_code({0xE3, 0xFF}, 1));              // beyond the last level
  CHECK_FALSE(is_code({0xE0}, 1));                    // half a jump
  CHECK_FALSE(is_code({0x01}, 1));                    // more pixels than there are
  CHECK_FALSE(is_code({0x00}, 2));                    // fewer
  CHECK(is_code({0x7F, 0x00}, 129));                  // a full run goes on
}

TEST_CASE("only fields of view that exist are worked with") {
  CHECK(is_image_shape({}));
  CHECK(is_image_shape({360.0F, 0.4F, -90.0F, 90.0F, 0.5F}));
  const auto with = [](auto change) {
    RangeImageShape shape;
    change(shape);
    return is_image_shape(shape);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK_FALSE(with([&](auto& s) { s.horizontal_fov_deg = nan; }));
  CHECK_FALSE(with([](auto& s) { s.horizontal_fov_deg = 361.0F; }));
  CHECK_FALSE(with([](auto& s) { s.azimuth_resolution_deg = 0.0F; }));
  CHECK_FALSE(with([&](auto& s) { s.elevation_resolution_deg = nan; }));
  CHECK_FALSE(with([](auto& s) { s.elevation_max_deg = -45.0F; }));
  // 7200 x 3600 pixels.
  CHECK_FALSE(is_image_shape({360.0F, 0.05F, -90.0F, 90.0F, 0.05F}));
}
