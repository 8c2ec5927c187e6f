// Geometric verification of loop candidates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "loop_search.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Of candidates that descriptors propose: metres, radians.
inline constexpr CorrectionLimit kDescriptorLimit{4.0, 0.25};

/// Of candidates that poses of keyframes near each other propose: metres, radians.
inline constexpr CorrectionLimit kRadiusLimit{3.0, 0.15};

/// Overlap of structure before G-ICP is tried.
inline constexpr double kMinInitialOverlap = 0.3;

/// A limit of the verification, and what a candidate has there.
struct LoopGate {
  const char* name = "";  ///< with unit; begins the reason of a refusal
  double value = 0.0;
  double limit = 0.0;  ///< NaN: the gate is not about a number
  bool passed = true;
};

/// Whether a candidate that a gate refuses is measured at the others all the same.
enum class GatesAsked : std::uint8_t { kUntilRefused, kAll };

/// Registers a candidate with G-ICP and asks every gate: the two keyframes must be level with each
/// other (within the covariance of up where both know it), overlap in structure, and
/// neither may have observed free space where the other has a surface. `constraint` gets pose,
/// overlap and information as far as they were measured, and no decision. The clouds of both
/// keyframes must be prepared.
std::vector<LoopGate> ask_gates(const LoopCandidate& candidate, const CorrectionLimit& limit,
                                const KeyframeClouds& clouds, const MergeConfig& config,
                                GatesAsked asked, LoopConstraint& constraint);

/// Accepts every candidate that all gates let pass (`ask_gates`). The constraints are in the
/// candidates' order; one that is refused says at which gate and holds the registered pose where
/// registration got that far. In parallel.
std::vector<LoopConstraint> verify_loops(std::span<const LoopCandidate> candidates,
                                         const CorrectionLimit& limit, KeyframeClouds& clouds,
                                         const MergeConfig& config);

}  // namespace unimapper::merge
