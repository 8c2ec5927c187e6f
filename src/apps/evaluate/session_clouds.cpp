#include "src/apps/session_clouds.hpp"

#include <unordered_map>

#include "ports/datasets/writers.hpp"
#include "src/core/voxel_key.hpp"
#include "src/free_space/block.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {
namespace {

/// Voxels by blocks of 64, one bit each: surfaces fill blocks, so a voxel takes a few bytes.
class VoxelSet {
 public:
  /// Whether the voxel is new. Voxels of one block after another cost least.
  bool insert(const VoxelIndex& voxel) {
    const VoxelKey key = pack(block_of(voxel));
    if (blocks_.size() > kMostBlocks) forget();
    if (last_ == nullptr || key != last_key_) last_ = &blocks_[key];
    last_key_ = key;
    const std::uint64_t bit = std::uint64_t{1} << bit_of(voxel);
    const bool is_new = (*last_ & bit) == 0;
    *last_ |= bit;
    return is_new;
  }

 private:
  /// About 200 MB. What is forgotten counts as new when a session comes back to it.
  static constexpr std::size_t kMostBlocks = std::size_t{1} << 22U;

  void forget() {
    blocks_.clear();
    last_ = nullptr;
  }

  std::unordered_map<VoxelKey, std::uint64_t> blocks_;
  VoxelKey last_key_ = 0;
  std::uint64_t* last_ = nullptr;  ///< stays where it is as others are added
};

}  // namespace

merge::ExternalVector<Eigen::Vector3f> session_cloud(
    const SessionData& session, const merge::MergedSession& merged,
    const std::shared_ptr<merge::ScratchFile>& file, float voxel_m) {
  merge::ExternalVector<Eigen::Vector3f> cloud(file);
  VoxelSet taken;
  const std::size_t count = std::min(session.keyframes.size(), merged.T_map_keyframe.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Pose& T_map_keyframe = merged.T_map_keyframe[k];
    const bool is_refined = k < merged.refined.size();
    const merge::RefinedKeyframe refined =
        is_refined ? merged.refined[k] : merge::RefinedKeyframe{};
    merge::visit_cells(*whole_keyframe(session, k), refined, false, [&](const FineCell& cell) {
      const Eigen::Vector3f p = (T_map_keyframe * cell.position.cast<double>()).cast<float>();
      if (!(p.cwiseAbs().maxCoeff() < 1e5F)) return;
      const VoxelIndex index = voxel_index(p, 1.0F / voxel_m);
      if (is_representable(index) && taken.insert(index)) cloud.push_back(p);
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
    merge::write_positions(map / "clouds" / (sessions[s].info.name + ".ply"),
                           session_cloud(sessions[s], result.sessions[s], result.map.file()));
  }
}

}  // namespace unimapper::apps
