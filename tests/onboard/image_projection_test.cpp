// Azimuths, elevations and pixels of directions
#include "unimapper/core/image_projection.hpp"

#include "tests/test.hpp"
#include "unimapper/core/angles.hpp"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;

TEST_CASE("angles need no maths library") {
  for (double degrees = -180.0; degrees <= 180.0; degrees += 0.5) {
    CHECK(sin_deg(degrees) == Approx(std::sin(degrees * M_PI / 180.0)).margin(1e-10));
    const auto x = static_cast<float>(std::cos(degrees * M_PI / 180.0));
    const auto y = static_cast<float>(std::sin(degrees * M_PI / 180.0));
    const double turns = direction_turns(7.0F * x, 7.0F * y);
    CHECK(std::abs(std::remainder(turns - degrees / 360.0, 1.0)) < 1e-6);
  }
  CHECK(direction_turns(0.0F, 0.0F) == 0.0F);
}

TEST_CASE("directions outside the field of view have no pixel") {
  FreeSpaceConfig config;
  config.horizontal_fov_deg = 70.0F;
  config.elevation_min_deg = -20.0F;
  config.elevation_max_deg = 20.0F;
  const ImageProjection projection(config.image_shape());
  const float x[] = {1.0F, 1.0F, -1.0F, 1.0F, 1.0F, 0.0F, NAN};
  const float y[] = {0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};
  const float z[] = {0.0F, 0.0F, 0.0F, 0.5F, -0.5F, 0.0F, 0.0F};
  std::int32_t pixel[7];
  float range[7];
  projection.project(x, y, z, 7, pixel, range);
  CHECK(pixel[0] != ImageProjection::kOutside);
  for (const int i : {1, 2, 3, 4, 6}) CHECK(pixel[i] == ImageProjection::kOutside);
  for (const std::int32_t p : pixel) CHECK(p < static_cast<std::int32_t>(projection.pixels()));
}

TEST_CASE("a full turn has a pixel for every azimuth, the seam included") {
  const ImageProjection projection{FreeSpaceConfig{}.image_shape()};
  for (int i = 0; i <= 100000; ++i) {
    const auto angle = static_cast<float>(i * 2.0 * M_PI / 100000.0);
    const float x = std::cos(angle);
    const float y = std::sin(angle);
    const float z = 0.0F;
    std::int32_t pixel = 0;
    float range = 0.0F;
    projection.project(&x, &y, &z, 1, &pixel, &range);
    if (pixel < 0 || pixel >= static_cast<std::int32_t>(projection.pixels())) FAIL(i);
  }
}
