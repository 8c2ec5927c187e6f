// Poses optimised elsewhere as a new epoch of a stored project.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>

#include "ports/datasets/files.hpp"
#include "ports/store/project_writer.hpp"
#include "src/apps/map/g2o_poses.hpp"
#include "src/apps/map/map_options.hpp"

namespace unimapper::apps {
namespace {

std::size_t keyframes_of(const store::MapResult& result) {
  std::size_t count = 0;
  for (const store::SessionResult& session : result.sessions) count += session.sequences.size();
  return count;
}

/// Takes the poses over; returns by how much the keyframe that moves farthest does, metres.
double replace_poses(store::MapResult& result, const std::vector<Pose>& poses) {
  double farthest_m = 0.0;
  std::map<store::KeyframeRow, Pose> T_map_keyframe;
  std::size_t next = 0;
  for (store::SessionResult& session : result.sessions) {
    for (std::size_t k = 0; k < session.sequences.size(); ++k) {
      Pose& pose = session.T_map_keyframe[k];
      const Pose& imported = poses[next++];
      farthest_m = std::max(farthest_m, (imported.translation - pose.translation).norm());
      pose = imported;
      T_map_keyframe[{session.session, session.sequences[k]}] = imported;
    }
  }
  for (store::PositionResult& position : result.positions) {
    if (!position.used) continue;
    position.residual = T_map_keyframe[position.keyframe] * position.point +
                        result.georeference->origin - position.position;
  }
  return farthest_m;
}

}  // namespace

void import_poses(const ProjectOptions& options, const std::filesystem::path& graph) {
  store::ProjectWriter writer(options.store, "`unimapper map import`");
  const store::ProjectState state = writer.current();
  if (state.epoch.result == 0) {
    throw std::runtime_error(
        "there is no map whose poses could be replaced; `unimapper map merge` "
        "makes one");
  }
  store::MapResult result = writer.reader().result(state.epoch.result);
  const std::vector<Pose> poses =
      parse_g2o_poses(datasets::read_file(graph), graph.string(), keyframes_of(result));
  const double farthest_m = replace_poses(result, poses);
  const auto epoch = writer.commit("import " + graph.string(), [&](store::ProjectState& next) {
    next.epoch.result = writer.keep(result);
    const std::string text = fmt::format(
        "imported {} poses, which moves keyframes by up to {:.3f} m", poses.size(), farthest_m);
    return std::optional<std::string>(text);
  });
  std::cout << "epoch " << epoch->number << ": " << epoch->outcome << '\n';
}

}  // namespace unimapper::apps
