#include "ports/shared_memory/c_keyframe.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>

#include "ports/c/unimapper.h"
#include "ports/shared_memory/section_writer.hpp"

namespace unimapper::shared_memory {

namespace {

// These are copied as they are.
static_assert(sizeof(um_cell) == sizeof(SharedCell));
static_assert(offsetof(um_cell, points) == offsetof(SharedCell, points));
static_assert(offsetof(um_cell, ground) == offsetof(SharedCell, ground));
static_assert(sizeof(um_plane) == sizeof(SharedPlane));
static_assert(offsetof(um_plane, normal) == offsetof(SharedPlane, normal));
static_assert(sizeof(um_capacity) == sizeof(SharedCapacity));

/// C has the translation in the rows of the rotation.
void put_c_pose(const um_pose& pose, double* out) noexcept {
  for (int row = 0; row < 3; ++row) {
    std::copy_n(pose.m + 4 * row, 3, out + 3 * row);
    out[9 + row] = pose.m[4 * row + 3];
  }
}

SharedScan shared_scan(const um_scan& scan) noexcept {
  SharedScan out = {};
  out.scan_index = scan.scan_index;
  out.stamp_ns = scan.stamp_ns;
  put_c_pose(scan.T_odometry_sensor, out.T_odometry_sensor);
  return out;
}

SharedKeypoint shared_keypoint(const um_keypoint& keypoint) noexcept {
  SharedKeypoint out = {};
  std::copy_n(keypoint.position, 3, out.position);
  std::copy_n(keypoint.normal, 3, out.normal);
  out.occupancy = keypoint.occupancy;
  out.strength = keypoint.strength;
  return out;
}

SharedLoop shared_loop(const um_loop& loop) noexcept {
  SharedLoop out = {};
  out.match_session = loop.session;
  out.match_keyframe = loop.keyframe;
  out.accepted = loop.accepted;
  out.confidence = loop.confidence;
  out.votes = loop.votes;
  out.inliers = loop.inliers;
  out.plane_overlap = loop.plane_overlap;
  put_c_pose(loop.T_match_query, out.T_match_query);
  return out;
}

SharedStatistics shared_statistics(const um_statistics& statistics) noexcept {
  SharedStatistics out = {};
  out.points_in = statistics.points_in;
  out.points_valid = statistics.points_valid;
  out.points_static = statistics.points_static;
  out.points_dynamic = statistics.points_dynamic;
  std::copy_n(statistics.dropped, std::size(out.dropped), out.dropped);
  for (std::size_t i = 0; i < std::size(out.capacity); ++i) {
    out.capacity[i] = {statistics.capacity[i].used, statistics.capacity[i].capacity};
  }
  std::copy_n(statistics.stage_us, std::size(out.stage_us), out.stage_us);
  out.deadline_missed = statistics.deadline_missed;
  return out;
}

}  // namespace

std::size_t write_c_keyframe(const um_keyframe& keyframe, const SessionId& session,
                             std::span<std::byte> out) noexcept {
  SharedKeyframe fixed = {};
  SectionWriter sections(sizeof fixed, out);
  fixed.scans = sections.convert(std::span(keyframe.scans, keyframe.scan_count), shared_scan);
  fixed.static_cells =
      sections.copy<SharedCell>(std::span(keyframe.static_cells, keyframe.static_cell_count));
  fixed.dynamic_cells =
      sections.copy<SharedCell>(std::span(keyframe.dynamic_cells, keyframe.dynamic_cell_count));
  fixed.keypoints =
      sections.convert(std::span(keyframe.keypoints, keyframe.keypoint_count), shared_keypoint);
  fixed.planes = sections.copy<SharedPlane>(std::span(keyframe.planes, keyframe.plane_count));
  fixed.loops = sections.convert(std::span(keyframe.loops, keyframe.loop_count), shared_loop);
  if (!sections.fits() || sections.bytes() > ~std::uint32_t{0}) return 0;
  fixed.head = head_of(ContentKind::kKeyframe, sections.bytes(), session, keyframe.sequence);
  fixed.reference_scan = keyframe.reference_scan;
  fixed.up_known = keyframe.up_known;
  std::copy_n(keyframe.up_covariance, 3, fixed.up_covariance);
  put_c_pose(keyframe.T_odometry_keyframe, fixed.T_odometry_keyframe);
  fixed.statistics = shared_statistics(keyframe.statistics);
  std::memcpy(out.data(), &fixed, sizeof fixed);
  return static_cast<std::size_t>(sections.bytes());
}

std::int64_t stamp_of(const um_keyframe& keyframe) noexcept {
  return keyframe.scan_count > 0 ? keyframe.scans[keyframe.scan_count - 1].stamp_ns : 0;
}

}  // namespace unimapper::shared_memory
