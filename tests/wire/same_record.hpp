// Comparison of records, member by member.
#pragma once

#include "tests/test.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::wire::wire_test {

inline bool same(const Pose& a, const Pose& b) {
  return a.rotation == b.rotation && a.translation == b.translation;
}

inline bool same(const std::vector<FineCell>& a, const std::vector<FineCell>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.position == y.position && x.points == y.points && x.ground == y.ground &&
           x.intensity == y.intensity;
  });
}

inline void check_same(const KeyframeRecord& a, const KeyframeRecord& b) {
  CHECK(a.session == b.session);
  CHECK(a.sequence == b.sequence);
  CHECK(a.reference_scan == b.reference_scan);
  CHECK(a.points_in == b.points_in);
  CHECK(a.points_dynamic == b.points_dynamic);
  CHECK(a.odometry_contradicted == b.odometry_contradicted);
  CHECK(a.left_out == b.left_out);
  CHECK(same(a.T_odometry_keyframe, b.T_odometry_keyframe));
  CHECK(a.up == b.up);
  CHECK(a.slip == b.slip);
  CHECK(std::equal(a.scans.begin(), a.scans.end(), b.scans.begin(), b.scans.end(),
                   [](const auto& x, const auto& y) {
                     return x.scan_index == y.scan_index && x.stamp_ns == y.stamp_ns &&
                            same(x.T_odometry_sensor, y.T_odometry_sensor);
                   }));
  CHECK(a.scans.size() == b.scans.size());
  CHECK(a.cell_size_m == b.cell_size_m);
  CHECK(same(a.static_cells, b.static_cells));
  CHECK(same(a.dynamic_cells, b.dynamic_cells));
  CHECK(std::equal(a.keypoints.begin(), a.keypoints.end(), b.keypoints.begin(), b.keypoints.end(),
                   [](const auto& x, const auto& y) {
                     return x.position == y.position && x.normal == y.normal &&
                            x.occupancy == y.occupancy && x.strength == y.strength;
                   }));
  CHECK(a.image_shape == b.image_shape);
  CHECK(a.image_full_weight_range_m == b.image_full_weight_range_m);
  CHECK(a.images == b.images);
  CHECK(std::equal(
      a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(),
      [](const auto& x, const auto& y) { return x.center == y.center && x.normal == y.normal; }));
}

}  // namespace unimapper::wire::wire_test
