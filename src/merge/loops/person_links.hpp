// Loops that a person has made by linking keyframes.
#pragma once

#include <vector>

#include "loop_acceptance.hpp"
#include "verified_loops.hpp"

namespace unimapper::merge {

/// One constraint for each link, `by_person` and accepted. Registered from the person's pose, or,
/// without one, from eight headings at the same position; a pose that registration does not
/// confirm is taken as the person said it, with 0.5 m and 0.05 rad. A link without a pose that no
/// registration confirms is refused.
std::vector<LoopConstraint> link_loops(const std::vector<KeyframeLink>& links, KnownLoops& known,
                                       KeyframeClouds& clouds);

/// Whether one of the loops is by a person's word.
[[nodiscard]] bool has_person_link(const std::vector<LoopConstraint>& loops);

/// The set of two sessions that a person has linked, always accepted: the links and the loops that
/// are consistent with the first of them.
ConsistencySet linked_consistency(const std::vector<LoopConstraint>& loops,
                                  const SessionPath& query, const SessionPath& match,
                                  const AcceptanceConfig& config);

/// Adds positions of a person's links to the ascending `chosen`.
void choose_person_links(const std::vector<LoopConstraint>& loops,
                         std::vector<std::size_t>& chosen);

}  // namespace unimapper::merge
