#include "free_space_view.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::merge {
namespace {

constexpr float kPixelsPerRadian = 240.0F / 6.28318531F;
constexpr float kMaxRangeM = 650.0F;

}  // namespace

void FreeSpaceView::pixel(const Eigen::Vector3f& point, int& column, int& row) {
  const float azimuth = std::atan2(point.y(), point.x());
  const float elevation = std::atan2(point.z(), point.head<2>().norm());
  column = static_cast<int>(std::floor(azimuth * kPixelsPerRadian)) + kColumns / 2;
  column = (column + kColumns) % kColumns;
  row = static_cast<int>(std::floor(elevation * kPixelsPerRadian)) + kRows / 2;
  if (row < 0 || row >= kRows) row = -1;
}

FreeSpaceView::FreeSpaceView(const KeyframeRecord& keyframe)
    : range_cm_(static_cast<std::size_t>(kColumns) * kRows, 0) {
  const auto add = [&](const FineCell& cell) {
    const float range = cell.position.norm();
    if (!(range > 0.1F && range < kMaxRangeM)) return;
    int column = 0;
    int row = 0;
    pixel(cell.position, column, row);
    if (row < 0) return;
    auto& nearest = range_cm_[index_of(row, column)];
    const auto cm = static_cast<std::uint16_t>(range * 100.0F);
    if (nearest == 0 || cm < nearest) nearest = cm;
  };
  for (const auto& cell : keyframe.static_cells) add(cell);
  for (const auto& cell : keyframe.dynamic_cells) add(cell);
}

Visibility FreeSpaceView::look(const Eigen::Vector3f& point, float margin_m) const {
  const float range = point.norm();
  if (!(range > 0.5F && range < kMaxRangeM)) return Visibility::kUnknown;
  int column = 0;
  int row = 0;
  pixel(point, column, row);
  if (row < 1 || row >= kRows - 1) return Visibility::kUnknown;
  int seen = 0;
  float nearest = kMaxRangeM;
  for (int dr = -1; dr <= 1; ++dr) {
    for (int dc = -1; dc <= 1; ++dc) {
      const int c = (column + dc + kColumns) % kColumns;
      const auto cm = range_cm_[index_of(row + dr, c)];
      if (cm == 0) continue;
      ++seen;
      nearest = std::min(nearest, static_cast<float>(cm) * 0.01F);
    }
  }
  if (seen < 6) return Visibility::kUnknown;
  if (range < nearest - margin_m) return Visibility::kFree;
  return range < nearest + margin_m ? Visibility::kOccupied : Visibility::kUnknown;
}

double FreeSpaceView::field_of_view() const {
  const auto seen =
      std::count_if(range_cm_.begin(), range_cm_.end(), [](std::uint16_t cm) { return cm != 0; });
  return static_cast<double>(seen) / static_cast<double>(range_cm_.size());
}

}  // namespace unimapper::merge
