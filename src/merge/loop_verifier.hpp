// Geometric verification of loop candidates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "keyframe_clouds.hpp"
#include "loop_search.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// How far registration may correct a candidate's pose.
struct CorrectionLimit {
  double translation_m = 0.0;
  double rotation_rad = 0.0;
};

/// Of candidates that descriptors propose.
inline CorrectionLimit descriptor_limit(const MergeConfig& config) {
  return {config.loops.max_correction_m, config.loops.max_correction_rad};
}

/// Of candidates that poses of keyframes near each other propose.
inline CorrectionLimit radius_limit(const MergeConfig& config) {
  return {config.radius.max_correction_m, config.radius.max_correction_rad};
}

/// Registers every candidate with G-ICP and accepts it if the two keyframes are level with each
/// other (within the covariance of up where both know it), overlap in structure, fit closely, and
/// neither observed free space where the other has a surface. The constraints are in the
/// candidates' order; one that is refused holds the registered pose where registration got that
/// far. In parallel.
std::vector<LoopConstraint> verify_loops(std::span<const LoopCandidate> candidates,
                                         const CorrectionLimit& limit, KeyframeClouds& clouds,
                                         const MergeConfig& config);

}  // namespace unimapper::merge
