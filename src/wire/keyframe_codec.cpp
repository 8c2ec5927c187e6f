#include "unimapper/wire/keyframe_codec.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include "cell_key.hpp"
#include "keyframe_layout.hpp"
#include "keyframe_writer.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/core/quantise.hpp"

namespace unimapper::wire {

namespace {

/// The parts of a record that the writer takes as they are.
KeyframeContent content_of(const KeyframeRecord& record) {
  KeyframeContent content;
  content.sequence = record.sequence;
  content.reference_scan = record.reference_scan;
  content.T_odometry_keyframe = record.T_odometry_keyframe;
  content.up = record.up;
  content.scans = record.scans;
  content.static_cells = record.static_cells;
  content.dynamic_cells = record.dynamic_cells;
  content.image_shape = record.image_shape;
  content.image_full_weight_range_m = record.image_full_weight_range_m;
  content.place = record.place();
  content.points_in = record.points_in;
  content.points_dynamic = record.points_dynamic;
  return content;
}

const char* coded_image_fault(const KeyframeRecord& record) {
  if (record.images.empty()) return nullptr;
  if (const char* fault = image_head_fault(record.images.size(), record.image_shape,
                                           record.image_full_weight_range_m)) {
    return fault;
  }
  const std::size_t pixels = ImageProjection(record.image_shape).pixels();
  for (const CodedImage& image : record.images) {
    if (image.scan >= record.scans.size()) return "the scan of a free-space image is not there";
    if (!is_image_code(image.code, pixels)) return "a free-space image is damaged";
  }
  return nullptr;
}

/// Why a record cannot be a keyframe, or null.
const char* record_fault(const KeyframeRecord& record) {
  const char* fault = keyframe_fault(content_of(record));
  return fault != nullptr ? fault : coded_image_fault(record);
}

/// No encoded record is larger.
std::size_t max_encoded_bytes(const KeyframeRecord& record) {
  const std::size_t cells = record.static_cells.size() + record.dynamic_cells.size();
  std::size_t bytes =
      kHeadBytes + record.scans.size() * kScanBytes + record.keypoints.size() * kKeypointBytes +
      record.planes.size() * kPlaneBytes + 16 + cells * (kGroupBytes + kCellBytes) + 28 + kUpBytes;
  for (const CodedImage& image : record.images) bytes += 8 + image.code.size();
  return bytes;
}

// ---- reading

Pose get_pose(LittleEndianReader& in) {
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = in.get_double();
  }
  for (int axis = 0; axis < 3; ++axis) pose.translation[axis] = in.get_double();
  return pose;
}

OctahedralNormal get_normal(LittleEndianReader& in) {
  const auto u = in.get<std::int16_t>();
  const auto v = in.get<std::int16_t>();
  return {u, v};
}

const char* read_keypoints(LittleEndianReader& in, std::uint32_t count,
                           std::vector<Keypoint>& keypoints) {
  keypoints.resize(count);
  for (Keypoint& keypoint : keypoints) {
    Eigen::Vector3i steps;
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = in.get<std::int32_t>();
      if (steps[axis] < -kMillimetreLimit || steps[axis] > kMillimetreLimit) {
        return "a keypoint lies beyond the limit";
      }
    }
    const OctahedralNormal normal = get_normal(in);
    if (!is_canonical(normal)) return "a keypoint's normal is not canonical";
    keypoint.position = from_millimetres(steps);
    keypoint.normal = unit_vector(normal);
    keypoint.occupancy = in.get<std::uint64_t>();
    keypoint.strength = in.get<std::uint16_t>();
  }
  return nullptr;
}

const char* read_planes(LittleEndianReader& in, std::uint32_t count,
                        std::vector<PlanePatch>& planes) {
  planes.resize(count);
  for (PlanePatch& plane : planes) {
    Eigen::Vector3i steps;
    for (int axis = 0; axis < 3; ++axis) steps[axis] = in.get<std::int16_t>();
    const OctahedralNormal normal = get_normal(in);
    if (!is_canonical(normal)) return "a plane's normal is not canonical";
    plane.center = from_centimetres(steps);
    plane.normal = unit_vector(normal);
  }
  return nullptr;
}

/// The group part of a key and how many cells follow.
struct GroupHeader {
  std::uint64_t group = 0;
  std::uint32_t cells = 0;
};

GroupHeader get_group(LittleEndianReader& in) {
  GroupHeader header;
  for (int axis = 0; axis < 3; ++axis) header.group = (header.group << 8U) | in.get<std::uint8_t>();
  const auto count = in.get<std::uint16_t>();
  header.group = (header.group << 1U) | ((count & kGroundFlag) != 0 ? 0U : 1U);
  header.cells = count & kMaxGroupCells;
  return header;
}

const char* read_cells(LittleEndianReader& in, std::vector<FineCell>& cells) {
  const auto groups = in.get<std::uint32_t>();
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || groups > in.remaining() / kGroupBytes || count > in.remaining() / kCellBytes ||
      groups * kGroupBytes + count * kCellBytes > in.remaining()) {
    return "fewer bytes than cells";
  }
  cells.reserve(count);
  CellKey last_key = 0;
  GroupHeader last;
  for (std::uint32_t g = 0; g < groups; ++g) {
    const GroupHeader header = get_group(in);
    if (header.cells == 0) return "an empty group of cells";
    if (header.cells > count - cells.size()) return "more cells than announced";
    if (g > 0 && header.group == last.group && last.cells != kMaxGroupCells) {
      return "a group of cells is split for no reason";
    }
    last = header;
    for (std::uint32_t i = 0; i < header.cells; ++i) {
      CellKey key = header.group;
      for (int byte = 0; byte < 4; ++byte) key = (key << 8U) | in.get<std::uint8_t>();
      if (key < last_key) return "cells are not sorted";
      last_key = key;
      cells.push_back(cell_of(key));
    }
  }
  return cells.size() == count ? nullptr : "fewer cells than announced";
}

