// Refinement of static and dynamic cells after alignment
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// What refinement changed of one keyframe. Cells are numbered in the order of the record: the
/// static ones first, then the dynamic ones.
struct RefinedKeyframe {
  std::vector<std::uint32_t> changed;  ///< cells whose label is not the online one, ascending
};

/// Calls `visit` for every cell of a keyframe that is (not) dynamic after refinement.
template <typename Visit>
void visit_cells(const KeyframeRecord& keyframe, const RefinedKeyframe& refined, bool dynamic,
                 const Visit& visit) {
  std::uint32_t number = 0;
  auto changed = refined.changed.begin();
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    const bool was_dynamic = cells == &keyframe.dynamic_cells;
    for (const FineCell& cell : *cells) {
      const bool is_changed = changed != refined.changed.end() && *changed == number;
      if (is_changed) ++changed;
      ++number;
      if ((was_dynamic != is_changed) == dynamic) visit(cell);
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
