// Visibility test and inverse sensor model at their boundaries
#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "tests/random.hpp"
#include "unimapper/free_space/inverse_sensor_model.hpp"

using namespace unimapper;

namespace {

std::uint16_t pixel_of(float range_m) {
  return static_cast<std::uint16_t>(range_m * kRangeUnitsPerMetre + 0.5F);
}

constexpr Visibility kUnknown{0, 0};
constexpr Visibility kSurface{0, -1};
constexpr Visibility kSeenThrough{-1, 0};

constexpr RangeImageShape kShape{90.0F, 1.0F, -45.0F, 45.0F, 1.0F};

/// Log-odds of a point straight ahead at `range_m` where everything is free up to `measured_m`.
std::int32_t log_odds(const InverseSensorModel& model, float range_m, float measured_m) {
  const ImageProjection projection(kShape);
  const std::vector<std::uint16_t> pixels(projection.pixels(), pixel_of(measured_m));
  const float zero = 0.0F;
  std::int32_t sum = 0;
  model.add(pixels.data(), projection, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero(),
            {&range_m, &zero, &zero, &sum, 1});
  return sum;
}

}  // namespace

TEST_CASE("A point is seen through just beyond the margin, which grows with the range") {
  const VisibilityTest test(0.3F, 0.01F);
  // At 10 m the margin is 0.4 m; a unit is 7.8 mm.
  CHECK(test.look(pixel_of(10.41F), 10.0F) == kSeenThrough);
  CHECK(test.look(pixel_of(10.39F), 10.0F) == kSurface);
  CHECK(test.look(pixel_of(9.61F), 10.0F) == kSurface);
  CHECK(test.look(pixel_of(9.59F), 10.0F) == kUnknown);
  // At 50 m it is 0.8 m.
  CHECK(test.look(pixel_of(50.81F), 50.0F) == kSeenThrough);
  CHECK(test.look(pixel_of(50.79F), 50.0F) == kSurface);
  CHECK(test.look(kNoRange, 10.0F) == kUnknown);
}

TEST_CASE("Having been seen through counts in full up to the full-weight range, then less") {
  const EvidenceWeights weights{800, 400, 200};
  const InverseSensorModel model(VisibilityTest(0.3F, 0.01F), weights, 20.0F);
  CHECK(log_odds(model, 20.0F, 100.0F) == 800);
  CHECK(log_odds(model, 20.1F, 100.0F) == 796);
  CHECK(log_odds(model, 40.0F, 100.0F) == 400);
  const InverseSensorModel always(VisibilityTest(0.3F, 0.01F), weights, 0.0F);
  CHECK(log_odds(always, 90.0F, 100.0F) == 800);
  // Surfaces weigh the same at any range.
  CHECK(log_odds(model, 40.0F, 40.0F) == -200);
  CHECK(log_odds(model, 40.0F, 30.0F) == 0);
}

TEST_CASE("Points are observed in the sensor's frame, whatever theirs is") {
  const ImageProjection projection(kShape);
  const std::vector<std::uint16_t> pixels(projection.pixels(), pixel_of(10.0F));
  const InverseSensorModel model(VisibilityTest(0.3F, 0.01F), {800, 400, 200}, 0.0F);
  // A quarter turn to the left and two metres ahead: the point's y axis is the sensor's -x axis.
  const Eigen::Matrix3f r = Eigen::AngleAxisf(1.5707963F, Eigen::Vector3f::UnitZ()).matrix();
  const float x[] = {0.0F, 0.0F, 0.0F, 5.0F};
  const float y[] = {-7.0F, -9.0F, 7.0F, 0.0F};
  const float z[] = {0.0F, 0.0F, 0.0F, 0.0F};
  std::int32_t sums[] = {0, 0, 0, 0};
  model.add(pixels.data(), projection, r, {2.0F, 0.0F, 0.0F}, {x, y, z, sums, 4});
  CHECK(sums[0] == 800);  // 9 m ahead
  CHECK(sums[1] == 0);    // 11 m ahead, behind what was measured
  CHECK(sums[2] == 0);    // behind the sensor
  CHECK(sums[3] == 0);    // beside the field of view
}

