#include "src/apps/survey/visible_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unimapper::apps {
namespace {

constexpr int kColumns = 720;
constexpr int kRows = 360;
constexpr float kPi = 3.14159265F;
constexpr float kPixelRad = 2.0F * kPi / kColumns;
constexpr float kHalfWidthM = 0.15F;
constexpr float kMarginM = 0.3F;
constexpr float kMarginRelative = 0.1F;
constexpr float kNearestM = 0.5F;

/// Nearest range in every direction.
class DepthImage {
 public:
  DepthImage() : ranges_(std::size_t{kColumns} * kRows, std::numeric_limits<float>::infinity()) {}

  void add(const Eigen::Vector3f& point, float range) {
    const auto [column, row] = pixel_of(point, range);
    const float angle = kHalfWidthM / range;
    const int high = static_cast<int>(angle / kPixelRad);
    // Towards the poles columns are narrower.
    const float level = std::max(point.head<2>().norm(), 0.1F * range) / range;
    const int wide = std::min(static_cast<int>(angle / level / kPixelRad), kColumns / 4);
    for (int v = std::max(row - high, 0); v <= std::min(row + high, kRows - 1); ++v) {
      for (int u = column - wide; u <= column + wide; ++u) {
        float& nearest = ranges_[pixel((u + kColumns) % kColumns, v)];
        nearest = std::min(nearest, range);
      }
    }
  }
  [[nodiscard]] bool shows(const Eigen::Vector3f& point, float range) const {
    const auto [column, row] = pixel_of(point, range);
    const float nearest = ranges_[pixel(column, row)];
    return range <= nearest + kMarginM + kMarginRelative * nearest;
  }

 private:
  static std::size_t pixel(int column, int row) {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }
  static std::pair<int, int> pixel_of(const Eigen::Vector3f& point, float range) {
    const float azimuth = std::atan2(point.y(), point.x()) + kPi;
    const float elevation = std::asin(std::clamp(point.z() / range, -1.0F, 1.0F)) + 0.5F * kPi;
    return {std::min(static_cast<int>(azimuth / kPixelRad), kColumns - 1),
            std::min(static_cast<int>(elevation / kPixelRad), kRows - 1)};
  }

  std::vector<float> ranges_;
};

}  // namespace

std::vector<Eigen::Vector3f> visible_points(const PointTiles& cloud,
                                            const Eigen::Vector3f& viewpoint, float range_m) {
  DepthImage image;
  std::vector<Eigen::Vector3f> points;
  cloud.for_each_near(viewpoint.head<2>(), range_m, [&](const Eigen::Vector3f& point) {
    const Eigen::Vector3f seen = point - viewpoint;
    const float range = seen.norm();
    if (range < kNearestM || range > range_m) return;
    points.push_back(seen);
    image.add(seen, range);
  });
  std::erase_if(points,
                [&](const Eigen::Vector3f& point) { return !image.shows(point, point.norm()); });
  return points;
}

}  // namespace unimapper::apps
