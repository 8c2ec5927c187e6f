// Keyframes, events and health as C programs see them, of a tilted sensor
#include "expected_text.hpp"
#include "ports/c/unimapper.h"
#include "tests/test.hpp"
#include "tilted_town.hpp"
#include "unimapper/core/owned.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

std::int64_t ticks_ns = 0;
std::int64_t ticking_clock() { return ticks_ns += 250000; }

std::string pose_text(const um_pose& pose) {
  Pose p;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) p.rotation(row, column) = pose.m[4 * row + column];
    p.translation(row) = pose.m[4 * row + 3];
  }
  return regression::pose_text(p);
}

/// Counts of what was dropped, uses of capacities, and times of stages.
template <typename Dropped, typename Uses, typename Times>
std::string counts_text(const Dropped& dropped, const char* uses_name, const Uses& uses,
                        const char* times_name, const Times& times) {
  std::string text = "  dropped";
  for (const std::uint64_t number : dropped) text += " " + count(number);
  text += uses_name;
  for (const um_capacity& c : uses) text += " " + count(c.used) + "/" + count(c.capacity);
  text += times_name;
  for (const float us : times) text += " " + fixed(us, 1);
  return text + "\n";
}

std::string statistics_text(const um_statistics& s) {
  return line_of("  points", s.points_in, s.points_valid, s.points_static, s.points_dynamic,
                 "cells", s.cells, s.dynamic_cells, "voxels", s.voxels, s.ground_voxels,
                 "components", s.components, "missed", s.deadline_missed, "noise",
                 s.attitude_noise_deg) +
         counts_text(s.dropped, "\n  capacity", s.capacity, "\n  stages", s.stage_us);
}

std::string cells_text(std::span<const um_cell> cells) {
  CloudMoments moments;
  std::uint64_t points = 0;
  std::uint64_t ground = 0;
  for (const um_cell& cell : cells) {
    moments.add(Eigen::Vector3f(cell.position));
    points += cell.points;
    ground += cell.ground;
  }
  return join(moments, "points", points, "ground", ground);
}

std::string keyframe_text(const um_keyframe& k) {
  std::string text = line_of("keyframe", k.sequence, "reference", k.reference_scan, "scans",
                             k.scan_count, pose_text(k.T_odometry_keyframe));
  for (const um_scan& scan : std::span(k.scans, k.scan_count)) {
    text += line_of("  scan", scan.scan_index, scan.stamp_ns, pose_text(scan.T_odometry_sensor));
  }
  text += line_of("  static", cells_text({k.static_cells, k.static_cell_count}));
  text += line_of("  dynamic", cells_text({k.dynamic_cells, k.dynamic_cell_count}));
  CloudMoments planes;
  for (const um_plane& plane : std::span(k.planes, k.plane_count)) {
    planes.add(Eigen::Vector3f(plane.center));
  }
  CloudMoments keypoints;
  CloudMoments normals;
  for (const um_keypoint& keypoint : std::span(k.keypoints, k.keypoint_count)) {
    keypoints.add(Eigen::Vector3f(keypoint.position));
    normals.add(Eigen::Vector3f(keypoint.normal));
  }
  text += line_of("  planes", planes) + line_of("  keypoints", keypoints) +
          line_of("  normals", normals);
  for (const um_loop& loop : std::span(k.loops, k.loop_count)) {
    text += line_of("  loop", loop.session, loop.keyframe, loop.confidence, loop.accepted,
                    loop.votes, loop.inliers, loop.plane_overlap, pose_text(loop.T_match_query));
  }
  text += line_of("  up", k.up_known, k.up_contradicted, rough(k.up_covariance[0]),
                  rough(k.up_covariance[1]), rough(k.up_covariance[2]), k.odometry_tilt_deg);
  const um_input& in = k.input;
  text += line_of("  input", in.ray_spacing_deg, in.ring_spacing_deg, in.image_elevation_min_deg,
                  in.image_elevation_max_deg, in.rays_differ, in.elevations_differ, in.mode_changes,
                  in.attitude_noise_deg, in.sweep_tilt_deg, in.aligned_scans, in.up_known,
                  in.odometry_tilt_deg, in.up_sigma_deg);
  return text + statistics_text(k.statistics);
}

std::string health_text(um_pipeline* pipeline) {
  um_health h;
  REQUIRE(um_health_get(pipeline, &h) == UM_OK);
  return line_of("health scans", h.scans, "refused", h.scans_refused, "keyframes", h.keyframes,
                 "points", h.points_in, "dynamic", h.points_dynamic, "missed", h.deadline_misses) +
         counts_text(h.dropped, "\n  fullest", h.fullest, "\n  longest", h.longest_stage_us);
}

}  // namespace

