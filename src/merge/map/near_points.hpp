// Points by squares of the map
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {

/// Points by squares of the map, so that a keyframe looks at those near it only.
class NearPoints {
 public:
  explicit NearPoints(const std::vector<Eigen::Vector3f>& points) {
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const std::uint32_t number = table_.find_or_insert(pack(square(points[i])));
      if (number == members_.size()) members_.emplace_back();
      members_[number].push_back(i);
    }
  }

  /// Indices of all points within `reach_m`, and of some beyond, ascending.
  /// O(points near by).
  [[nodiscard]] std::vector<std::uint32_t> around(const Eigen::Vector3f& centre,
                                                  float reach_m) const {
    const Eigen::Vector3f reach(reach_m, reach_m, 0.0F);
    const VoxelIndex low = square(centre - reach);
    const VoxelIndex high = square(centre + reach);
    std::vector<std::uint32_t> near;
    const auto take = [&](std::uint32_t number) {
      near.insert(near.end(), members_[number].begin(), members_[number].end());
    };
    const std::int64_t squares =
        (std::int64_t{high.x} - low.x + 1) * (std::int64_t{high.y} - low.y + 1);
    if (squares > static_cast<std::int64_t>(members_.size())) {
      for (std::uint32_t number = 0; number < members_.size(); ++number) take(number);
    } else {
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          const std::uint32_t number = table_.find(pack({x, y, 0}));
          if (number != VoxelTable::kNone) take(number);
        }
      }
    }
    std::sort(near.begin(), near.end());
    return near;
  }

 private:
  static VoxelIndex square(const Eigen::Vector3f& p) {
    constexpr float kInverseSide = 1.0F / 8.0F;
    return {floor_to_int(p.x() * kInverseSide), floor_to_int(p.y() * kInverseSide), 0};
  }
  VoxelTable table_;
  std::vector<std::vector<std::uint32_t>> members_;  ///< by square, ascending
};

}  // namespace unimapper::merge
