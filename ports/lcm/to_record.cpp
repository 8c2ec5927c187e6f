#include "ports/lcm/to_record.hpp"

#include "ports/lcm/quantise.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::wire {
namespace {

std::vector<std::uint8_t> code_of(const FreeSpaceImage& image) {
  std::vector<std::uint8_t> code(max_image_code(image.pixels.size()));
  code.resize(encode_image(image.pixels, code));
  code.shrink_to_fit();
  return code;
}

}  // namespace

KeyframeRecord to_record(const KeyframeView& keyframe, const SessionId& session) {
  KeyframeRecord record;
  record.session = session;
  record.sequence = keyframe.sequence;
  record.reference_scan = keyframe.reference_scan;
  record.T_odometry_keyframe = keyframe.T_odometry_keyframe;
  record.scans.assign(keyframe.scans.begin(), keyframe.scans.end());
  record.static_cells.assign(keyframe.static_cells.begin(), keyframe.static_cells.end());
  record.dynamic_cells.assign(keyframe.dynamic_cells.begin(), keyframe.dynamic_cells.end());
  record.keypoints.assign(keyframe.place.keypoints.begin(), keyframe.place.keypoints.end());
  // Planes follow from the static cells at the base (`merge::PlaneRestorer`): three kilobytes of
  // keypoints are the whole descriptor.
  if (!keyframe.images.empty()) {
    record.image_shape = keyframe.image_shape;
    record.image_full_weight_range_m = keyframe.image_full_weight_range_m;
  }
  for (const FreeSpaceImage& image : keyframe.images) {
    record.images.push_back({image.scan, code_of(image)});
  }
  if (keyframe.statistics != nullptr) {
    record.points_in = keyframe.statistics->points_in;
    record.points_dynamic = keyframe.statistics->points_dynamic;
  }
  quantise(record);
  return record;
}

}  // namespace unimapper::wire
