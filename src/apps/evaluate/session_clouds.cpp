#include "src/apps/session_clouds.hpp"

#include <unordered_set>

#include "ports/datasets/writers.hpp"
#include "unimapper/core/voxel_key.hpp"

namespace unimapper::apps {

std::vector<Eigen::Vector3f> session_cloud(const SessionData& session,
                                           const merge::MergedSession& merged, float voxel_m) {
  std::vector<Eigen::Vector3f> cloud;
  std::unordered_set<VoxelKey> taken;
  const std::size_t count = std::min(session.keyframes.size(), merged.T_map_keyframe.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Pose& T_map_keyframe = merged.T_map_keyframe[k];
    const bool is_refined = k < merged.refined.size();
    const merge::RefinedKeyframe refined =
        is_refined ? merged.refined[k] : merge::RefinedKeyframe{};
    merge::visit_cells(session.keyframes[k], refined, false, [&](const FineCell& cell) {
      const Eigen::Vector3f p = (T_map_keyframe * cell.position.cast<double>()).cast<float>();
      if (!(p.cwiseAbs().maxCoeff() < 1e5F)) return;
      const VoxelIndex index = voxel_index(p, 1.0F / voxel_m);
      if (is_representable(index) && taken.insert(pack(index)).second) cloud.push_back(p);
    });
  }
  return cloud;
}

void write_session_clouds(const std::filesystem::path& map,
                          const std::vector<SessionData>& sessions,
                          const merge::MergeResult& result) {
  datasets::make_directory(map / "clouds");
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (!merge::is_in_map(result.sessions[s].status)) continue;
    const auto cloud = session_cloud(sessions[s], result.sessions[s]);
    datasets::PlyCloud ply;
    ply.positions = cloud;
    datasets::write_ply(map / "clouds" / (sessions[s].info.name + ".ply"), ply);
  }
}

}  // namespace unimapper::apps
