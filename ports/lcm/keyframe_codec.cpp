#include "ports/lcm/keyframe_codec.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ports/lcm/quantise.hpp"
#include "unimapper/core/image_code.hpp"

namespace unimapper::wire {

namespace {

constexpr std::size_t kScanBytes = 108;
constexpr std::size_t kKeypointBytes = 26;
constexpr std::size_t kPlaneBytes = 10;
constexpr std::size_t kGroupBytes = 5;
constexpr std::size_t kCellBytes = 4;

/// A group's count shares its 16 bits with the ground flag; longer runs take several groups.
constexpr std::uint32_t kMaxGroupCells = 0x7FFF;
constexpr std::uint16_t kGroundFlag = 0x8000;

/// Farther from the odometry's origin than any Earth-fixed grid reaches: a forged pose.
constexpr double kMaxTranslationM = 1e8;

/// The part of a key that a group shares: block and ground flag.
constexpr std::uint64_t group_of(CellKey key) { return key >> 32U; }

/// Why a record cannot be a keyframe, or null.
const char* pose_fault(const Pose& pose) {
  if (!pose.is_finite()) return "a pose is not finite";
  if (pose.translation.cwiseAbs().maxCoeff() > kMaxTranslationM) return "a pose is off the Earth";
  if (!pose.is_rigid()) return "a pose's rotation is not a rotation";
  return nullptr;
}

const char* image_fault(const KeyframeRecord& record) {
  if (record.images.empty()) return nullptr;
  if (record.images.size() > kMaxImages) return "a keyframe has too many free-space images";
  if (!is_image_shape(record.image_shape)) return "no image has such a field of view";
  // Also false for NaN; one zero, so that there is one spelling.
  const float sure_m = record.image_full_weight_range_m;
  const bool is_range = sure_m >= 0.0F && sure_m <= 10000.0F && !std::signbit(sure_m);
  if (!is_range) return "no image is sure up to such a range";
  std::vector<std::uint16_t> pixels(ImageProjection(record.image_shape).pixels());
  for (const CodedImage& image : record.images) {
    if (image.scan >= record.scans.size()) return "the scan of a free-space image is not there";
    if (!decode_image(image.code, pixels)) return "a free-space image is damaged";
  }
  return nullptr;
}

const char* record_fault(const KeyframeRecord& record) {
  if (record.scans.empty()) return "a keyframe has no scans";
  if (record.scans.size() > kMaxScans) return "a keyframe has too many scans";
  if (record.keypoints.size() > kMaxKeypoints) return "a keyframe has too many keypoints";
  if (record.planes.size() > kMaxPlanes) return "a keyframe has too many planes";
  if (record.reference_scan >= record.scans.size()) return "the reference scan is not there";
  if (const char* fault = image_fault(record)) return fault;
  if (record.points_dynamic > record.points_in) return "more points removed than came in";
  if (const char* fault = pose_fault(record.T_odometry_keyframe)) return fault;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    if (const char* fault = pose_fault(record.scans[i].T_odometry_sensor)) return fault;
    if (i == 0) continue;
    if (record.scans[i].scan_index <= record.scans[i - 1].scan_index) {
      return "scan indices do not ascend";
    }
    if (record.scans[i].stamp_ns < record.scans[i - 1].stamp_ns) return "scan stamps run backwards";
  }
  return nullptr;
}

// ---- writing

void put_pose(LittleEndianWriter& out, const Pose& pose) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.put(pose.rotation(row, column));
  }
  for (int axis = 0; axis < 3; ++axis) out.put(pose.translation[axis]);
}

void put_scan(LittleEndianWriter& out, const KeyframeScan& scan) {
  out.put(scan.scan_index);
  out.put(scan.stamp_ns);
  put_pose(out, scan.T_odometry_sensor);
}

void put_normal(LittleEndianWriter& out, OctahedralNormal normal) {
  out.put(normal.u);
  out.put(normal.v);
}

/// False if the keypoint lies beyond what can travel.
bool put_keypoint(LittleEndianWriter& out, const Keypoint& keypoint) {
  const auto steps = to_millimetres(keypoint.position);
  const auto normal = octahedral(keypoint.normal);
  if (!steps || !normal) return false;
  for (int axis = 0; axis < 3; ++axis) out.put((*steps)[axis]);
  put_normal(out, *normal);
  out.put(keypoint.occupancy);
  out.put(keypoint.strength);
  return true;
}

/// False if the plane lies beyond what can travel.
bool put_plane(LittleEndianWriter& out, const PlanePatch& plane) {
  const auto steps = to_centimetres(plane.center);
  const auto normal = octahedral(plane.normal);
  if (!steps || !normal) return false;
  for (int axis = 0; axis < 3; ++axis) out.put(static_cast<std::int16_t>((*steps)[axis]));
  put_normal(out, *normal);
  return true;
}

