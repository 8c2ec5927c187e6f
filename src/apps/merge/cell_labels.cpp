// Labels of points by the refined labels of their cells.
#include "src/apps/merge/cell_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "src/free_space/feet.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::apps {
namespace {

// Twice as wide as a cell: what is nearest to a point lies in one of the eight bins around it.
constexpr float kBinCells = 2.0F;
// A point farther than this from every mean was left out of the keyframe.
constexpr float kFarthestCells = 1.8F;

constexpr float kNever = std::numeric_limits<float>::infinity();

}  // namespace

CellLabels::CellLabels(const KeyframeRecord& keyframe, const merge::RefinedKeyframe& refined,
                       float cell_size_m)
    : bin_m_(kBinCells * cell_size_m), farthest_m_(kFarthestCells * cell_size_m) {
  for (const bool dynamic : {false, true}) {
    merge::visit_cells(keyframe, refined, dynamic, [&](const FineCell& cell) {
      const VoxelIndex bin = voxel_index(cell.position, 1.0F / bin_m_);
      if (!is_representable(bin)) return;
      entries_.push_back({pack(bin), cell.position, dynamic, cell.ground != 0, kNever});
    });
  }
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.bin < b.bin; });
  for (std::uint32_t i = 0; i < entries_.size(); ++i) first_.try_emplace(entries_[i].bin, i);
  separate_feet();
}

template <typename Visit>
void CellLabels::visit_around(const Eigen::Vector3f& point, const Visit& visit) const {
  const VoxelIndex middle = voxel_index(point, 1.0F / bin_m_);
  for (int n = 0; n < 27; ++n) {
    const VoxelIndex bin{middle.x + n % 3 - 1, middle.y + n / 3 % 3 - 1, middle.z + n / 9 - 1};
    if (!is_representable(bin)) continue;
    const auto found = first_.find(pack(bin));
    if (found == first_.end()) continue;
    for (std::size_t i = found->second; i < entries_.size() && entries_[i].bin == found->first;
         ++i) {
      const Eigen::Vector3f to = entries_[i].position - point;
      if (to.head<2>().squaredNorm() <= bin_m_ * bin_m_) visit(entries_[i]);
    }
  }
}

bool CellLabels::is_below_dynamic(const Entry& ground) const {
  bool found = false;
  visit_around(ground.position, [&](const Entry& other) {
    const Eigen::Vector3f to = other.position - ground.position;
    const float reach_m = 0.5F * bin_m_;
    found = found || (other.dynamic && to.z() > 0.0F && to.z() < bin_m_ &&
                      to.head<2>().squaredNorm() <= reach_m * reach_m);
  });
  return found;
}

void CellLabels::separate_feet() {
  std::vector<std::uint32_t> below;
  std::vector<bool> is_below(entries_.size(), false);
  for (std::uint32_t i = 0; i < entries_.size(); ++i) {
    if (!entries_[i].ground || entries_[i].dynamic || !is_below_dynamic(entries_[i])) continue;
    below.push_back(i);
    is_below[i] = true;
  }
  for (const std::uint32_t i : below) {
    std::vector<float> free;
    std::vector<float> all;
    visit_around(entries_[i].position, [&](const Entry& other) {
      const float height_m = other.position.z();
      if (!other.ground || other.dynamic) return;
      if (std::abs(height_m - entries_[i].position.z()) > bin_m_) return;
      all.push_back(height_m);
      if (!is_below[static_cast<std::size_t>(&other - entries_.data())]) free.push_back(height_m);
    });
    entries_[i].dynamic_above_m =
        ground_level(free, all, median<float>) + EvidenceDefaults::kFootHeightM;
  }
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
      dynamic = entries_[i].dynamic || point.z() > entries_[i].dynamic_above_m;
    }
  }
  return dynamic;
}

}  // namespace unimapper::apps
