#include "bench/faults/keyframes.hpp"

#include <cmath>
#include <cstdio>

#include "bench/faults/random.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/wire/checksum.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::bench {

namespace {

constexpr std::uint32_t kScans = 10;
constexpr std::uint32_t kKeypoints = 32;
constexpr std::uint32_t kOverheadBytes = 2200;  // of scans, keypoints and heads
constexpr double kCellsPerSquareMetre = 45.0;
constexpr double kBytesPerCell = 1.08;
constexpr double kSpacing_m = 1.0;

FineCell random_cell(Random& random, double reach_m) {
  FineCell cell{};
  const bool ground = random.below(2) == 0;
  const double x = random.uniform(-reach_m, reach_m);
  const double y = random.uniform(-reach_m, reach_m);
  const double z = ground ? -1.7 : random.uniform(-1.5, 4.0);
  cell.position = Eigen::Vector3d(x, y, z).cast<float>();
  cell.points = 1;
  cell.ground = ground ? 1 : 0;
  return cell;
}

Keypoint random_keypoint(Random& random) {
  Keypoint keypoint{};
  const double x = random.uniform(-20.0, 20.0);
  const double y = random.uniform(-20.0, 20.0);
  keypoint.position = Eigen::Vector3d(x, y, random.uniform(-1.5, 4.0)).cast<float>();
  keypoint.normal = Eigen::Vector3f::UnitX();
  keypoint.occupancy = random.bits();
  keypoint.strength = static_cast<std::uint16_t>(random.below(65536));
  return keypoint;
}

/// Every second pixel differs from the one before: a byte of code each, and the range code of the
/// repeated pattern is short.
CodedImage generate_image(std::uint32_t scan, std::size_t pixels) {
  std::vector<std::uint16_t> ranges(pixels);
  for (std::size_t i = 0; i < pixels; ++i) ranges[i] = i % 2 == 0 ? 1280 : 1310;
  CodedImage image;
  image.scan = scan;
  image.code.resize(max_image_code(pixels));
  image.code.resize(encode_image(ranges, image.code));
  return image;
}

}  // namespace

KeyframeRecord generate_record(const SessionId& session, std::uint32_t sequence, std::uint64_t seed,
                               const KeyframeSize& size) {
  Random random(seed, sequence);
  KeyframeRecord record;
  record.session = session;
  record.sequence = sequence;
  record.reference_scan = kScans / 2;
  record.scans.resize(kScans);
  for (std::uint32_t i = 0; i < kScans; ++i) {
    KeyframeScan& scan = record.scans[i];
    scan.scan_index = sequence * kScans + i;
    scan.stamp_ns = 1'600'000'000'000'000'000 + 100'000'000LL * scan.scan_index;
    scan.T_odometry_sensor.translation = {kSpacing_m * (sequence + 0.1 * i), size.shift_m, 0.0};
  }
  record.T_odometry_keyframe = record.scans[record.reference_scan].T_odometry_sensor;
  const double content = size.bytes > kOverheadBytes ? size.bytes - kOverheadBytes : 0.0;
  const auto cells = static_cast<std::uint32_t>(content / kBytesPerCell);
  const double reach_m = std::sqrt(cells / kCellsPerSquareMetre) / 2.0;
  for (std::uint32_t i = 0; i < cells; ++i) {
    record.static_cells.push_back(random_cell(random, reach_m));
  }
  const std::uint32_t keypoints = size.bytes > kOverheadBytes ? kKeypoints : 0;
  for (std::uint32_t i = 0; i < keypoints; ++i) {
    record.keypoints.push_back(random_keypoint(random));
  }
  if (size.images > 0) {
    record.image_shape = {360.0F, 1.0F, 0.0F, static_cast<float>(size.image_rows), 1.0F};
    record.image_full_weight_range_m = 10.0F;
  }
  const std::size_t pixels = ImageProjection(record.image_shape).pixels();
  for (std::uint32_t i = 0; i < size.images; ++i) {
    record.images.push_back(generate_image(i % kScans, pixels));
  }
  record.points_in = 200000 + random.below(1000);
  record.points_dynamic = random.below(1000);
  return record;
}

wire::EncodedKeyframe generate_keyframe(const SessionId& session, std::uint32_t sequence,
                                        std::uint64_t seed, const KeyframeSize& size) {
  const KeyframeRecord record = generate_record(session, sequence, seed, size);
  wire::EncodedKeyframe keyframe;
  keyframe.session = session;
  keyframe.sequence = sequence;
  keyframe.stamp_ns = record.scans.back().stamp_ns;
  keyframe.bytes = wire::encode_keyframe(record);
  return keyframe;
}

std::string name_of(std::uint32_t sequence, wire::Bytes bytes) {
  char text[64];
  std::snprintf(text, sizeof text, "%u %zu %08x", sequence, bytes.size(), wire::crc32(bytes));
  return text;
}

}  // namespace unimapper::bench
