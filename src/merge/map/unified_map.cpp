// Unified voxel map of several sessions.
#include "unified_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>

#include "src/merge/parallel.hpp"

namespace unimapper::merge {
namespace {

/// Read in parallel, then added one after the other.
constexpr std::size_t kKeyframesAtOnce = 8;

void add(const FineCell& cell, const Pose& T_map_keyframe, SessionVoxels& to) {
  const auto size_m = static_cast<double>(to.voxel_size_m());
  const double limit = static_cast<double>(kVoxelAxisLimit - 1);
  const Eigen::Vector3d p = T_map_keyframe * Eigen::Vector3d(cell.position.cast<double>());
  const Eigen::Array3d scaled = p.array() * (1.0 / size_m);
  if (!(scaled.abs().maxCoeff() < limit)) return;
  const Eigen::Array3d floor = scaled.floor();
  // Relative to the corner, so that float does not lose millimetres kilometres away.
  to.add({static_cast<std::int32_t>(floor.x()), static_cast<std::int32_t>(floor.y()),
          static_cast<std::int32_t>(floor.z())},
         ((scaled - floor) * size_m).matrix().cast<float>(), cell);
}

/// The sum of a voxel's intensities on the map's scale, which ends at 255.
std::uint32_t scaled_sum(const IntensitySum& intensity, float factor) {
  const float sum = std::round(factor * static_cast<float>(intensity.sum()));
  return static_cast<std::uint32_t>(std::min(sum, 255.0F * static_cast<float>(intensity.count())));
}

/// Appends the points of one tile, united over the sessions.
void unite_tile(const std::vector<const SessionVoxels*>& sessions,
                const std::vector<float>& intensity_factors, const MapTile& tile,
                ExternalVector<MapPoint>& map) {
  VoxelTable table;
  std::vector<MapPoint> points;
  std::vector<std::uint32_t> cells;
  std::vector<std::uint32_t> ground;
  std::vector<std::array<std::uint32_t, 2>> intensities;  // sum and count
  float size_m = 0.0F;                                    // all sessions have the same
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (sessions[s] == nullptr) continue;
    size_m = sessions[s]->voxel_size_m();
    const float factor = intensity_factors.empty() ? 1.0F : intensity_factors[s];
    sessions[s]->visit(tile, [&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
      const std::uint32_t number = table.find_or_insert(key);
      if (number == points.size()) {
        points.push_back({Eigen::Vector3f::Zero(), static_cast<std::uint32_t>(s), 0});
        cells.push_back(0);
        ground.push_back(0);
        intensities.push_back({0, 0});
      }
      // The sum of positions, until all are added.
      points[number].position += voxel.sum;
      cells[number] += voxel.cells;
      ground[number] += voxel.ground;
      intensities[number][0] += scaled_sum(voxel.intensity, factor);
      intensities[number][1] += voxel.intensity.count();
      ++points[number].sessions_seen;
    });
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f mean = points[i].position / static_cast<float>(cells[i]);
    points[i].position = voxel_corner(table.key(i), size_m) + mean;
    points[i].is_ground = 2 * ground[i] > cells[i] ? 1U : 0U;
    points[i].intensity = IntensitySum::mean(intensities[i][0], intensities[i][1]);
    map.push_back(points[i]);
  }
}

}  // namespace

LabelledVoxels voxelise(const SessionData& session, const MergedSession& merged, float size_m,
                        unsigned threads, const std::shared_ptr<ScratchFile>& file) {
  LabelledVoxels result{SessionVoxels(size_m, file), SessionVoxels(size_m, file)};
  const std::size_t count = session.keyframes.size();
  for (std::size_t first = 0; first < count; first += kKeyframesAtOnce) {
    std::vector<std::shared_ptr<const KeyframeRecord>> keyframes(
        std::min(kKeyframesAtOnce, count - first));
    parallel_for(keyframes.size(), threads,
                 [&](std::size_t i) { keyframes[i] = whole_keyframe(session, first + i); });
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      const std::size_t k = first + i;
      for (SessionVoxels* voxels : {&result.fixed, &result.dynamic}) {
        visit_cells(*keyframes[i], merged.refined[k], voxels == &result.dynamic,
                    [&](const FineCell& cell) { add(cell, merged.T_map_keyframe[k], *voxels); });
      }
    }
  }
  result.fixed.finish();
  result.dynamic.finish();
  return result;
}

ExternalVector<MapPoint> unite(const std::vector<const SessionVoxels*>& sessions,
                               const std::shared_ptr<ScratchFile>& file,
                               const std::vector<float>& intensity_factors) {
  std::set<MapTile> tiles;
  for (const SessionVoxels* session : sessions) {
    if (session == nullptr) continue;
    for (const auto& [tile, size] : session->sizes()) tiles.insert(tile);
  }
  ExternalVector<MapPoint> map(file);
  for (const MapTile& tile : tiles) unite_tile(sessions, intensity_factors, tile, map);
  return map;
}

}  // namespace unimapper::merge
