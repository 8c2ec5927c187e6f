// Comparison of a person's link with the sensor data of its two keyframes.
#pragma once

#include <cstddef>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// What the sensor data say of a link.
struct LinkEvidence {
  bool is_confirmed = false;  ///< registration finds the query there
  /// Points of structure that both keyframes of an unconfirmed link could see at the pose said; 0
  /// without one.
  std::size_t observed = 0;
  /// Share of the `observed` points that the other keyframe saw through, [0, 1].
  double seen_through = 0.0;
  /// Registration does not confirm the link, and more of the common view was seen through than of
  /// a loop may be (`LoopConfig::max_contradiction`).
  bool is_contradicted = false;
};

/// Registers a link as a merge does: from its pose, or without one from eight headings at the same
/// position. Its keyframes must exist.
[[nodiscard]] LinkEvidence check_link(const std::vector<SessionData>& sessions,
                                      const KeyframeLink& link, const MergeConfig& config);

}  // namespace unimapper::merge
