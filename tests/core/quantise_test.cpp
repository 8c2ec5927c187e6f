// Quantisation of positions and normals
#include "src/core/quantise.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Every coordinate in [-1, 1].
Eigen::Vector3f random_vector(test::Random& random) {
  const float x = static_cast<float>(random.uniform(-1.0, 1.0));
  const float y = static_cast<float>(random.uniform(-1.0, 1.0));
  return {x, y, static_cast<float>(random.uniform(-1.0, 1.0))};
}

}  // namespace

TEST_CASE("a normal survives quantisation to better than a ten-thousandth of a radian") {
  test::Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f normal = random_vector(random).normalized();
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
  test::Random random(2);
  for (int i = 0; i < 200000; ++i) {
    const int u = static_cast<int>(random.below(65535)) - 32767;
    const int v = static_cast<int>(random.below(65535)) - 32767;
    if (!returns_to_itself(u, v)) FAIL("code " << u << ", " << v);
  }
  constexpr std::int16_t kLowest = std::numeric_limits<std::int16_t>::min();
  CHECK_FALSE(is_canonical({kLowest, 0}));
  CHECK_FALSE(is_canonical({0, kLowest}));
}

TEST_CASE("the axes are exact, and what is no normal has no code") {
  for (int axis = 0; axis < 3; ++axis) {
    for (float sign : {1.0F, -1.0F}) {
      const Eigen::Vector3f normal = sign * Eigen::Vector3f::Unit(axis);
      CHECK((unit_vector(*octahedral(normal)) - normal).norm() < 1e-7F);
    }
  }
  CHECK_FALSE(octahedral({0.0F, 0.0F, 0.0F}));
  CHECK_FALSE(octahedral({kNan, 0.0F, 1.0F}));
  CHECK_FALSE(octahedral({kInfinity, 0.0F, 1.0F}));
}

TEST_CASE("of two codes on the rim that mean one normal the one without a minus is used") {
  constexpr std::int16_t kRim = 32767;
  for (const std::int16_t rim : {kRim, static_cast<std::int16_t>(-kRim)}) {
    for (const std::int16_t along : {std::int16_t{1}, std::int16_t{12345}, kRim}) {
      const auto minus = static_cast<std::int16_t>(-along);
      CHECK(unit_vector({rim, along}) == unit_vector({rim, minus}));
      CHECK(unit_vector({along, rim}) == unit_vector({minus, rim}));
      if (along == kRim) continue;  // a corner: both coordinates lie on the rim
      CHECK(is_canonical({rim, along}));
      CHECK_FALSE(is_canonical({rim, minus}));
      CHECK(is_canonical({along, rim}));
      CHECK_FALSE(is_canonical({minus, rim}));
      CHECK(octahedral(unit_vector({minus, rim})) == OctahedralNormal{along, rim});
      CHECK(octahedral(unit_vector({rim, minus})) == OctahedralNormal{rim, along});
    }
  }
  // One step inside the rim a sign tells two normals apart.
  CHECK(is_canonical({-5, kRim - 1}));
  CHECK(is_canonical({kRim - 1, -5}));
  // Straight down, of four corners.
  CHECK(octahedral({0.0F, 0.0F, -1.0F}) == OctahedralNormal{kRim, kRim});
  CHECK(is_canonical({kRim, kRim}));
  CHECK_FALSE(is_canonical({-kRim, kRim}));
  CHECK_FALSE(is_canonical({kRim, -kRim}));
  CHECK_FALSE(is_canonical({-kRim, -kRim}));
}

TEST_CASE("positions go to the nearest step of the grid and come back as it") {
  const Eigen::Vector3f position(1.2344F, -1.2346F, 0.0004F);
  CHECK(to_millimetres(position) == Eigen::Vector3i(1234, -1235, 0));
  CHECK(to_centimetres(position) == Eigen::Vector3i(123, -123, 0));
  CHECK(from_millimetres({1234, -1235, 0}) == Eigen::Vector3f(1.234F, -1.235F, 0.0F));
  CHECK(from_centimetres({123, -123, 0}) == Eigen::Vector3f(1.23F, -1.23F, 0.0F));
  // Halfway it is the upper one. These halves are exact.
  CHECK(to_millimetres({0.0625F, -0.0625F, 0.1875F}) == Eigen::Vector3i(63, -62, 188));
  CHECK(to_centimetres({0.125F, -0.125F, 0.375F}) == Eigen::Vector3i(13, -12, 38));
}

TEST_CASE("every step of the grid is its own nearest") {
  for (std::int32_t step = -32768; step <= 32767; ++step) {
    const Eigen::Vector3i steps(step, -step / 2, 0);
    if (to_centimetres(from_centimetres(steps)) != steps) FAIL(step << " cm");
  }
  for (std::int32_t step = -kMillimetreLimit; step <= kMillimetreLimit; step += 37) {
    const Eigen::Vector3i steps(step, 0, -step);
    if (to_millimetres(from_millimetres(steps)) != steps) FAIL(step << " mm");
  }
}

TEST_CASE("positions are quantised up to the last step on every axis and not beyond") {
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [axis](float value) {
      Eigen::Vector3f position = Eigen::Vector3f::Zero();
      position[axis] = value;
      return position;
    };
    CHECK(to_millimetres(at(1000.0F)));
    CHECK(to_millimetres(at(-1000.0F)));
    CHECK_FALSE(to_millimetres(at(1000.001F)));
    CHECK_FALSE(to_millimetres(at(-1000.001F)));
    CHECK(to_centimetres(at(327.67F)));
    CHECK(to_centimetres(at(-327.68F)));
    CHECK_FALSE(to_centimetres(at(327.68F)));
    CHECK_FALSE(to_centimetres(at(-327.69F)));
    for (const float none : {kNan, kInfinity, -kInfinity, 3e38F}) {
      CHECK_FALSE(to_millimetres(at(none)));
      CHECK_FALSE(to_centimetres(at(none)));
    }
  }
}
