// Point clouds of merged sessions in the map frame.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <vector>

#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Static cells of a session in the map frame (of an unconnected session: in its own frame),
/// thinned to the first point of each `voxel_m`, in memory or in `file`. O(cells).
[[nodiscard]] merge::ExternalVector<Eigen::Vector3f> session_cloud(
    const SessionData& session, const merge::MergedSession& merged,
    const std::shared_ptr<merge::ScratchFile>& file = nullptr, float voxel_m = 0.2F);

/// Writes MAP/clouds/<session>.ply for every session that is not unconnected. The unified map
/// fuses the sessions, so their agreement can be measured on these clouds only:
/// `unimapper evaluate map` compares them. Throws std::runtime_error.
void write_session_clouds(const std::filesystem::path& map,
                          const std::vector<SessionData>& sessions,
                          const merge::MergeResult& result);

}  // namespace unimapper::apps