TEST_CASE("Beyond the outermost rays, in the image's slack, nothing is observed") {
  const ImageProjection projection(kShape);
  const std::vector<std::uint16_t> pixels(projection.pixels(), pixel_of(10.0F));
  const InverseSensorModel model(VisibilityTest(0.3F, 0.01F), {800, 400, 200}, 0.0F);
  const auto at = [&](float elevation_deg) {
    const float x = 5.0F * static_cast<float>(cos_deg(elevation_deg));
    const float z = 5.0F * static_cast<float>(sin_deg(elevation_deg));
    const float y = 0.0F;
    std::int32_t sum = 0;
    model.add(pixels.data(), projection, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero(),
              {&x, &y, &z, &sum, 1});
    return sum;
  };
  CHECK(at(43.9F) == 800);
  CHECK(at(44.1F) == 0);
  CHECK(at(-43.9F) == 800);
  CHECK(at(-44.1F) == 0);
}

TEST_CASE("More points than a batch are all observed") {
  const ImageProjection projection(kShape);
  const std::vector<std::uint16_t> pixels(projection.pixels(), pixel_of(10.0F));
  const InverseSensorModel model(VisibilityTest(0.3F, 0.01F), {800, 400, 200}, 0.0F);
  const std::vector<float> x(1000, 5.0F);
  const std::vector<float> zero(1000, 0.0F);
  std::vector<std::int32_t> sums(1000, 1);
  model.add(pixels.data(), projection, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero(),
            {x.data(), zero.data(), zero.data(), sums.data(), 1000});
  for (const std::int32_t sum : sums) REQUIRE(sum == 801);
}

TEST_CASE("Vectors of any width learn the same of every point") {
  const RangeImageShape full_turn;
  for (const RangeImageShape& shape : {full_turn, kShape}) {
    const ImageProjection projection(shape);
    test::Random random(7);
    std::vector<std::uint16_t> pixels(projection.pixels());
    for (std::uint16_t& pixel : pixels) {
      pixel = random.below(8) == 0 ? kNoRange : pixel_of(static_cast<float>(random.uniform(0, 60)));
    }
    const InverseSensorModel model(VisibilityTest(0.3F, 0.01F), {800, 400, 200}, 20.0F);
    const Eigen::Matrix3f r =
        Eigen::AngleAxisf(0.3F, Eigen::Vector3f(1, 2, 3).normalized()).matrix();
    // Beyond a batch, and no multiple of any width.
    constexpr std::uint32_t kPoints = 1021;
    std::vector<float> x(kPoints), y(kPoints), z(kPoints);
    for (std::vector<float>* axis : {&x, &y, &z}) {
      for (float& value : *axis) value = static_cast<float>(random.uniform(-40, 40));
    }
    const auto learnt = [&](VectorWidth width) {
      std::vector<std::int32_t> sums(kPoints, 5);
      model.add(pixels.data(), projection, r, {0.5F, -1.0F, 0.2F},
                {x.data(), y.data(), z.data(), sums.data(), kPoints}, width);
      return sums;
    };
    const std::vector<std::int32_t> baseline = learnt(VectorWidth::kBaseline);
    CHECK(std::count(baseline.begin(), baseline.end(), 5) < std::ptrdiff_t{kPoints});
    CHECK(learnt(widest_vectors()) == baseline);
  }
}

TEST_CASE("Log-odds are rounded to whole thousandths") {
  CHECK(in_thousandths(0.425F) == 425);
  CHECK(in_thousandths(0.0004F) == 0);
  CHECK(in_thousandths(0.0006F) == 1);
  struct Config {
    float log_odds_free = 1.0F;
    float log_odds_occupied = 2.0F;
    float log_odds_weakly_occupied = 3.0F;
  };
  const EvidenceWeights weights = EvidenceWeights::of(Config{});
  CHECK(weights.free == 1000);
  CHECK(weights.occupied == 2000);
  CHECK(weights.weakly_occupied == 3000);
}
