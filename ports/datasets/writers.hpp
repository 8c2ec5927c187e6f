// Writers of datasets, trajectories, labels and PLY files.
//
// All throw DatasetError naming the file when it cannot be written completely (unwritable path,
// full disk).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Creates a directory and its parents. Throws DatasetError.
void make_directory(const std::filesystem::path& directory);

/// KITTI's *.bin: float32 x y z intensity, little endian, sensor frame, metres.
void write_kitti_scan(const std::filesystem::path& file, std::span<const Scan::Point> points);

/// SemanticKITTI's *.label: one uint32 per point.
void write_labels(const std::filesystem::path& file, std::span<const std::uint32_t> labels);

/// One row-major 3x4 matrix per line. Numbers have as many digits as reading them back
/// bit-identically takes (at most 17).
void write_kitti_poses(const std::filesystem::path& file, std::span<const Pose> poses);

/// One time in seconds per line, nine decimals: exact to the nanosecond.
void write_times(const std::filesystem::path& file, std::span<const std::int64_t> stamps_ns);

/// TUM trajectory: `t x y z qx qy qz qw`, t in seconds with nine decimals. The spans are equally
/// long.
void write_tum(const std::filesystem::path& file, std::span<const std::int64_t> stamps_ns,
               std::span<const Pose> poses);

/// Writes `text` as the whole file.
void write_text(const std::filesystem::path& file, std::string_view text);

/// Eight-bit colour.
struct Color {
  std::uint8_t red;    ///< 0 to 255
  std::uint8_t green;  ///< 0 to 255
  std::uint8_t blue;   ///< 0 to 255
};

/// One more property of every vertex of a PLY file.
struct PlyProperty {
  std::string name;  ///< as in the PLY header
  std::variant<std::span<const std::uint8_t>, std::span<const std::uint16_t>,
               std::span<const std::uint32_t>, std::span<const float>>
      values;  ///< one per vertex
};

/// Vertices of a PLY file; spans that are not empty must be as long as `positions`.
struct PlyCloud {
  std::span<const Eigen::Vector3f> positions;  ///< metres
  std::span<const Color> colors;               ///< may be empty
  std::vector<PlyProperty> properties;         ///< in the order written
};

/// Binary little-endian PLY: x y z [red green blue] [properties]. Throws DatasetError, also when
/// the spans differ in length.
void write_ply(const std::filesystem::path& file, const PlyCloud& cloud);

}  // namespace unimapper::datasets
