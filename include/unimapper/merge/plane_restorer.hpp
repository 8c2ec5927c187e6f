// The planes of keyframes that came over the wire without.
#pragma once

#include <memory>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Finds planes in static cells as robots do. They take three times as many bytes as the keypoints
/// and follow from the cells, so they stay off the wire. Not thread safe: one per thread.
class PlaneRestorer {
 public:
  PlaneRestorer();
  ~PlaneRestorer();
  PlaneRestorer(PlaneRestorer&&) noexcept;
  PlaneRestorer& operator=(PlaneRestorer&&) noexcept;

  /// What loop search compares: the keypoints of `record` and its planes, which are found in its
  /// static cells if it has none itself. Valid until the next call, while `record` lives. Cost: one
  /// to two milliseconds where planes are found.
  PlaceView place(const KeyframeRecord& record);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace unimapper::merge
