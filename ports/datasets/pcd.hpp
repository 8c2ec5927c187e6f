// Parser of Point Cloud Data (PCD) files, version 0.7 and older.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Contents of a PCD header besides the fields.
struct PcdHeader {
  std::size_t points = 0;  ///< POINTS, or WIDTH times HEIGHT
  /// VIEWPOINT (tx ty tz qw qx qy qz), identity where the file has none; empty if it is not a
  /// finite pose with a unit quaternion.
  std::optional<Pose> viewpoint;
  std::size_t coordinate_bytes = 0;  ///< of the field x, as of doubles in ascii; 0 without one
};

/// Reads the header only, from the first bytes of a file. Throws DatasetError.
PcdHeader parse_pcd_header(std::string_view bytes, const std::filesystem::path& file);

/// Parses a whole file: ascii, binary or binary_compressed; x, y and z of any numeric type, and
/// intensity, ring and time where a field is called so (`role_of`). Other fields, `_` padding and
/// repeated counts are skipped. NaN points are kept. Coordinates count from `scan.origin`. `file`
/// names the bytes in errors. Throws DatasetError with offset or line. Never allocates more than a
/// small multiple of `bytes` (times LZF's largest expansion of about 88 for compressed data).
PcdHeader parse_pcd(std::string_view bytes, const std::filesystem::path& file, Scan& scan);

}  // namespace unimapper::datasets
