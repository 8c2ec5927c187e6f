// Labels of points by the refined labels of their cells.
#include "src/apps/merge/cell_labels.hpp"

#include <algorithm>
#include <limits>

namespace unimapper::apps {
namespace {

// Twice as wide as a cell: what is nearest to a point lies in one of the eight bins around it.
constexpr float kBinCells = 2.0F;
// A point farther than this from every mean was left out of the keyframe.
constexpr float kFarthestCells = 1.8F;

}  // namespace

CellLabels::CellLabels(const KeyframeRecord& keyframe, const merge::RefinedKeyframe& refined,
                       float cell_size_m)
    : bin_m_(kBinCells * cell_size_m), farthest_m_(kFarthestCells * cell_size_m) {
  for (const bool dynamic : {false, true}) {
    merge::visit_cells(keyframe, refined, dynamic, [&](const FineCell& cell) {
      const VoxelIndex bin = voxel_index(cell.position, 1.0F / bin_m_);
      if (is_representable(bin)) entries_.push_back({pack(bin), cell.position, dynamic});
    });
  }
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.bin < b.bin; });
  for (std::uint32_t i = 0; i < entries_.size(); ++i) first_.try_emplace(entries_[i].bin, i);
}

bool CellLabels::is_dynamic(const Eigen::Vector3f& point) const {
  const VoxelIndex low =
      voxel_index(point - Eigen::Vector3f::Constant(0.5F * bin_m_), 1.0F / bin_m_);
  float nearest = farthest_m_ * farthest_m_;
  bool dynamic = false;
  for (int n = 0; n < 8; ++n) {
    const VoxelIndex bin{low.x + (n & 1), low.y + (n >> 1 & 1), low.z + (n >> 2)};
    if (!is_representable(bin)) continue;
    const auto found = first_.find(pack(bin));
    if (found == first_.end()) continue;
    for (std::size_t i = found->second; i < entries_.size() && entries_[i].bin == found->first;
         ++i) {
      const float distance = (entries_[i].position - point).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      dynamic = entries_[i].dynamic;
    }
  }
  return dynamic;
}

}  // namespace unimapper::apps
