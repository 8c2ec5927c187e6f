// Keyframes, events and health as C programs see them, of a tilted sensor
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <string>
#include <vector>

#include "expected_text.hpp"
#include "ports/c/unimapper.h"
#include "tilted_town.hpp"
#include "unimapper/core/owned.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

std::int64_t ticks_ns = 0;
std::int64_t ticking_clock() { return ticks_ns += 250000; }

std::string number(float value) { return fixed(static_cast<double>(value), 3); }

std::string pose_text(const um_pose& pose) {
  Pose p;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) p.rotation(row, column) = pose.m[4 * row + column];
    p.translation(row) = pose.m[4 * row + 3];
  }
  return regression::pose_text(p);
}

std::string statistics_text(const um_statistics& s) {
  std::string text =
      join("  points", count(s.points_in), count(s.points_valid), count(s.points_static),
           count(s.points_dynamic), "cells", count(s.cells), count(s.dynamic_cells), "voxels",
           count(s.voxels), count(s.ground_voxels), "components", count(s.components), "missed",
           count(s.deadline_missed), "noise", number(s.attitude_noise_deg)) +
      "\n  dropped";
  for (const std::uint64_t dropped : s.dropped) text += " " + count(dropped);
  text += "\n  capacity";
  for (const um_capacity& c : s.capacity) text += " " + count(c.used) + "/" + count(c.capacity);
  text += "\n  stages";
  for (const float us : s.stage_us) text += " " + fixed(static_cast<double>(us), 1);
  return text + "\n";
}

std::string keyframe_text(const um_keyframe& k) {
  std::string text = join("keyframe", count(k.sequence), "reference", count(k.reference_scan),
                          "scans", count(k.scan_count), pose_text(k.T_odometry_keyframe)) +
                     "\n";
  for (std::uint32_t i = 0; i < k.scan_count; ++i) {
    text += join("  scan", count(k.scans[i].scan_index), count(k.scans[i].stamp_ns),
                 pose_text(k.scans[i].T_odometry_sensor)) +
            "\n";
  }
  const auto cells_text = [](const um_cell* cells, std::size_t size) {
    CloudMoments moments;
    std::uint64_t points = 0;
    std::uint64_t ground = 0;
    for (std::size_t i = 0; i < size; ++i) {
      moments.add(
          Eigen::Vector3f(cells[i].position[0], cells[i].position[1], cells[i].position[2]));
      points += cells[i].points;
      ground += cells[i].ground;
    }
    return join(moments.text(), "points", count(points), "ground", count(ground));
  };
  text += "  static " + cells_text(k.static_cells, k.static_cell_count) + "\n";
  text += "  dynamic " + cells_text(k.dynamic_cells, k.dynamic_cell_count) + "\n";
  CloudMoments keypoints;
  CloudMoments normals;
  for (std::size_t i = 0; i < k.keypoint_count; ++i) {
    keypoints.add(Eigen::Vector3f(k.keypoints[i].position[0], k.keypoints[i].position[1],
                                  k.keypoints[i].position[2]));
    normals.add(Eigen::Vector3f(k.keypoints[i].normal[0], k.keypoints[i].normal[1],
                                k.keypoints[i].normal[2]));
  }
  CloudMoments planes;
  for (std::size_t i = 0; i < k.plane_count; ++i) {
    planes.add(
        Eigen::Vector3f(k.planes[i].center[0], k.planes[i].center[1], k.planes[i].center[2]));
  }
  text += "  planes " + planes.text() + "\n";
  text += "  keypoints " + keypoints.text() + "\n  normals " + normals.text() + "\n";
  for (std::size_t i = 0; i < k.loop_count; ++i) {
    const um_loop& loop = k.loops[i];
    text += join("  loop", count(loop.session), count(loop.keyframe), number(loop.confidence),
                 count(loop.accepted), count(loop.votes), count(loop.inliers),
                 number(loop.plane_overlap), pose_text(loop.T_match_query)) +
            "\n";
  }
  text += join("  up", count(k.up_known), count(k.up_contradicted),
               rough(static_cast<double>(k.up_covariance[0])),
               rough(static_cast<double>(k.up_covariance[1])),
               rough(static_cast<double>(k.up_covariance[2])), number(k.odometry_tilt_deg)) +
          "\n";
  const um_input& in = k.input;
  text += join("  input", number(in.ray_spacing_deg), number(in.ring_spacing_deg),
               number(in.image_elevation_min_deg), number(in.image_elevation_max_deg),
               count(in.rays_differ), count(in.elevations_differ), count(in.mode_changes),
               number(in.attitude_noise_deg), number(in.sweep_tilt_deg), count(in.aligned_scans),
               count(in.up_known), number(in.odometry_tilt_deg), number(in.up_sigma_deg)) +
          "\n";
  return text + statistics_text(k.statistics);
}

