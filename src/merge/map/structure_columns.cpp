// Static structure of a merged map by the columns of a horizontal grid
#include "structure_columns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace unimapper::merge {
namespace {

constexpr double kVoxelHeight_m = 0.1;
constexpr double kMostColumns = 268435456.0;  // 2^28

}  // namespace

StructureColumns::StructureColumns(const std::vector<SessionData>& sessions,
                                   const MergeResult& result, double resolution_m)
    : resolution_m_(resolution_m) {
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (is_in_map(result.sessions[s].status)) add(sessions[s], result.sessions[s]);
  }
  measure();
  sort();
}

std::optional<std::size_t> StructureColumns::column(const Eigen::Vector3d& p) const {
  const double x = std::floor(p.x() / resolution_m_) - low_.x();
  const double y = std::floor(p.y() / resolution_m_) - low_.y();
  if (!(x >= 0.0 && y >= 0.0 && x < width_ && y < height_)) return std::nullopt;
  return static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x);
}

void StructureColumns::add(const SessionData& session, const MergedSession& merged) {
  const Eigen::Array3d size(resolution_m_, resolution_m_, kVoxelHeight_m);
  const double limit = static_cast<double>(kVoxelAxisLimit - 1);
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    visit_cells(*whole_keyframe(session, k), merged.refined[k], false, [&](const FineCell& cell) {
      const Eigen::Vector3d p =
          merged.T_map_keyframe[k] * Eigen::Vector3d(cell.position.cast<double>());
      const Eigen::Array3d scaled = p.array() / size;
      if (!(scaled.abs().maxCoeff() < limit)) return;
      const Eigen::Array3i v = scaled.floor().cast<std::int32_t>();
      const std::uint32_t number = table_.find_or_insert(pack({v.x(), v.y(), v.z()}));
      if (number == voxels_.size()) voxels_.emplace_back();
      Voxel& voxel = voxels_[number];
      voxel.sum_z_m += static_cast<float>(p.z() - v.z() * kVoxelHeight_m);
      ++voxel.cells;
      voxel.ground += cell.ground != 0 ? 1 : 0;
    });
  }
}

void StructureColumns::measure() {
  constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t kHighest = std::numeric_limits<std::int32_t>::max();
  Eigen::Vector2i low(kHighest, kHighest);
  Eigen::Vector2i high(kLowest, kLowest);
  for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
    if (!voxels_[i].is_ground()) continue;
    const VoxelIndex v = unpack(table_.key(i));
    low = low.cwiseMin(Eigen::Vector2i(v.x, v.y));
    high = high.cwiseMax(Eigen::Vector2i(v.x, v.y));
  }
  if (high.x() < low.x()) return;
  low_ = low;
  const Eigen::Array2d count = high.cast<double>().array() - low.cast<double>().array() + 1.0;
  if (count.prod() > kMostColumns) {
    throw std::runtime_error("a navigation grid of " + std::to_string(resolution_m_) +
                             " m would have more than 2^28 cells; choose a larger one");
  }
  width_ = static_cast<std::uint32_t>(count.x());
  height_ = static_cast<std::uint32_t>(count.y());
}

void StructureColumns::sort() {
  first_.assign(static_cast<std::size_t>(width_) * height_ + 1, 0);
  std::vector<std::pair<std::size_t, Entry>> placed;
  for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
    const VoxelIndex v = unpack(table_.key(i));
    const std::int64_t x = std::int64_t{v.x} - low_.x();
    const std::int64_t y = std::int64_t{v.y} - low_.y();
    if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
    const double z =
        v.z * kVoxelHeight_m + static_cast<double>(voxels_[i].sum_z_m) / voxels_[i].cells;
    placed.push_back({static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x),
                      {static_cast<float>(z), voxels_[i].is_ground()}});
  }
  std::sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second.z_m) < std::pair(b.first, b.second.z_m);
  });
  for (const auto& [column, entry] : placed) {
    ++first_[column + 1];
    entries_.push_back(entry);
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
}

}  // namespace unimapper::merge
