// Geometric verification of loop proposals
#pragma once

#include <span>
#include <string>
#include <vector>

#include "keyframe_clouds.hpp"
#include "loop_search.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// What alignment made of a proposal.
struct VerifiedLoop {
  bool confirmed = false;
  std::string reason;         ///< why not, empty if confirmed
  LoopConstraint constraint;  ///< the aligned pose where alignment got that far
};

/// How far alignment may move a proposal.
struct CorrectionLimit {
  double translation_m = 0.0;
  double rotation_rad = 0.0;
};

/// Aligns every proposal with G-ICP and confirms it if the two keyframes are level with each
/// other, overlap in structure, fit closely, and neither has seen free space where the other has
/// a surface. In parallel; the result is in the proposals' order.
std::vector<VerifiedLoop> verify_loops(std::span<const LoopProposal> proposals,
                                       const CorrectionLimit& limit, KeyframeClouds& clouds,
                                       const MergeConfig& config);

}  // namespace unimapper::merge
