#include "src/apps/watch/keyframe_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::apps {

using namespace shared_memory;

namespace {

double share_percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

std::size_t accepted_loops(const KeyframeMessage& keyframe) {
  std::size_t count = 0;
  for (const SharedLoop loop : keyframe.loops) count += loop.accepted != 0 ? 1 : 0;
  return count;
}

/// " name 3, name 4" of the counts that are not 0.
template <std::size_t kCount, typename Name>
std::string named_counts(const std::uint64_t (&counts)[kCount], const Name& name) {
  std::string line;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (counts[i] == 0) continue;
    line += (line.empty() ? " " : ", ") + std::string(name(i)) + " " + std::to_string(counts[i]);
  }
  return line.empty() ? " nothing" : line;
}

}  // namespace

std::string keyframe_line(const KeyframeMessage& keyframe, std::uint32_t missed) {
  const Eigen::Vector3d& at = keyframe.T_odometry_keyframe.translation;
  return fmt::format(
      "keyframe {} at {:.2f} {:.2f} {:.2f} m: {} static cells, {} dynamic, {} keypoints, {} of {} "
      "loops accepted, {} missed",
      keyframe.fixed.head.number, at.x(), at.y(), at.z(), keyframe.static_cells.size(),
      keyframe.dynamic_cells.size(), keyframe.keypoints.size(), accepted_loops(keyframe),
      keyframe.loops.size(), missed);
}

std::vector<std::string> keyframe_lines(const KeyframeMessage& keyframe, std::uint32_t missed) {
  const SharedKeyframe& fixed = keyframe.fixed;
  const SharedStatistics& statistics = fixed.statistics;
  const Pose& pose = keyframe.T_odometry_keyframe;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("keyframe  {}, {} scans, {} missed by this view", fixed.head.number,
                              keyframe.scans.size(), missed));
  lines.push_back(
      fmt::format("pose      {:.2f} {:.2f} {:.2f} m, heading {:.1f} deg; up {}",
                  pose.translation.x(), pose.translation.y(), pose.translation.z(),
                  std::atan2(pose.rotation(1, 0), pose.rotation(0, 0)) * kDegreesPerRadian,
                  fixed.up_known != 0 ? "known" : "unknown"));
  lines.push_back(fmt::format("cells     {} static, {} dynamic; {:.2f} % of {} points removed",
                              keyframe.static_cells.size(), keyframe.dynamic_cells.size(),
                              share_percent(statistics.points_dynamic, statistics.points_valid),
                              statistics.points_valid));
  lines.push_back(fmt::format("place     {} keypoints, {} planes", keyframe.keypoints.size(),
                              keyframe.planes.size()));
  std::string loops =
      fmt::format("loops     {} of {} accepted", accepted_loops(keyframe), keyframe.loops.size());
  if (!keyframe.loops.empty()) {
    const SharedLoop best = keyframe.loops[0];
    loops += fmt::format("; best: session {} keyframe {}, confidence {:.2f}", best.match_session,
                         best.match_keyframe, best.confidence);
  }
  lines.push_back(loops);
  std::string times = "times    ";
  for (std::size_t i = 0; i < kStages; ++i) {
    times += fmt::format(" {} {:.1f}", stage_name(static_cast<Stage>(i)),
                         static_cast<double>(statistics.stage_us[i]) * 1e-3);
  }
  lines.push_back(times + (statistics.deadline_missed != 0 ? " ms, late" : " ms"));
  return lines;
}

std::vector<std::string> health_lines(const SharedHealth& health) {
  const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  return {fmt::format("health    {} scans, {} refused; {} keyframes, {} late; {} not shared",
                      number(health.scans), number(health.scans_refused), number(health.keyframes),
                      number(health.deadline_misses), number(health.not_shared)),
          "dropped  " + named_counts(health.dropped, [](std::size_t i) {
            return drop_cause_name(static_cast<DropCause>(i));
          })};
}

std::vector<std::string> view_from_above(const KeyframeMessage& keyframe, std::size_t columns,
                                         std::size_t rows, double metres) {
  std::vector<std::string> picture(rows, std::string(columns, ' '));
  // A character is twice as high as wide.
  const double per_metre = static_cast<double>(columns) / metres;
  const auto draw = [&](const Elements<SharedCell>& cells, bool ground, char mark) {
    for (const SharedCell cell : cells) {
      if ((cell.ground != 0) != ground) continue;
      const double column =
          0.5 * static_cast<double>(columns) + static_cast<double>(cell.position[0]) * per_metre;
      const double row =
          0.5 * static_cast<double>(rows) - 0.5 * static_cast<double>(cell.position[1]) * per_metre;
      // False for NaN, too.
      if (!(column >= 0.0 && column < static_cast<double>(columns))) continue;
      if (!(row >= 0.0 && row < static_cast<double>(rows))) continue;
      picture[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = mark;
    }
  };
  draw(keyframe.static_cells, true, '.');
  draw(keyframe.static_cells, false, '#');
  draw(keyframe.dynamic_cells, false, '*');
  if (rows > 0 && columns > 0) picture[rows / 2][columns / 2] = '>';
  return picture;
}

}  // namespace unimapper::apps