TEST_CASE("a C program's keyframes, events and health, as before on every platform",
          "[regression]") {
  ticks_ns = 0;
  um_config config;
  REQUIRE(um_config_init(&config, UM_SENSOR_HDL_64E) == UM_OK);
  config.event_capacity = 64;
  config.clock_ns = ticking_clock;
  config.budget_us = 5800;
  config.keyframe_scans = 4;
  config.keyframe_range_min_m = 2.5F;
  config.keyframe_range_max_m = 50.0F;
  config.keyframe_max_points_per_scan = 13000;
  config.voxel_max_cells = 33000;
  config.loop_search_max_places = 5;
  config.loop_search_accept_confidence = 0.5F;
  for (const auto& [name, value] : {std::pair{"removal.window", "4"},
                                    {"search_scope.min_keyframe_gap", "3"},
                                    {"descriptor.max_keypoints", "70"},
                                    {"loop_search.max_bucket", "6"},
                                    {"voxel.max_voxels", "2300"},
                                    {"odometry.up_sigma_deg", "0.5"}}) {
    REQUIRE(um_config_set(&config, name, value, nullptr) == UM_OK);
  }
  MemoryBlock block(um_required_bytes(&config));
  um_pipeline* pipeline = nullptr;
  REQUIRE(um_init(&config, block.data(), block.size(), &pipeline, nullptr) == UM_OK);

  const IntegerTown town(sparse(11));
  MemoryBlock scratch(um_encode_scratch_bytes(pipeline));
  std::vector<std::uint8_t> message(1U << 20U);
  const Frames frames = tilted();
  std::string text;
  const auto look = [&] {
    um_keyframe keyframe;
    REQUIRE(um_keyframe_get(pipeline, &keyframe) == UM_OK);
    text += keyframe_text(keyframe);
    um_relabelled relabelled;
    REQUIRE(um_relabelled_get(pipeline, &relabelled) == UM_OK);
    um_images images;
    REQUIRE(um_images_get(pipeline, &images) == UM_OK);
    for (std::uint32_t i = 0; i < images.count; ++i) {
      std::uint64_t sum = 0;
      for (std::uint32_t p = 0; p < images.columns * images.rows; ++p) sum += images.pixels[i][p];
      text += line_of("  image", images.scans[i], images.columns, images.rows,
                      images.azimuth_resolution_deg, images.elevation_min_deg,
                      images.full_weight_range_m, "sum", sum);
    }
    const um_session session{5, 0, 0, 77};
    um_encoded encoded;
    REQUIRE(um_keyframe_encode(pipeline, &session, scratch.data(), scratch.size(), message.data(),
                               message.size(), &encoded) == UM_OK);
    text += line_of("  encoded", encoded.bytes, encoded.image_bytes, encoded.left_out,
                    checksum({message.data(), encoded.bytes}));
    text += "  labels";
    for (std::uint32_t i = 0; i < keyframe.scan_count; ++i) {
      std::vector<std::uint8_t> labels(20000);
      std::size_t written = 0;
      REQUIRE(um_labels(pipeline, i, labels.data(), labels.size(), &written) == UM_OK);
      labels.resize(written);
      text += " " + count(written) + " " +
              count(std::count(labels.begin(), labels.end(), UM_LABEL_DYNAMIC));
    }
    text += "\n";
    text += line_of("  relabelled", relabelled.available, relabelled.sequence,
                    relabelled.later_keyframes, relabelled.cells_now_dynamic,
                    relabelled.cells_now_static);
  };
  for (int i = 0; i < 42; ++i) {
    TownScan scan = frames.apply(town.scan(i));
    for (std::size_t k = 0; k < 20U + static_cast<std::size_t>(i); ++k) {
      scan.xyz[21 * k + k % 3] = std::numeric_limits<float>::quiet_NaN();
    }
    if (i == 14) scan.T_odometry_sensor.translation.x() += 100.0;
    if (i == 21) scan.xyz.clear();
    um_pose pose;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        pose.m[4 * row + column] = scan.T_odometry_sensor.rotation(row, column);
      }
      pose.m[4 * row + 3] = scan.T_odometry_sensor.translation(row);
    }
    const um_points points{scan.xyz.data(), scan.xyz.size() / 3, 12, 0, 4, 8};
    std::int32_t ready = 0;
    const um_status status =
        um_add_scan(pipeline, &points, &pose, 1 + i * std::int64_t{100000000}, &ready);
    if (status != UM_OK) text += line_of("scan", i, um_message(pipeline));
    if (ready == 1) look();
    um_event event;
    while (i % 6 == 5 && um_event_pop(pipeline, &event) == UM_OK) {
      text += line_of("event", event.id, "at", event.stamp_ns, event.values[0], event.values[1],
                      event.values[2], event.values[3]);
    }
  }
  std::int32_t ready = 0;
  REQUIRE(um_flush(pipeline, &ready) == UM_OK);
  if (ready == 1) look();
  text += line_of("events lost", um_events_lost(pipeline));
  check_expected("c_program", text + health_text(pipeline));
}
