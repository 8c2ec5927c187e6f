// Keyframes of a survey, as if a sensor stood at its viewpoints.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "src/apps/survey/survey_cloud.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::apps {

/// Turns what is visible from each viewpoint into a keyframe by the robot's pipeline, one scan
/// each, and hands it to `take` in that order. Nothing is dynamic and there are no free-space
/// images: a cloud does not say where rays have passed. Stamps are a second apart, from 0. Throws
/// std::runtime_error for a keyframe that cannot be made. O(viewpoints x points in range).
void make_survey_keyframes(const PointTiles& cloud, const SessionId& session,
                           const std::vector<Eigen::Vector3f>& viewpoints, float range_m,
                           const std::function<void(wire::ReceivedKeyframe&&)>& take);

}  // namespace unimapper::apps