std::string health_text(um_pipeline* pipeline) {
  um_health h;
  h.struct_size = sizeof h;
  REQUIRE(um_health_get(pipeline, &h) == UM_OK);
  std::string text = join("health scans", count(h.scans), "refused", count(h.scans_refused),
                          "keyframes", count(h.keyframes), "points", count(h.points_in), "dynamic",
                          count(h.points_dynamic), "missed", count(h.deadline_misses)) +
                     "\n  dropped";
  for (const std::uint64_t dropped : h.dropped) text += " " + count(dropped);
  text += "\n  fullest";
  for (const um_capacity& c : h.fullest) text += " " + count(c.used) + "/" + count(c.capacity);
  text += "\n  longest";
  for (const float us : h.longest_stage_us) text += " " + fixed(static_cast<double>(us), 1);
  return text + "\n";
}

}  // namespace

TEST_CASE("a C program's keyframes, events and health, as before on every platform",
          "[regression]") {
  ticks_ns = 0;
  um_config config;
  REQUIRE(um_config_init(&config, sizeof config, UM_SENSOR_HDL_64E) == UM_OK);
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
    keyframe.struct_size = sizeof keyframe;
    REQUIRE(um_keyframe_get(pipeline, &keyframe) == UM_OK);
    text += keyframe_text(keyframe);
    um_relabelled relabelled;
    REQUIRE(um_relabelled_get(pipeline, &relabelled) == UM_OK);
    um_images images;
    images.struct_size = sizeof images;
    REQUIRE(um_images_get(pipeline, &images) == UM_OK);
    for (std::uint32_t i = 0; i < images.count; ++i) {
      std::uint64_t sum = 0;
      for (std::uint32_t p = 0; p < images.columns * images.rows; ++p) sum += images.pixels[i][p];
      text += join("  image", count(images.scans[i]), count(images.columns), count(images.rows),
                   number(images.azimuth_resolution_deg), number(images.elevation_min_deg),
                   number(images.full_weight_range_m), "sum", count(sum)) +
              "\n";
    }
    const um_session session{5, 0, 0, 77};
    um_encoded encoded;
    REQUIRE(um_keyframe_encode(pipeline, &session, scratch.data(), scratch.size(), message.data(),
                               message.size(), &encoded) == UM_OK);
    text += join("  encoded", count(encoded.bytes), count(encoded.image_bytes),
                 count(encoded.left_out), checksum({message.data(), encoded.bytes})) +
            "\n";
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
    text += join("  relabelled", count(relabelled.available), count(relabelled.sequence),
                 count(relabelled.later_keyframes), count(relabelled.cells_now_dynamic),
                 count(relabelled.cells_now_static)) +
            "\n";
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
    if (status != UM_OK) text += join("scan", count(i), um_message(pipeline)) + "\n";
    if (ready == 1) look();
    um_event event;
    while (i % 6 == 5 && um_event_pop(pipeline, &event) == UM_OK) {
      text += join("event", count(event.id), "at", count(event.stamp_ns), count(event.values[0]),
                   count(event.values[1]), count(event.values[2]), count(event.values[3])) +
              "\n";
    }
  }
  std::int32_t ready = 0;
  REQUIRE(um_flush(pipeline, &ready) == UM_OK);
  if (ready == 1) look();
  text += join("events lost", count(um_events_lost(pipeline))) + "\n";
  check_expected("c_program", text + health_text(pipeline));
}
