// Keyframes of a pipeline in words
#pragma once

#include <string>
#include <vector>

#include "unimapper/onboard/pipeline.hpp"
#include "words.hpp"

namespace unimapper::regression {

/// What is counted of a keyframe; times are left out.
inline std::string statistics_text(const KeyframeStatistics& s) {
  std::string text = join("  points in", count(s.points_in), "valid", count(s.points_valid),
                          "static", count(s.points_static), "dynamic", count(s.points_dynamic)) +
                     "\n";
  text += join("  cells", count(s.cells), "dynamic", count(s.dynamic_cells), "voxels",
               count(s.voxels), "ground", count(s.ground_voxels), "components", count(s.components),
               "walls", count(s.walls)) +
          "\n";
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    if (s.dropped[i] == 0) continue;
    text +=
        join("  dropped", drop_cause_name(static_cast<DropCause>(i)), count(s.dropped[i])) + "\n";
  }
  for (std::size_t i = 0; i < kCapacities; ++i) {
    text += join("  capacity", capacity_name(static_cast<Capacity>(i)), count(s.capacity[i].used),
                 "of", count(s.capacity[i].capacity)) +
            "\n";
  }
  const auto number = [](float value) { return fixed(static_cast<double>(value), 3); };
  text += join("  removal tilt", number(s.odometry_tilt_deg), s.up_known ? "known" : "unknown",
               s.up_contradicted ? "contradicted" : "agreeing", "noise",
               number(s.attitude_noise_deg), "sweep", number(s.sweep_tilt_deg), "aligned",
               count(s.aligned_scans), s.deadline_missed ? "missed" : "in time") +
          "\n";
  const SamplingStatistics& sampling = s.sampling;
  text += join("  sampling rays", number(sampling.ray_spacing_deg), "rings",
               number(sampling.ring_spacing_deg), sampling.rays_differ ? "differ" : "agree",
               sampling.elevations_differ ? "differ" : "agree", "image",
               number(sampling.image_elevation_min_deg), "to",
               number(sampling.image_elevation_max_deg), "changes", count(sampling.changes)) +
          "\n";
  return text;
}

inline std::string cells_text(std::span<const FineCell> cells) {
  CloudMoments moments;
  std::uint64_t points = 0;
  std::uint64_t ground = 0;
  for (const FineCell& cell : cells) {
    moments.add(cell.position);
    points += cell.points;
    ground += cell.ground;
  }
  return join(moments.text(), "points", count(points), "ground", count(ground));
}

/// Place, and everything that leaves the robot with a keyframe.
inline std::string keyframe_text(const KeyframeView& view) {
  std::string text = join("keyframe", count(view.sequence), "scans", count(view.scans.size()),
                          "reference", count(view.reference_scan)) +
                     "\n";
  text += "  pose " + pose_text(view.T_odometry_keyframe) + "\n  " + up_text(view.up) + "\n";
  for (const KeyframeScan& scan : view.scans) {
    text += join("  scan", count(scan.scan_index), "at", count(scan.stamp_ns),
                 pose_text(scan.T_odometry_sensor)) +
            "\n";
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
    text += join("  image of scan", count(image.scan), "pixels", count(image.pixels.size()),
                 "known", count(known), "sum", count(sum)) +
            "\n";
  }
  CloudMoments keypoints;
  CloudMoments normals;
  CloudMoments centers;
  std::uint64_t strength = 0;
  std::uint64_t occupancy = 0;
  for (const Keypoint& keypoint : view.place.keypoints) {
    keypoints.add(keypoint.position);
    normals.add(keypoint.normal);
    strength += keypoint.strength;
    occupancy ^= keypoint.occupancy;
  }
  for (const PlanePatch& plane : view.place.planes) centers.add(plane.center);
  text += "  keypoints " + keypoints.text() + "\n";
  text += "  normals " + normals.text() + " strength " + count(strength) + " columns " +
          count(occupancy) + "\n";
  text += "  planes " + centers.text() + "\n";
  for (const LoopCandidate& loop : view.loops) {
    text +=
        join("  loop to", count(loop.match.session), count(loop.match.keyframe), "confidence",
             fixed(static_cast<double>(loop.confidence), 3), loop.accepted ? "accepted" : "refused",
             "votes", count(loop.votes), "inliers", count(loop.inliers), "planes",
             fixed(static_cast<double>(loop.plane_overlap), 3), pose_text(loop.T_match_query)) +
        "\n";
  }
  if (view.relabelled.available) {
    text += join("  relabelled", count(view.relabelled.sequence), "by",
                 count(view.relabelled.later_keyframes), "to dynamic",
                 count(view.relabelled.cells_now_dynamic), "to static",
                 count(view.relabelled.cells_now_static)) +
            "\n";
  }
  return text + statistics_text(*view.statistics);
}

}  // namespace unimapper::regression
