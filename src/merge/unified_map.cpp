// Unified voxel map of several sessions.
#include "unified_map.hpp"

namespace unimapper::merge {
namespace {

Eigen::Vector3f corner(VoxelKey key, float size_m) {
  const VoxelIndex v = unpack(key);
  return {size_m * static_cast<float>(v.x), size_m * static_cast<float>(v.y),
          size_m * static_cast<float>(v.z)};
}

}  // namespace

Eigen::Vector3f SessionVoxels::position(std::uint32_t number) const {
  const Voxel& voxel = voxels[number];
  return corner(table.key(number), size_m) + voxel.sum / static_cast<float>(voxel.cells);
}

SessionVoxels voxelise(const SessionData& session, const MergedSession& merged, float size_m,
                       CellKind kind) {
  SessionVoxels result;
  result.size_m = size_m;
  const double inverse = 1.0 / static_cast<double>(size_m);
  const double limit = static_cast<double>(kVoxelAxisLimit - 1);
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    visit_cells(
        session.keyframes[k], merged.refined[k], kind == CellKind::kDynamic,
        [&](const FineCell& cell) {
          const Eigen::Vector3d p =
              merged.T_map_keyframe[k] * Eigen::Vector3d(cell.position.cast<double>());
          const Eigen::Array3d scaled = p.array() * inverse;
          if (!(scaled.abs().maxCoeff() < limit)) return;
          const Eigen::Array3d floor = scaled.floor();
          const VoxelKey key =
              pack({static_cast<std::int32_t>(floor.x()), static_cast<std::int32_t>(floor.y()),
                    static_cast<std::int32_t>(floor.z())});
          const std::uint32_t number = result.table.find_or_insert(key);
          if (number == result.voxels.size()) result.voxels.emplace_back();
          SessionVoxels::Voxel& voxel = result.voxels[number];
          // Relative to the corner, so that float does not lose millimetres kilometres away.
          voxel.sum += ((scaled - floor) * static_cast<double>(size_m)).matrix().cast<float>();
          ++voxel.cells;
          voxel.ground += cell.ground != 0 ? 1 : 0;
        });
  }
  return result;
}

std::vector<MapPoint> unite(const std::vector<const SessionVoxels*>& sessions) {
  VoxelTable table;
  std::vector<MapPoint> points;
  std::vector<SessionVoxels::Voxel> sums;
  float size_m = 0.0F;  // all sessions have the same
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (sessions[s] == nullptr) continue;
    const SessionVoxels& session = *sessions[s];
    size_m = session.size_m;
    for (std::uint32_t i = 0; i < session.voxels.size(); ++i) {
      const std::uint32_t number = table.find_or_insert(session.table.key(i));
      if (number == points.size()) {
        points.push_back({Eigen::Vector3f::Zero(), static_cast<std::uint32_t>(s), 0});
        sums.emplace_back();
      }
      sums[number].sum += session.voxels[i].sum;
      sums[number].cells += session.voxels[i].cells;
      ++points[number].sessions_seen;
    }
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    points[i].position =
        corner(table.key(i), size_m) + sums[i].sum / static_cast<float>(sums[i].cells);
  }
  return points;
}

}  // namespace unimapper::merge
