// Visibility test and inverse sensor model at their boundaries
#include "tests/random.hpp"
#include "tests/test.hpp"
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

const InverseSensorModel kModel(VisibilityTest(0.3F, 0.01F), {800, 400, 200}, 0.0F);

/// Log-odds of points where everything is free up to `measured_m`.
std::vector<std::int32_t> log_odds(const InverseSensorModel& model, float measured_m,
                                   const std::vector<Eigen::Vector3f>& points,
                                   const Eigen::Matrix3f& rotation = Eigen::Matrix3f::Identity(),
                                   const Eigen::Vector3f& translation = Eigen::Vector3f::Zero()) {
  const ImageProjection projection(kShape);
  const std::vector<std::uint16_t> pixels(projection.pixels(), pixel_of(measured_m));
  std::vector<float> x, y, z;
  for (const Eigen::Vector3f& p : points) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
  std::vector<std::int32_t> sums(points.size(), 7);  // what is known already
  model.add(pixels.data(), projection, rotation, translation,
            {x.data(), y.data(), z.data(), sums.data(), static_cast<std::uint32_t>(x.size())});
  for (std::int32_t& sum : sums) sum -= 7;
  return sums;
}

/// Of a point straight ahead at `range_m`.
std::int32_t log_odds(const InverseSensorModel& model, float range_m, float measured_m) {
  return log_odds(model, measured_m, {{range_m, 0.0F, 0.0F}})[0];
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
  // A quarter turn to the left and two metres ahead: the point's y axis is the sensor's -x axis.
  const Eigen::Matrix3f r = Eigen::AngleAxisf(1.5707963F, Eigen::Vector3f::UnitZ()).matrix();
  CHECK(log_odds(kModel, 10.0F,
                 {{0.0F, -7.0F, 0.0F},  // 9 m ahead
                  {0.0F, -9.0F, 0.0F},  // 11 m ahead, behind what was measured
                  {0.0F, 7.0F, 0.0F},   // behind the sensor
                  {5.0F, 0.0F, 0.0F}},  // beside the field of view
                 r, {2.0F, 0.0F, 0.0F}) == std::vector<std::int32_t>{800, 0, 0, 0});
}

TEST_CASE("Beyond the outermost rays, in the image's slack, nothing is observed") {
  const auto at = [&](float elevation_deg) {
    return log_odds(kModel, 10.0F,
                    {{5.0F * static_cast<float>(cos_deg(elevation_deg)), 0.0F,
                      5.0F * static_cast<float>(sin_deg(elevation_deg))}})[0];
  };
  CHECK(at(43.9F) == 800);
  CHECK(at(44.1F) == 0);
  CHECK(at(-43.9F) == 800);
  CHECK(at(-44.1F) == 0);
}

TEST_CASE("More points than a batch are all observed") {
  const std::vector<Eigen::Vector3f> points(1000, {5.0F, 0.0F, 0.0F});
  CHECK((log_odds(kModel, 10.0F, points) == std::vector<std::int32_t>(1000, 800)));
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
    for (const VectorWidth width : {VectorWidth::kAvx2, VectorWidth::kAvx512}) {
      if (width <= widest_vectors()) CHECK(learnt(width) == baseline);
    }
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
