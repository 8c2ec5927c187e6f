// Tests of triangle formation and keys.
#include "src/place/triangles.hpp"

#include "src/core/voxel_key.hpp"
#include "synthetic_place.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;
using test::Random;

Keypoint keypoint(float x, float y, const Eigen::Vector3f& normal = {0, 0, 1}) {
  Keypoint k{};
  k.position = {x, y, 0.0F};
  k.normal = normal;
  k.occupancy = 1;
  return k;
}

struct Triangles {
  explicit Triangles(std::size_t capacity = 4096) : out(capacity) {}
  std::span<const Triangle> build(const std::vector<Keypoint>& keypoints) {
    build_triangles(keypoints, TriangleConfig{}, *out);
    return out->view();
  }
  Owned<FixedVector<Triangle>> out;
};

std::vector<Keypoint> scattered(std::uint64_t seed, int count) {
  Random random(seed);
  std::vector<Keypoint> keypoints;
  for (int i = 0; i < count; ++i) {
    keypoints.push_back(keypoint(static_cast<float>(random.uniform(-40, 40)),
                                 static_cast<float>(random.uniform(-40, 40))));
  }
  return keypoints;
}

// The six attributes without the names of the vertices.
std::multiset<std::vector<int>> keys(std::span<const Triangle> triangles) {
  std::multiset<std::vector<int>> result;
  for (const Triangle& t : triangles) {
    result.insert(
        {t.side_cm[0], t.side_cm[1], t.side_cm[2], t.dot[0], t.dot[1], t.dot[2], t.left_handed});
  }
  return result;
}

}  // namespace

TEST_CASE("a 6-8-10 triangle has the key it must have") {
  // Right angle at the first corner; its walls meet at right angles, the third faces 60 degrees
  // off.
  const std::vector<Keypoint> keypoints = {
      keypoint(0, 0, {1, 0, 0}),
      keypoint(6, 0, {0, 1, 0}),
      keypoint(0, 8, {0.5F, 0.8660254F, 0}),
  };
  Triangles triangles;
  const auto found = triangles.build(keypoints);
  REQUIRE(found.size() == 1);
  const Triangle& t = found[0];
  CHECK(t.side_cm[0] == 600);
  CHECK(t.side_cm[1] == 800);
  CHECK(t.side_cm[2] == 1000);
  // Each vertex lies opposite its side.
  CHECK(t.vertex[0] == 2);
  CHECK(t.vertex[1] == 1);
  CHECK(t.vertex[2] == 0);
  CHECK(t.dot[0] == 0);    // x against y
  CHECK(t.dot[1] == 128);  // x against 60 degrees: 0.5
  CHECK(t.dot[2] == 221);  // y against 60 degrees: 0.866
  CHECK(t.left_handed == 1);
  // From (0, 8) to (6, 0): -53.13 degrees, in 1/65536 turn.
  CHECK(static_cast<int>(t.heading) == Approx(65536 * (1 - 53.1301 / 360)).margin(2.0));
  CHECK(t.center_cm[0] == 200);
  CHECK(t.center_cm[1] == 267);
}

TEST_CASE("the keys of a known place are these, on every machine") {
  // Integers only, so that no rounding of the test's own comes in between.
  std::vector<Keypoint> keypoints;
  for (int i = 0; i < 12; ++i) {
    Keypoint k = keypoint(static_cast<float>((i * 37) % 41), static_cast<float>((i * 23) % 29),
                          i % 2 == 0 ? Eigen::Vector3f(1, 0, 0) : Eigen::Vector3f(0.6F, 0.8F, 0));
    k.occupancy = 0x0123456789ABCDEFULL >> (4 * (i % 8));
    keypoints.push_back(k);
  }
  Triangles triangles;
  const auto found = triangles.build(keypoints);
  std::uint64_t sum = 0;
  const auto mix = [&sum](std::uint64_t value) { sum = mix_bits(sum ^ value) + value; };
  for (const Triangle& t : found) {
    for (int i = 0; i < 3; ++i) {
      mix(t.side_cm[i]);
      mix(t.vertex[i]);
      mix(t.dot[i]);
      mix(t.sketch[i]);
    }
    mix(t.left_handed);
    mix(t.heading);
    mix(static_cast<std::uint16_t>(t.center_cm[0]));
    mix(static_cast<std::uint16_t>(t.center_cm[1]));
  }
  // Pinned. Whoever changes them on purpose changes what robots and base stations agree on.
  CHECK(found.size() == 171);
  CHECK(sum == 0x4FC8B879D60200A6ULL);
}

TEST_CASE("the order and the position of the keypoints do not change the keys") {
  std::vector<Keypoint> keypoints = scattered(5, 60);
  Triangles triangles;
  const auto before = keys(triangles.build(keypoints));
  REQUIRE(before.size() > 300);
  std::reverse(keypoints.begin(), keypoints.end());
  std::rotate(keypoints.begin(), keypoints.begin() + 17, keypoints.end());
  REQUIRE(keys(triangles.build(keypoints)) == before);

  // A quarter turn is exact in floating point.
  for (Keypoint& k : keypoints) k.position = {-k.position.y(), k.position.x(), k.position.z()};
  REQUIRE(keys(triangles.build(keypoints)) == before);
}

TEST_CASE("a mirror image has other keys") {
  std::vector<Keypoint> keypoints = scattered(6, 40);
  Triangles triangles;
  const auto before = keys(triangles.build(keypoints));
  for (Keypoint& k : keypoints) k.position.x() = -k.position.x();
  const auto after = keys(triangles.build(keypoints));
  REQUIRE(after.size() == before.size());
  std::size_t common = 0;
  for (const auto& key : after) common += before.count(key) > 0 ? 1 : 0;
  REQUIRE(common < before.size() / 50);
}

TEST_CASE("each set of three keypoints makes one triangle") {
  Triangles triangles;
  std::set<std::set<int>> seen;
  for (const Triangle& t : triangles.build(scattered(7, 80))) {
    REQUIRE(seen.insert({t.vertex[0], t.vertex[1], t.vertex[2]}).second);
    REQUIRE(t.side_cm[0] <= t.side_cm[1]);
    REQUIRE(t.side_cm[1] <= t.side_cm[2]);
  }
}

TEST_CASE("flat, small and large triangles, equal and non-finite keypoints are left out") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  Triangles triangles;
  for (const std::vector<Keypoint>& keypoints :
       std::vector<std::vector<Keypoint>>{{keypoint(0, 0), keypoint(10, 0.1F), keypoint(20, 0)},
                                          {keypoint(0, 0), keypoint(1, 0), keypoint(0, 1)},
                                          {keypoint(0, 0), keypoint(90, 0), keypoint(0, 90)},
                                          {},
                                          {keypoint(1, 2)},
                                          {keypoint(1, 2), keypoint(9, 2)},
                                          std::vector<Keypoint>(20, keypoint(3, 3)),
                                          {keypoint(nan, 0), keypoint(6, 0), keypoint(0, 8)},
                                          {keypoint(inf, 0), keypoint(6, 0), keypoint(0, 8)}}) {
    CHECK(triangles.build(keypoints).empty());
  }
}

TEST_CASE("more keypoints than an index can name and more triangles than fit are cut off") {
  Triangles triangles(100);
  REQUIRE(triangles.build(scattered(8, 400)).size() == 100);
  REQUIRE(triangles.out->refused() > 0);
}
