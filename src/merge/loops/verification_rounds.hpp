// Order in which loop candidates between sessions are verified.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "loop_search.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// As many earlier sessions hold a keyframe by verified loops; further ones are not tried.
inline constexpr std::uint32_t kSessionsPerKeyframe = 4;

/// Verifies candidates: one outcome for each, in their order.
using Verification =
    std::function<std::vector<LoopConstraint>(std::span<const LoopCandidate> candidates)>;

/// Verifies the candidates between sessions that are needed: a keyframe is held by loops with
/// `enough` earlier sessions, those first with which its session has most candidates. Where one of
/// these does not hold it, the next is tried, until it is held or all were tried. With every
/// session that is added later, only its own candidates are new. The outcomes of those that were
/// verified are returned in the order of the candidates.
std::vector<LoopConstraint> verify_in_rounds(std::span<const LoopCandidate> candidates,
                                             std::uint32_t enough, const Verification& verify);

}  // namespace unimapper::merge
