// Painting of range images on both storages
#include "storages.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"
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

/// A point at `range_m` in the middle of a pixel, found by trying directions.
Eigen::Vector3f in_pixel(const ImageProjection& projection, float range_m, std::int32_t column,
                         std::int32_t row) {
  const auto pixel_of = [&](const Eigen::Vector3f& p) {
    std::int32_t pixel = 0;
    float range = 0.0F;
    projection.project(&p.x(), &p.y(), &p.z(), 1, &pixel, &range);
    return pixel;
  };
  for (float azimuth = -3.14F; azimuth < 3.14F; azimuth += 0.005F) {
    const Eigen::Vector3f level(std::cos(azimuth), std::sin(azimuth), 0.0F);
    const std::int32_t pixel = pixel_of(level);
    if (pixel == ImageProjection::kOutside || pixel % projection.columns() != column) continue;
    for (float z = -0.99F; z < 0.99F; z += 0.005F) {
      const Eigen::Vector3f point = (level + Eigen::Vector3f(0.0F, 0.0F, z)).normalized();
      if (pixel_of(point) == row * projection.columns() + column) return range_m * point;
    }
  }
  FAIL("no direction falls into the pixel");
  return {};
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

TEMPLATE_TEST_CASE("Between two rings a ceiling is no farther than at the steeper ring", "",
                   Owned<RangePainter>, OnHeap<RangePainter>) {
  TestType painter(config());
  // Rings at half a degree and two rows above, each a third of the azimuth's pixels wide.
  const auto rings = [](float range_m, float steeper_range_m) {
    std::vector<Eigen::Vector3f> points;
    for (int column = -1; column <= 1; ++column) {
      points.push_back(at(range_m, column, 0));
      points.push_back(at(steeper_range_m, column, 2));
    }
    return points;
  };
  // 0.16 m above the sensor.
  CHECK(ahead_m(painter, rings(20.0F, 4.0F)) == Approx(4.0F).margin(0.01));
  // What is steeper is 0.8 m above it: a sign.
  CHECK(ahead_m(painter, rings(20.0F, 19.0F)) == Approx(20.0F).margin(0.01));
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

TEST_CASE("A return reaches the eight pixels around its own, across the seam of a full turn only") {
  for (const float horizontal_fov_deg : {360.0F, 90.0F}) {
    RangePainterConfig alone = config();
    alone.shape.horizontal_fov_deg = horizontal_fov_deg;
    alone.min_returns = 1;
    Owned<RangePainter> painter(alone);
    const ImageProjection& projection = painter->projection();
    const std::int32_t columns = projection.columns();
    const std::int32_t rows = projection.rows();
    const bool full_turn = horizontal_fov_deg == 360.0F;
    REQUIRE(projection.wraps() == full_turn);
    for (const std::int32_t column : {0, 1, columns / 2, columns - 2, columns - 1}) {
      for (const std::int32_t row : {0, 1, rows - 2, rows - 1}) {
        INFO("column " << column << " of " << columns << ", row " << row << " of " << rows);
        const std::vector<std::uint16_t> pixels =
            paint(painter, {in_pixel(projection, 10.0F, column, row)});
        for (std::int32_t i = 0; i < columns * rows; ++i) {
          const std::int32_t aside = std::abs(i % columns - column);
          const bool beside = aside <= 1 || (full_turn && aside == columns - 1);
          const bool reached = beside && std::abs(i / columns - row) <= 1;
          if ((pixels[static_cast<std::size_t>(i)] != kNoRange) != reached) FAIL("pixel " << i);
        }
      }
    }
  }
}

TEST_CASE("Returns on both sides of the seam count together, and the smaller range is painted") {
  RangePainterConfig two = config();
  two.min_returns = 2;
  Owned<RangePainter> painter(two);
  const ImageProjection& projection = painter->projection();
  const std::int32_t columns = projection.columns();
  const std::int32_t row = projection.rows() / 2;
  // Only the column between two returns sees both of them.
  const auto check = [&](std::int32_t near, std::int32_t far, std::int32_t between) {
    const std::vector<std::uint16_t> pixels = paint(
        painter, {in_pixel(projection, 8.0F, near, row), in_pixel(projection, 12.0F, far, row)});
    for (std::int32_t column = 0; column < columns; ++column) {
      const float range_m =
          static_cast<float>(pixels[static_cast<std::size_t>(row * columns + column)]) /
          kRangeUnitsPerMetre;
      INFO("column " << column);
      REQUIRE(range_m == Approx(column == between ? 8.0F : 0.0F).margin(0.01));
    }
  };
  check(0, columns - 2, columns - 1);
  check(columns - 2, 0, columns - 1);
  check(columns - 1, 1, 0);
  check(1, columns - 1, 0);
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
