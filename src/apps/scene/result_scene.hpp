// Result of a run or merge as a scene: clouds, trajectories and loops.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ports/bag_writers/foxglove_writer.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Points of one topic.
struct SceneCloud {
  std::string topic;
  std::vector<Eigen::Vector3f> points;
  std::optional<bags::Rgba> color;
  std::vector<std::uint8_t> intensities{};  ///< of each point; empty where none is known
};

/// The sensor's way in one session.
struct SceneTrack {
  std::string session;
  std::vector<merge::TrajectoryPose> poses;
};

/// Everything in one frame.
struct ResultScene {
  std::string frame;  ///< "map", or "odometry" of a run
  std::vector<SceneCloud> clouds;
  std::vector<SceneTrack> tracks;
  /// Accepted loops, from sensor to sensor.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> loops;
};

/// What RUN/keyframes.lcmlog and RUN/loops.csv hold, in the run's odometry frame: static and
/// removed cells, one per 0.2 m, trajectory, loops within the run. Throws std::runtime_error.
[[nodiscard]] ResultScene scene_of_run(const std::filesystem::path& run);

/// The unified map, what was removed and what changed, all sessions that are in it, all loops.
[[nodiscard]] ResultScene scene_of_merge(const std::vector<SessionData>& sessions,
                                         const merge::MergeResult& result);

/// Writes the static cells of a run as a LAS file, their mean in each 0.2 m, in the coordinates of
/// the run's odometry. Throws std::runtime_error.
void write_las_of_run(const std::filesystem::path& file, const std::filesystem::path& run);

/// Writes an MCAP file with the topics /static, /removed (and /appeared, /gone of a merge),
/// /SESSION/trajectory, /SESSION/pose, /loops and /tf. Throws BagError.
void write_scene(const std::filesystem::path& file, const ResultScene& scene);

}  // namespace unimapper::apps
