// Keyframes of a pipeline in words
#pragma once

#include "tests/test.hpp"
#include "unimapper/onboard/pipeline.hpp"
#include "words.hpp"

namespace unimapper::regression {

/// What is counted of a keyframe; times are left out.
inline std::string statistics_text(const KeyframeStatistics& s) {
  std::string text = line_of("  points in", s.points_in, "valid", s.points_valid, "static",
                             s.points_static, "dynamic", s.points_dynamic);
  text += line_of("  cells", s.cells, "dynamic", s.dynamic_cells, "voxels", s.voxels, "ground",
                  s.ground_voxels, "components", s.components, "walls", s.walls);
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    if (s.dropped[i] == 0) continue;
    text += line_of("  dropped", drop_cause_name(static_cast<DropCause>(i)), s.dropped[i]);
  }
  for (std::size_t i = 0; i < kCapacities; ++i) {
    text += line_of("  capacity", capacity_name(static_cast<Capacity>(i)), s.capacity[i].used, "of",
                    s.capacity[i].capacity);
  }
  text += line_of("  removal tilt", s.odometry_tilt_deg, s.up_known ? "known" : "unknown",
                  s.up_contradicted ? "contradicted" : "agreeing", "noise", s.attitude_noise_deg,
                  "sweep", s.sweep_tilt_deg, "aligned", s.aligned_scans,
                  s.deadline_missed ? "missed" : "in time");
  const SamplingStatistics& sampling = s.sampling;
  text += line_of("  sampling rays", sampling.ray_spacing_deg, "rings", sampling.ring_spacing_deg,
                  sampling.rays_differ ? "differ" : "agree",
                  sampling.elevations_differ ? "differ" : "agree", "image",
                  sampling.image_elevation_min_deg, "to", sampling.image_elevation_max_deg,
                  "changes", sampling.changes);
  return text;
}

/// Place, and everything that leaves the robot with a keyframe.
inline std::string keyframe_text(const KeyframeView& view) {
  std::string text = line_of("keyframe", view.sequence, "scans", view.scans.size(), "reference",
                             view.reference_scan);
  text += line_of("  pose", view.T_odometry_keyframe) + "  " + up_text(view.up) + "\n";
  for (const KeyframeScan& scan : view.scans) {
    text += line_of("  scan", scan.scan_index, "at", scan.stamp_ns, scan.T_odometry_sensor);
  }
  text += "  static " + cells_text(view.static_cells) + "\n";
  text += "  dynamic " + cells_text(view.dynamic_cells) + "\n";
  for (const FreeSpaceImage& image : view.images) {
    std::uint64_t known = 0;
    std::uint64_t sum = 0;
    for (const std::uint16_t pixel : image.pixels) {
      known += pixel == kNoRange ? 0 : 1;
      sum += pixel == kNoRange ? 0 : pixel;
    }
    text += line_of("  image of scan", image.scan, "pixels", image.pixels.size(), "known", known,
                    "sum", sum);
  }
  CloudMoments centers;
  for (const PlanePatch& plane : view.place.planes) centers.add(plane.center);
  text += keypoints_text(view.place.keypoints) + line_of("  planes", centers);
  for (const LoopCandidate& loop : view.loops) {
    text += line_of("  loop to", loop.match.session, loop.match.keyframe, "confidence",
                    loop.confidence, loop.accepted ? "accepted" : "refused", "votes", loop.votes,
                    "inliers", loop.inliers, "planes", loop.plane_overlap, loop.T_match_query);
  }
  if (view.relabelled.available) {
    text += relabelled_text("  relabelled", view.relabelled);
  }
  return text + statistics_text(*view.statistics);
}

}  // namespace unimapper::regression