/// One past the last key of the group that starts at `first`.
std::size_t group_end(const std::vector<CellKey>& keys, std::size_t first) {
  const std::size_t limit = std::min<std::size_t>(keys.size(), first + kMaxGroupCells);
  std::size_t end = first + 1;
  while (end < limit && group_of(keys[end]) == group_of(keys[first])) ++end;
  return end;
}

void put_cells(LittleEndianWriter& out, const std::vector<CellKey>& keys) {
  std::uint32_t groups = 0;
  for (std::size_t i = 0; i < keys.size(); i = group_end(keys, i)) ++groups;
  out.put(groups);
  out.put(static_cast<std::uint32_t>(keys.size()));
  for (std::size_t first = 0; first < keys.size();) {
    const std::size_t end = group_end(keys, first);
    const CellKey key = keys[first];
    for (unsigned shift : {49U, 41U, 33U}) out.put(static_cast<std::uint8_t>(key >> shift));
    const std::uint16_t ground = (group_of(key) & 1U) == 0 ? kGroundFlag : 0;
    out.put(static_cast<std::uint16_t>((end - first) | ground));
    for (; first < end; ++first) {
      for (unsigned shift : {24U, 16U, 8U, 0U}) {
        out.put(static_cast<std::uint8_t>(keys[first] >> shift));
      }
    }
  }
}

void put_images(LittleEndianWriter& out, const KeyframeRecord& record) {
  out.put(static_cast<std::uint32_t>(record.images.size()));
  if (record.images.empty()) return;
  const RangeImageShape& shape = record.image_shape;
  for (const float angle_deg :
       {shape.horizontal_fov_deg, shape.azimuth_resolution_deg, shape.elevation_min_deg,
        shape.elevation_max_deg, shape.elevation_resolution_deg}) {
    out.put(angle_deg);
  }
  out.put(record.image_full_weight_range_m);
  for (const CodedImage& image : record.images) {
    out.put(image.scan);
    out.put(static_cast<std::uint32_t>(image.code.size()));
    out.put(Bytes(image.code));
  }
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
  if (schema > kOldestKeyframeSchema) {
    if (const char* fault = read_images(in, record)) return fault;
  }
  if (in.remaining() != 0) return "bytes are left over";
  return record_fault(record);
}

/// Calls `put` for every element; how many of them could travel.
template <typename Elements, typename Put>
std::uint32_t put_all(const Elements& elements, Put put) {
  std::uint32_t written = 0;
  for (const auto& element : elements) written += put(element) ? 1 : 0;
  return written;
}

}  // namespace

std::vector<std::uint8_t> encode_keyframe(const KeyframeRecord& record) {
  if (const char* fault = record_fault(record)) throw std::invalid_argument(fault);
  std::uint64_t left_out = record.left_out;
  const std::vector<CellKey> static_keys = cell_keys(record.static_cells, left_out);
  const std::vector<CellKey> dynamic_keys = cell_keys(record.dynamic_cells, left_out);

  std::vector<std::uint8_t> places;
  LittleEndianWriter place_out(places);
  const auto keypoints = put_all(record.keypoints, [&](const Keypoint& keypoint) {
    return put_keypoint(place_out, keypoint);
  });
  const auto planes =
      put_all(record.planes, [&](const PlanePatch& plane) { return put_plane(place_out, plane); });
  left_out += record.keypoints.size() - keypoints + record.planes.size() - planes;

  std::vector<std::uint8_t> bytes;
  bytes.reserve(256 + record.scans.size() * kScanBytes + places.size() +
                (static_keys.size() + dynamic_keys.size()) * (kCellBytes + 1));
  LittleEndianWriter out(bytes);
  out.put(kKeyframeMagic);
  out.put(kKeyframeSchema);
  out.put(std::uint16_t{0});
  out.put(record.session.robot);
  out.put(record.session.session);
  out.put(record.sequence);
  out.put(record.reference_scan);
  out.put(record.points_in);
  out.put(record.points_dynamic);
  out.put(left_out);
  put_pose(out, record.T_odometry_keyframe);
  out.put(static_cast<std::uint32_t>(record.scans.size()));
  out.put(keypoints);
  out.put(planes);
  for (const KeyframeScan& scan : record.scans) put_scan(out, scan);
  bytes.insert(bytes.end(), places.begin(), places.end());
  put_cells(out, static_keys);
  put_cells(out, dynamic_keys);
  put_images(out, record);
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
