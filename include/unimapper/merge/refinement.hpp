// Refinement of static and dynamic cells after alignment
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// One keyframe's cells after refinement: the static cells first, then the dynamic ones, in the
/// order of the record. Empty: the online labels.
struct RefinedKeyframe {
  std::vector<std::uint8_t> dynamic;  ///< 1: dynamic
};

/// Calls `visit` for every cell of a keyframe that is (not) dynamic after refinement.
template <typename Visit>
void visit_cells(const KeyframeRecord& keyframe, const RefinedKeyframe& refined, bool dynamic,
                 const Visit& visit) {
  std::size_t number = 0;
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    const bool was_dynamic = cells == &keyframe.dynamic_cells;
    for (const FineCell& cell : *cells) {
      const std::size_t own = number++;
      const bool is = refined.dynamic.empty() ? was_dynamic : refined.dynamic[own] != 0;
      if (is == dynamic) visit(cell);
    }
  }
}

/// A session and the poses of its keyframes; sessions that share a map observe each other.
struct PosedSession {
  const SessionData* session = nullptr;  ///< must outlive the call
  std::vector<Pose> T_map_keyframe;  ///< by keyframe: levelled keyframe frame to map frame, metres
  /// Sessions with the same number share a frame.
  std::size_t map = 0;
};

/// Labels every cell of every keyframe again, static or dynamic, by what the keyframes before *and
/// after* it, and those of other visits, saw through or observed as occupied. One result per
/// session and keyframe; keyframes without free-space images keep their online labels.
/// Deterministic for any number of threads. O(cells x observers).
[[nodiscard]] std::vector<std::vector<RefinedKeyframe>> refine(
    const std::vector<PosedSession>& sessions, const RefinementConfig& config, unsigned threads);

}  // namespace unimapper::merge
