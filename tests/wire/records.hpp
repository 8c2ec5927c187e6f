// Keyframe records for tests: a small fixed one and random ones.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "src/core/image_code.hpp"
#include "tests/random.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::wire::wire_test {

using unimapper::test::Random;

/// A vector of a cube about the origin, twice as wide as `extent`. Not inlined: GCC 12 at -O3
/// leaves out the rounding to float where two components are at once converted to double again.
[[gnu::noinline]] inline Eigen::Vector3f random_vector(Random& random, double extent) {
  const double x = random.uniform(-extent, extent);
  const double y = random.uniform(-extent, extent);
  return Eigen::Vector3d(x, y, random.uniform(-extent, extent)).cast<float>();
}

inline Pose random_pose(Random& random) {
  const Eigen::Vector3f axis = random_vector(random, 1.0);
  const Eigen::Quaterniond q(random.uniform(0.1, 1.0), axis.x(), axis.y(), axis.z());
  return {q, random_vector(random, 5000.0).cast<double>()};
}

inline FineCell random_cell(Random& random, double extent) {
  FineCell cell{};
  cell.position = random_vector(random, extent);
  cell.points = static_cast<std::uint16_t>(1 + random.below(400));
  cell.ground = static_cast<std::uint8_t>(random.below(2));
  return cell;
}

/// A unit vector, the same to the last bit on every processor: ARMv7 has no vector division, so
/// that Eigen's `normalized` approximates there.
inline Eigen::Vector3f random_direction(Random& random) {
  const Eigen::Vector3f v = random_vector(random, 1.0);
  const float length = std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
  return {v.x() / length, v.y() / length, v.z() / length};
}

/// An image with runs, ramps and jumps.
inline std::vector<std::uint8_t> random_image(Random& random, std::size_t pixels) {
  std::vector<std::uint16_t> ranges(pixels);
  std::uint16_t range = 0;
  for (std::uint16_t& pixel : ranges) {
    const std::uint32_t dice = random.below(10);
    if (dice == 0) range = static_cast<std::uint16_t>(random.below(65536));
    if (dice == 1) range = 0;
    if (dice == 2) range = static_cast<std::uint16_t>(std::min(65535U, range + range / 16U));
    pixel = range;
  }
  std::vector<std::uint8_t> code(max_image_code(pixels));
  code.resize(encode_image(ranges, code));
  return code;
}

/// A keyframe with about `cells` cells, off the wire's grid.
/// Slip along one axis by so many metres, as the square root of it.
inline SlipCovariance along(const Eigen::Vector3f& axis_m) { return axis_m * axis_m.transpose(); }

inline KeyframeRecord random_record(std::uint64_t seed, std::uint32_t cells = 200) {
  Random random(mix_bits(seed));
  KeyframeRecord record;
  record.session = {random.below(1000), {~seed, random.bits()}};
  record.sequence = random.below(100000);
  record.T_odometry_keyframe = random_pose(random);
  if (random.below(3) != 0) record.up = {true, 4e-5F, -1e-5F, 9e-5F};
  record.scans.resize(1 + random.below(12));
  record.reference_scan = random.below(static_cast<std::uint32_t>(record.scans.size()));
  std::int64_t stamp_ns = 1'600'000'000'000'000'000 + static_cast<std::int64_t>(random.below(1000));
  for (std::uint32_t i = 0; i < record.scans.size(); ++i) {
    record.scans[i] = {1000 + 3 * i, stamp_ns += 100'000'000, random_pose(random)};
  }
  if (random.below(3) == 0) record.cell_size_m = 0.05F * static_cast<float>(1 + random.below(20));
  for (std::uint32_t i = 0; i < cells; ++i) {
    record.static_cells.push_back(random_cell(random, i % 3 == 0 ? 300.0 : 20.0));
  }
  for (std::uint32_t i = 0; i < cells / 10; ++i) {
    record.dynamic_cells.push_back(random_cell(random, 30.0));
  }
  for (std::uint32_t i = 0; i < random.below(160); ++i) {
    record.keypoints.push_back({random_vector(random, 100.0), random_direction(random),
                                random.bits(), static_cast<std::uint16_t>(random.below(65536))});
  }
  for (std::uint32_t i = 0; i < random.below(300); ++i) {
    record.planes.push_back({random_vector(random, 100.0), random_direction(random)});
  }
  const std::uint32_t images = random.below(4);
  if (images > 0) {
    record.image_shape = {120.0F, 2.0F, -20.0F, 30.0F, 2.5F};
    record.image_full_weight_range_m = 11.5F;
  }
  const std::size_t pixels = ImageProjection(record.image_shape).pixels();
  for (std::uint32_t i = 0; i < images; ++i) {
    const std::uint32_t scan = random.below(static_cast<std::uint32_t>(record.scans.size()));
    record.images.push_back({scan, random_image(random, pixels)});
  }
  record.points_in = 500000 + random.below(1000);
  record.points_dynamic = random.below(500000);
  return record;
}

/// A record small enough to read its bytes.
inline KeyframeRecord small_record() {
  KeyframeRecord record;
  record.session = {7, {0xFEDCBA9876543210ULL, 0x0123456789ABCDEFULL}};
  record.sequence = 42;
  record.reference_scan = 1;
  record.T_odometry_keyframe.translation = {1.5, -2.0, 0.25};
  record.scans.resize(2);
  record.scans[0] = {420, 1'000'000'000, Pose()};
  record.scans[1] = {421, 1'100'000'000, record.T_odometry_keyframe};
  record.static_cells = {{{1.0F, 2.0F, -1.5F}, 3, 1, 0}, {{1.2F, 2.0F, -0.5F}, 300, 0, 0}};
  record.dynamic_cells = {{{-4.0F, 0.5F, 0.0F}, 9, 0, 0}};
  record.keypoints = {{{1.234F, -5.678F, 9.0F}, {0.0F, 0.6F, -0.8F}, 0xF0F0ULL, 513}};
  record.planes = {{{3.0F, 4.0F, -1.7F}, {0.0F, 0.0F, 1.0F}}};
  // One row of three pixels: nothing known, 1 m, the same.
  record.image_shape = {90.0F, 30.0F, 0.0F, 30.0F, 30.0F};
  record.image_full_weight_range_m = 64.0F;
  record.images = {{1, {0x00, 0xE0, 0x5D, 0x00}}};
  record.points_in = 1000;
  record.points_dynamic = 10;
  return record;
}

/// A file that never meets a disk: for tests that write thousands.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("unimapper_test", 0)) {}
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Replaces the content.
  void write(const void* bytes, std::size_t size) {
    const bool written = ftruncate(descriptor_, 0) == 0 &&
                         pwrite(descriptor_, bytes, size, 0) == static_cast<ssize_t>(size);
    if (!written) throw std::runtime_error("no memory for a file");
  }
  [[nodiscard]] std::filesystem::path path() const {
    return "/proc/self/fd/" + std::to_string(descriptor_);
  }

 private:
  int descriptor_;
};

}  // namespace unimapper::wire::wire_test