const char* read_images(LittleEndianReader& in, KeyframeRecord& record) {
  const auto count = in.get<std::uint32_t>();
  if (!in.ok()) return "fewer bytes than images";
  if (count == 0) return nullptr;
  if (count > kMaxImages) return "a count is beyond the limit";
  RangeImageShape& shape = record.image_shape;
  for (float* angle_deg :
       {&shape.horizontal_fov_deg, &shape.azimuth_resolution_deg, &shape.elevation_min_deg,
        &shape.elevation_max_deg, &shape.elevation_resolution_deg}) {
    *angle_deg = in.get_float();
  }
  record.image_full_weight_range_m = in.get_float();
  for (std::uint32_t i = 0; i < count; ++i) {
    CodedImage& image = record.images.emplace_back();
    image.scan = in.get<std::uint32_t>();
    const Bytes code = in.get_bytes(in.get<std::uint32_t>());
    if (!in.ok()) return "fewer bytes than images";
    image.code.assign(code.begin(), code.end());
  }
  return nullptr;
}

const char* read_up(LittleEndianReader& in, KeyframeUp& up) {
  up.variance_x = in.get_float();
  up.covariance_xy = in.get_float();
  up.variance_y = in.get_float();
  if (!in.ok()) return "fewer bytes than the covariance of up";
  up.known = up.variance_x > 0.0F;
  if (up.known) return nullptr;
  // One spelling of "unknown"; negative zeros are another.
  for (const float value : {up.variance_x, up.covariance_xy, up.variance_y}) {
    if (std::bit_cast<std::uint32_t>(value) != 0) return "the covariance of up is none";
  }
  return nullptr;
}

const char* read_record(LittleEndianReader& in, KeyframeRecord& record) {
  if (in.get<std::uint32_t>() != kKeyframeMagic) return "not a keyframe";
  const auto schema = in.get<std::uint16_t>();
  if (schema < kOldestKeyframeSchema || schema > kKeyframeSchema) return "unknown schema version";
  if (in.get<std::uint16_t>() != 0) return "reserved bytes are not zero";
  record.session.robot = in.get<std::uint32_t>();
  record.session.session = in.get<std::uint64_t>();
  record.sequence = in.get<std::uint32_t>();
  record.reference_scan = in.get<std::uint32_t>();
  record.points_in = in.get<std::uint64_t>();
  record.points_dynamic = in.get<std::uint64_t>();
  record.left_out = in.get<std::uint64_t>();
  record.T_odometry_keyframe = get_pose(in);
  const auto scans = in.get<std::uint32_t>();
  const auto keypoints = in.get<std::uint32_t>();
  const auto planes = in.get<std::uint32_t>();
  if (!in.ok()) return "shorter than a keyframe's head";
  if (scans > kMaxScans || keypoints > kMaxKeypoints || planes > kMaxPlanes) {
    return "a count is beyond the limit";
  }
  if (scans * kScanBytes + keypoints * kKeypointBytes + planes * kPlaneBytes > in.remaining()) {
    return "fewer bytes than scans, keypoints and planes";
  }
  record.scans.resize(scans);
  for (KeyframeScan& scan : record.scans) {
    scan.scan_index = in.get<std::uint32_t>();
    scan.stamp_ns = in.get<std::int64_t>();
    scan.T_odometry_sensor = get_pose(in);
  }
  if (const char* fault = read_keypoints(in, keypoints, record.keypoints)) return fault;
  if (const char* fault = read_planes(in, planes, record.planes)) return fault;
  if (const char* fault = read_cells(in, record.static_cells)) return fault;
  if (const char* fault = read_cells(in, record.dynamic_cells)) return fault;
  if (schema >= kFirstSchemaWithImages) {
    if (const char* fault = read_images(in, record)) return fault;
  }
  if (schema >= kFirstSchemaWithUp) {
    if (const char* fault = read_up(in, record.up)) return fault;
  }
  if (in.remaining() != 0) return "bytes are left over";
  return record_fault(record);
}

}  // namespace

std::vector<std::uint8_t> encode_keyframe(const KeyframeRecord& record) {
  if (const char* fault = record_fault(record)) throw std::invalid_argument(fault);
  const KeyframeContent content = content_of(record);
  const std::size_t cells = std::max(record.static_cells.size(), record.dynamic_cells.size());
  std::vector<CellKey> keys(2 * cells);
  std::vector<std::uint32_t> counts(CellKeyScratch::kCounts);
  const CellKeyScratch scratch{std::span(keys).first(cells), std::span(keys).subspan(cells),
                               counts};
  std::vector<std::uint8_t> bytes(max_encoded_bytes(record));
  const EncodeResult result = write_keyframe(
      {content, record.session, record.left_out, record.planes, record.images}, scratch, bytes);
  bytes.resize(result.bytes);
  return bytes;
}

DecodedKeyframe decode_keyframe(Bytes bytes) {
  DecodedKeyframe decoded;
  LittleEndianReader in(bytes);
  KeyframeRecord& record = decoded.record.emplace();
  if (const char* fault = read_record(in, record)) {
    decoded.error = std::string(fault) + " (at byte " + std::to_string(in.position()) + " of " +
                    std::to_string(bytes.size()) + ")";
    decoded.record.reset();
  }
  return decoded;
}

}  // namespace unimapper::wire
