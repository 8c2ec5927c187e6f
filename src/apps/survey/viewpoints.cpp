#include "src/apps/survey/viewpoints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace unimapper::apps {
namespace {

constexpr float kCellM = 0.5F;
constexpr double kMostCells = 1 << 26;
constexpr std::size_t kMostViewpoints = 20000;
constexpr float kUnknown = std::numeric_limits<float>::infinity();
/// Of the nine cells of a neighbourhood so many must have points, within this height.
constexpr std::size_t kFewestNeighbors = 6;
constexpr float kGroundStepM = 0.25F;
/// What is lower above the ground is no obstacle: kerbs, grass.
constexpr float kLowestObstacleM = 0.4F;
/// Distance in cells beyond which an obstacle is far enough.
constexpr int kFarCells = 8;

/// A raster of the surveyed place seen from above.
class Raster {
 public:
  explicit Raster(const std::vector<Eigen::Vector3f>& points) {
    Eigen::Vector2f high = points.front().head<2>();
    low_ = high;
    for (const Eigen::Vector3f& point : points) {
      low_ = low_.cwiseMin(point.head<2>());
      high = high.cwiseMax(point.head<2>());
    }
    const Eigen::Vector2f extent = high - low_;
    width_ = static_cast<int>(extent.x() / kCellM) + 1;
    height_ = static_cast<int>(extent.y() / kCellM) + 1;
    if (static_cast<double>(width_) * height_ > kMostCells) {
      throw std::runtime_error("the survey extends over " + std::to_string(width_ / 2) + " m by " +
                               std::to_string(height_ / 2) + " m: cut it into parts");
    }
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t cells() const { return static_cast<std::size_t>(width_) * height_; }
  [[nodiscard]] std::size_t cell(int x, int y) const {
    return static_cast<std::size_t>(y) * width_ + x;
  }
  [[nodiscard]] std::size_t cell_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector2f from_low = (point.head<2>() - low_) / kCellM;
    return cell(static_cast<int>(from_low.x()), static_cast<int>(from_low.y()));
  }
  [[nodiscard]] Eigen::Vector2f center(int x, int y) const {
    return low_ +
           kCellM * Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
  }
  /// Calls `take` with the cells about one, itself among them.
  template <typename Take>
  void for_each_neighbor(int x, int y, const Take& take) const {
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) take(cell(u, v));
    }
  }

 private:
  Eigen::Vector2f low_;
  int width_ = 0;
  int height_ = 0;
};

/// Heights of the lowest points; `kUnknown` without any.
std::vector<float> lowest(const Raster& raster, const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> heights(raster.cells(), kUnknown);
  for (const Eigen::Vector3f& point : points) {
    float& height = heights[raster.cell_of(point)];
    height = std::min(height, point.z());
  }
  return heights;
}

/// Of each cell the median of the lowest points about it, `kUnknown` where they are too few or
/// too far from each other to be ground.
std::vector<float> ground_of(const Raster& raster, const std::vector<float>& lowest) {
  std::vector<float> ground(raster.cells(), kUnknown);
  std::vector<float> near;
  for (int y = 0; y < raster.height(); ++y) {
    for (int x = 0; x < raster.width(); ++x) {
      near.clear();
      raster.for_each_neighbor(x, y, [&](std::size_t cell) {
        if (lowest[cell] != kUnknown) near.push_back(lowest[cell]);
      });
      if (near.size() < kFewestNeighbors) continue;
      const auto middle = near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2);
      std::nth_element(near.begin(), middle, near.end());
      const float median = *middle;
      const auto is_level = [median](float z) { return std::abs(z - median) < kGroundStepM; };
      const auto level = std::count_if(near.begin(), near.end(), is_level);
      if (static_cast<std::size_t>(level) < kFewestNeighbors) continue;
      ground[raster.cell(x, y)] = median;
    }
  }
  return ground;
}

