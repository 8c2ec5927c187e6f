// Planes of received keyframes, extracted from their static cells.
#include "plane_restorer.hpp"

#include "keyframe_summaries.hpp"
#include "src/merge/in_arena.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::merge {

// The defaults of the robots, except that no cell is too many.
struct PlaneRestorer::State {
  InArena<PlaceDescriber> describer{DescriptorConfig{}, DescriptorInput{.max_cells = 1U << 19U}};
};

PlaneRestorer::PlaneRestorer() : state_(std::make_unique<State>()) {}
PlaneRestorer::~PlaneRestorer() = default;
PlaneRestorer::PlaneRestorer(PlaneRestorer&&) noexcept = default;
PlaneRestorer& PlaneRestorer::operator=(PlaneRestorer&&) noexcept = default;

PlaceView PlaneRestorer::place(const KeyframeRecord& record) {
  if (!record.planes.empty()) return record.place();
  return {record.keypoints, state_->describer->find_planes(record.static_cells), record.up};
}

PlaceView PlaneRestorer::place(const SessionData& session, std::size_t k) {
  const KeyframeRecord& keyframe = session.keyframes[k];
  if (!keyframe.planes.empty() && !keyframe.is_summary) return keyframe.place();
  const auto planes =
      keyframe.is_summary
          ? state_->describer->find_planes(neighbouring_cells(session, k))
          : state_->describer->find_planes(whole_keyframe(session, k)->static_cells);
  return {keyframe.keypoints, planes, keyframe.up};
}

}  // namespace unimapper::merge
