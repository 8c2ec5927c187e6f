// Planes of received keyframes, extracted from their static cells.
#pragma once

#include <cstddef>
#include <memory>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Extracts planes from static cells as robots do. They take three times as many bytes as the
/// keypoints and follow from the cells, so they are not sent. Not thread safe: one per thread.
class PlaneRestorer {
 public:
  PlaneRestorer();
  ~PlaneRestorer();
  PlaneRestorer(PlaneRestorer&&) noexcept;
  PlaneRestorer& operator=(PlaneRestorer&&) noexcept;

  /// The place of `record`: its keypoints and its planes, which are extracted from its static cells
  /// if it has none. Valid until the next call, while `record` lives. Cost: one to two milliseconds
  /// where planes are extracted.
  PlaceView place(const KeyframeRecord& record);
  /// The place of keyframe `k` of a session. If only its summary has arrived, the planes are those
  /// of its `neighbouring_cells`. Valid until the next call, while `session` lives.
  PlaceView place(const SessionData& session, std::size_t k);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace unimapper::merge
