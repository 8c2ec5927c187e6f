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

// What is below a cell or next to it lies in the bins around its own.
constexpr std::int32_t kBinCells = 2;

constexpr float kNever = std::numeric_limits<float>::infinity();

}  // namespace

CellLabels::CellLabels(const KeyframeRecord& keyframe, const merge::RefinedKeyframe& refined)
    : T_odometry_keyframe_(keyframe.T_odometry_keyframe),
      cell_size_m_(keyframe.cell_size_m),
      bin_m_(static_cast<float>(kBinCells) * cell_size_m_) {
  for (const bool dynamic : {false, true}) {
    merge::visit_cells(keyframe, refined, dynamic, [&](const FineCell& cell) {
      const std::optional<VoxelIndex> voxel = voxel_of(cell.position);
      if (!voxel) return;
      entries_.push_back(
          {pack(bin_of(*voxel)), pack(*voxel), cell.position, dynamic, cell.ground != 0, kNever});
    });
  }
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.bin < b.bin; });
  for (std::uint32_t i = 0; i < entries_.size(); ++i) first_.try_emplace(entries_[i].bin, i);
  separate_feet();
}

std::optional<VoxelIndex> CellLabels::voxel_of(const Eigen::Vector3f& point) const {
  const auto in_cells = [&](const Eigen::Vector3d& p) -> Eigen::Array3d {
    return (p / static_cast<double>(cell_size_m_)).array().floor();
  };
  // From the keyframe on, so that odometry may have travelled as far as it likes.
  const Eigen::Array3d index = in_cells(T_odometry_keyframe_ * point.cast<double>()) -
                               in_cells(T_odometry_keyframe_.translation);
  // Also false for NaN.
  if (!(index.abs().maxCoeff() < static_cast<double>(kVoxelAxisLimit - kBinCells))) {
    return std::nullopt;
  }
  return VoxelIndex{static_cast<std::int32_t>(index.x()), static_cast<std::int32_t>(index.y()),
                    static_cast<std::int32_t>(index.z())};
}

VoxelIndex CellLabels::bin_of(const VoxelIndex& voxel) {
  return {floor_divide(voxel.x, kBinCells), floor_divide(voxel.y, kBinCells),
          floor_divide(voxel.z, kBinCells)};
}

template <typename Visit>
void CellLabels::visit_around(const Eigen::Vector3f& point, const Visit& visit) const {
  const std::optional<VoxelIndex> voxel = voxel_of(point);
  if (!voxel) return;
  const VoxelIndex middle = bin_of(*voxel);
  for (int n = 0; n < 27; ++n) {
    const VoxelIndex bin{middle.x + n % 3 - 1, middle.y + n / 3 % 3 - 1, middle.z + n / 9 - 1};
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
  const std::optional<VoxelIndex> voxel = voxel_of(point);
  if (!voxel) return false;
  const auto found = first_.find(pack(bin_of(*voxel)));
  if (found == first_.end()) return false;
  for (std::size_t i = found->second; i < entries_.size() && entries_[i].bin == found->first; ++i) {
    const Entry& entry = entries_[i];
    if (entry.voxel == pack(*voxel)) return entry.dynamic || point.z() > entry.dynamic_above_m;
  }
  return false;
}

}  // namespace unimapper::apps