/// Cells of ground with nothing in the way up to a height.
std::vector<bool> free_cells(const Raster& raster, const std::vector<Eigen::Vector3f>& points,
                             const std::vector<float>& ground, float height_m) {
  std::vector<bool> is_free(raster.cells());
  for (std::size_t cell = 0; cell < raster.cells(); ++cell)
    is_free[cell] = ground[cell] != kUnknown;
  for (const Eigen::Vector3f& point : points) {
    const std::size_t cell = raster.cell_of(point);
    const float above = point.z() - ground[cell];
    if (above > kLowestObstacleM && above < height_m) is_free[cell] = false;
  }
  return is_free;
}

/// Steps from each cell to the nearest that is not free, at most `kFarCells`; outside of the raster
/// nothing is free.
std::vector<int> clearances(const Raster& raster, const std::vector<bool>& is_free) {
  std::vector<int> steps(raster.cells(), 0);
  for (int step = 1; step <= kFarCells; ++step) {
    std::vector<int> next = steps;
    for (int y = 1; y + 1 < raster.height(); ++y) {
      for (int x = 1; x + 1 < raster.width(); ++x) {
        const std::size_t cell = raster.cell(x, y);
        if (!is_free[cell] || steps[cell] != step - 1) continue;
        bool is_farther = true;
        raster.for_each_neighbor(x, y, [&](std::size_t other) {
          is_farther = is_farther && is_free[other] && steps[other] >= step - 1;
        });
        if (is_farther || step == 1) next[cell] = step;
      }
    }
    steps = std::move(next);
  }
  return steps;
}

/// From the first to the nearest of the others, and so on.
std::vector<Eigen::Vector3f> in_order(std::vector<Eigen::Vector3f> places) {
  for (std::size_t i = 1; i < places.size(); ++i) {
    std::size_t nearest = i;
    for (std::size_t k = i + 1; k < places.size(); ++k) {
      const float distance = (places[k] - places[i - 1]).squaredNorm();
      if (distance < (places[nearest] - places[i - 1]).squaredNorm()) nearest = k;
    }
    std::swap(places[i], places[nearest]);
  }
  return places;
}

}  // namespace

std::vector<Eigen::Vector3f> viewpoints(const std::vector<Eigen::Vector3f>& points,
                                        const ViewpointOptions& options) {
  const Raster raster(points);
  const std::vector<float> ground = ground_of(raster, lowest(raster, points));
  const auto height_m = static_cast<float>(options.height_m);
  const std::vector<int> clearance =
      clearances(raster, free_cells(raster, points, ground, height_m + kGroundStepM));
  struct Best {
    int clearance = 0;
    float to_center = 0.0F;
    Eigen::Vector3f place;
  };
  std::map<std::pair<int, int>, Best> squares;
  const auto spacing = static_cast<float>(options.spacing_m);
  for (int y = 0; y < raster.height(); ++y) {
    for (int x = 0; x < raster.width(); ++x) {
      const std::size_t cell = raster.cell(x, y);
      // One step: beside an obstacle.
      if (clearance[cell] < 2) continue;
      const Eigen::Vector2f at = raster.center(x, y);
      const Eigen::Vector2f square = (at / spacing).array().floor();
      const float to_center = (at / spacing - square - Eigen::Vector2f(0.5F, 0.5F)).norm();
      Best& best = squares[{static_cast<int>(square.x()), static_cast<int>(square.y())}];
      const bool is_better = clearance[cell] != best.clearance ? clearance[cell] > best.clearance
                                                               : to_center < best.to_center;
      if (is_better) {
        best = {clearance[cell], to_center, {at.x(), at.y(), ground[cell] + height_m}};
      }
    }
  }
  if (squares.size() > kMostViewpoints) {
    throw std::runtime_error("the survey has " + std::to_string(squares.size()) +
                             " viewpoints, more than " + std::to_string(kMostViewpoints) +
                             ": cut it into parts, or raise --spacing");
  }
  std::vector<Eigen::Vector3f> places;
  places.reserve(squares.size());
  for (const auto& [square, best] : squares) places.push_back(best.place);
  return in_order(std::move(places));
}

}  // namespace unimapper::apps
