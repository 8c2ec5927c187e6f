// Places of a merge's sessions at their newest keyframes.
#pragma once

#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/localisation.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Where the newest keyframe of each session lies in the map of a merge, for robots that drive on
/// from there. A provisional session is ambiguous, one that is not connected not yet localised, for
/// the reason of the merge. The covariance is that of the session's latest accepted loop with a
/// place known before, and of odometry since; of the central session, whose first keyframe defines
/// the map, that of odometry since then where it is less. Poses of the map count as exact. Throws
/// std::invalid_argument if the result is of other sessions. O(keyframes + loops).
[[nodiscard]] std::vector<MapPose> newest_map_poses(const std::vector<SessionData>& sessions,
                                                    const MergeResult& result,
                                                    const OdometryNoiseConfig& odometry);

}  // namespace unimapper::merge
