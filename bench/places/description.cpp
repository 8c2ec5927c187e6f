#include "bench/places/description.hpp"

#include "bench/places/stopwatch.hpp"
#include "unimapper/merge/in_arena.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::bench {
namespace {

std::vector<FineCell> cells_of(const PlaceKeyframe& keyframe, const DescriptionVariant& variant) {
  std::vector<FineCell> cells = keyframe.static_cells;
  if (variant.with_dynamic) {
    cells.insert(cells.end(), keyframe.dynamic_cells.begin(), keyframe.dynamic_cells.end());
  }
  return cells;
}

/// Frame along the axes of the odometry frame, at a node of its grid near the keyframe.
Pose world_grid(const PlaceKeyframe& keyframe) {
  constexpr double kGrid = 2.0;  // all grids of the description divide it
  Pose T_odometry_place;
  T_odometry_place.translation =
      (keyframe.T_odometry_keyframe.translation / kGrid).array().floor() * kGrid;
  return keyframe.T_odometry_keyframe.inverse() * T_odometry_place;
}

void move_cells(std::vector<FineCell>& cells, const Pose& pose) {
  for (FineCell& cell : cells) {
    cell.position = (pose * Eigen::Vector3d(cell.position.cast<double>())).cast<float>();
  }
}

}  // namespace

std::vector<OwnedPlace> describe(const Drive& drive, const PipelineConfig& config,
                                 const DescriptionVariant& variant) {
  merge::InArena<PlaceDescriber> describer(config.descriptor, config.descriptor_input());
  std::vector<OwnedPlace> places;
  for (const PlaceKeyframe& keyframe : drive.keyframes) {
    OwnedPlace place;
    std::vector<FineCell> cells = cells_of(keyframe, variant);
    if (variant.world_frame) {
      place.T_keyframe_place = world_grid(keyframe);
      move_cells(cells, place.T_keyframe_place.inverse());
    }
    const double start = thread_milliseconds();
    const PlaceView view = describer->describe(cells);
    place.milliseconds = thread_milliseconds() - start;
    place.keypoints.assign(view.keypoints.begin(), view.keypoints.end());
    place.planes.assign(view.planes.begin(), view.planes.end());
    places.push_back(std::move(place));
  }
  return places;
}

}  // namespace unimapper::bench
