// Painting of range images on both storages
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "storages.hpp"
#include "unimapper/free_space/range_image.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

RangePainterConfig config() { return {{360.0F, 1.0F, -45.0F, 45.0F, 1.0F}, 1.0F, 50.0F, 3, 1000}; }

template <typename Painter>
std::vector<std::uint16_t> paint(Painter& painter, const std::vector<Eigen::Vector3f>& points) {
  std::vector<std::uint16_t> pixels(painter->projection().pixels(), 1);
  painter->paint(PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f)),
                 pixels.data());
  return pixels;
}

/// Range ahead in the pixel of azimuth and elevation about 0.5 degrees, metres; 0: unknown.
template <typename Painter>
float ahead_m(Painter& painter, const std::vector<Eigen::Vector3f>& points) {
  const float x = 1.0F;
  const float half_degree = 0.0087F;
  std::int32_t pixel = 0;
  float range_m = 0.0F;
  painter->projection().project(&x, &half_degree, &half_degree, 1, &pixel, &range_m);
  return static_cast<float>(paint(painter, points)[static_cast<std::size_t>(pixel)]) /
         kRangeUnitsPerMetre;
}

/// A point at `range_m` whose pixel lies `columns` and `rows` from that of `ahead_m`.
Eigen::Vector3f at(float range_m, int columns, int rows) {
  const float azimuth = 0.01745F * (static_cast<float>(columns) + 0.5F);
  const float elevation = 0.01571F * (static_cast<float>(rows) + 0.5F);  // rows are finer near 0
  return range_m * Eigen::Vector3f(std::cos(azimuth) * std::cos(elevation),
                                   std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
}

}  // namespace

TEMPLATE_TEST_CASE("A pixel holds the smallest range around it if enough returns are there", "",
                   Owned<RangePainter>, OnHeap<RangePainter>) {
  TestType painter(config());
  CHECK(ahead_m(painter, {at(10.0F, 0, 0), at(12.0F, 1, 0)}) == 0.0F);
  CHECK(ahead_m(painter, {at(10.0F, 0, 0), at(12.0F, 1, 0), at(8.0F, -1, 1)}) ==
        Approx(8.0F).margin(0.01));
  CHECK(ahead_m(painter, {at(10.0F, 0, 0), at(12.0F, 1, 0), at(8.0F, -2, 1)}) == 0.0F);
  // Several returns in one pixel are one.
  CHECK(ahead_m(painter, {at(10.0F, 0, 0), at(11.0F, 0, 0), at(12.0F, 0, 0)}) == 0.0F);
}

TEMPLATE_TEST_CASE("Only valid points within the ranges and the limit are painted", "",
                   Owned<RangePainter>, OnHeap<RangePainter>) {
  TestType painter(config());
  const std::vector<Eigen::Vector3f> two{at(10.0F, 0, 0), at(12.0F, 1, 0)};
  const auto with = [&](const Eigen::Vector3f& third) {
    std::vector<Eigen::Vector3f> points = two;
    points.push_back(third);
    return ahead_m(painter, points);
  };
  CHECK(with(at(1.01F, 0, 1)) == Approx(1.01F).margin(0.01));
  CHECK(with(at(0.99F, 0, 1)) == 0.0F);
  CHECK(with(at(49.9F, 0, 1)) == Approx(10.0F).margin(0.01));
  CHECK(with(at(50.1F, 0, 1)) == 0.0F);
  CHECK(with(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN())) == 0.0F);
  CHECK(with(Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity())) == 0.0F);

  std::vector<Eigen::Vector3f> late(998, at(10.0F, 0, 0));
  late.push_back(at(12.0F, 1, 0));
  late.push_back(at(12.0F, 0, 1));
  CHECK(ahead_m(painter, late) == Approx(10.0F).margin(0.01));
  late.insert(late.begin(), at(10.0F, 0, 0));
  CHECK(ahead_m(painter, late) == 0.0F);
}

TEMPLATE_TEST_CASE("The filter goes round where the image does", "", Owned<RangePainter>,
                   OnHeap<RangePainter>) {
  TestType painter(config());
  const auto columns = static_cast<std::size_t>(painter->projection().columns());
  // Three returns about straight behind, to either side of the seam.
  std::vector<Eigen::Vector3f> points;
  for (const float y : {-0.1F, 0.1F, 0.3F}) points.emplace_back(-10.0F, y, 0.05F);
  const std::vector<std::uint16_t> pixels = paint(painter, points);
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    first += i % columns == 0 && pixels[i] != kNoRange ? 1 : 0;
    last += i % columns == columns - 1 && pixels[i] != kNoRange ? 1 : 0;
  }
  CHECK(first + last > 0);
  RangePainterConfig narrow = config();
  narrow.shape.horizontal_fov_deg = 90.0F;
  TestType ahead_only(narrow);
  for (const std::uint16_t pixel : paint(ahead_only, points)) REQUIRE(pixel == kNoRange);
}

TEST_CASE("Both storages paint the same image") {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 900; ++i) {
    const auto f = static_cast<float>(i);
    points.emplace_back(20.0F * std::sin(f), 20.0F * std::cos(1.7F * f), 3.0F * std::sin(0.3F * f));
  }
  Owned<RangePainter> block(config());
  OnHeap<RangePainter> heap(config());
  CHECK(paint(block, points) == paint(heap, points));
}
