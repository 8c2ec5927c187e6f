#include "src/apps/evaluate/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "src/apps/evaluate/outcome_raster.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::apps {
namespace {

constexpr double kWidth = 1600.0;
constexpr double kHeight = 320.0;
constexpr double kFinestDegrees = 0.05;
constexpr double kFarM = 80.0;

struct Direction {
  double left_deg = 0.0;
  double up_deg = 0.0;
};

Direction direction_of(const Eigen::Vector3f& point) {
  const Eigen::Vector3d p = point.cast<double>();
  return {kDegreesPerRadian * std::atan2(p.y(), p.x()),
          kDegreesPerRadian * std::atan2(p.z(), p.head<2>().norm())};
}

/// Field of view of a scan and its mapping to pixels.
class Angles {
 public:
  explicit Angles(const evaluate::ScoredScan& scan) {
    for (const Eigen::Vector3f& point : scan.points) {
      if (point.allFinite()) add(direction_of(point));
    }
    columns_per_degree_ = 1.0 / std::max(kFinestDegrees, (leftmost_ - rightmost_) / kWidth);
    rows_per_degree_ = 1.0 / std::max(kFinestDegrees, (highest_ - lowest_) / kHeight);
  }

  [[nodiscard]] long column(const Direction& d) const {
    return static_cast<long>((leftmost_ - d.left_deg) * columns_per_degree_);
  }
  [[nodiscard]] long row(const Direction& d) const {
    return static_cast<long>((highest_ - d.up_deg) * rows_per_degree_);
  }
  [[nodiscard]] std::size_t width() const {
    return static_cast<std::size_t>(column({rightmost_, 0.0})) + 1;
  }
  [[nodiscard]] std::size_t height() const {
    return static_cast<std::size_t>(row({0.0, lowest_})) + 1;
  }

 private:
  void add(const Direction& d) {
    if (is_empty_) leftmost_ = rightmost_ = d.left_deg, highest_ = lowest_ = d.up_deg;
    is_empty_ = false;
    leftmost_ = std::max(leftmost_, d.left_deg);
    rightmost_ = std::min(rightmost_, d.left_deg);
    highest_ = std::max(highest_, d.up_deg);
    lowest_ = std::min(lowest_, d.up_deg);
  }

  bool is_empty_ = true;
  double leftmost_ = 0.0;
  double rightmost_ = 0.0;
  double highest_ = 0.0;
  double lowest_ = 0.0;
  double columns_per_degree_ = 1.0;
  double rows_per_degree_ = 1.0;
};

/// Rows per occupied row: about the gap between a sensor's rings.
long ring_gap(const evaluate::ScoredScan& scan, const Angles& angles) {
  constexpr std::size_t kWidestGap = 8;
  std::vector<bool> filled(angles.width() * angles.height());
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) continue;
    const Direction direction = direction_of(point);
    filled[static_cast<std::size_t>(angles.row(direction)) * angles.width() +
           static_cast<std::size_t>(angles.column(direction))] = true;
  }
  // Rays may be as far apart as two columns, and each point is drawn that wide.
  const auto points = 2 * static_cast<std::size_t>(std::count(filled.begin(), filled.end(), true));
  const std::size_t rows = (filled.size() + points / 2) / std::max<std::size_t>(1, points);
  return static_cast<long>(std::clamp<std::size_t>(rows, 1, kWidestGap));
}

}  // namespace

Image draw_range_image(const evaluate::ScoredScan& scan) {
  const Angles angles(scan);
  const long gap = ring_gap(scan, angles);
  OutcomeRaster raster(angles.width(), angles.height());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!scan.points[i].allFinite()) continue;
    const Direction direction = direction_of(scan.points[i]);
    const double range = static_cast<double>(scan.points[i].norm());
    raster.mark(angles.column(direction), angles.row(direction) - gap / 2, 2, gap,
                outcome_of(scan.truth[i], scan.predicted[i]),
                static_cast<float>(1.0 - std::sqrt(range / kFarM)));
  }
  return raster.paint();
}

}  // namespace unimapper::apps
