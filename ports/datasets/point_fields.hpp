// Fields of point records in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Type of a number in a record.
enum class Scalar : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64, kI64, kU64 };

/// Bytes of a number.
[[nodiscard]] std::size_t scalar_bytes(Scalar type);

/// The number at `at`, whose bytes are reversed where `is_swapped`.
[[nodiscard]] double load_scalar(const char* at, Scalar type, bool is_swapped = false);

/// A number in every record.
struct PointField {
  /// As the file or the user names it; `_`: skipped.
  std::string name;
  /// How its numbers are stored.
  Scalar type = Scalar::kF32;
  std::size_t offset = 0;  ///< from the start of the record, bytes
};

/// Records of one size.
struct RecordLayout {
  /// In the order of the record.
  std::vector<PointField> fields;
  std::size_t bytes = 0;    ///< of a record, at least 1
  bool is_swapped = false;  ///< big endian
};

/// What a reader takes of a point; found by the names that drivers give.
enum class PointRole : std::uint8_t { kX, kY, kZ, kIntensity, kRing, kTime };
inline constexpr std::size_t kPointRoles = 6;

/// The role of a field called `name` (any letter case): x, y, z; intensity, i, reflectivity,
/// remission, scalar_intensity; ring, line, laser, channel; time, t, timestamp, time_offset.
[[nodiscard]] std::optional<PointRole> role_of(std::string_view name);

/// Points of numbers that come one point at a time, in the roles that are there. Times are those of
/// `find_clock`; where they do not count from the scan's stamp they are offsets from the earliest.
class ScanBuilder {
 public:
  ScanBuilder(Scan& scan, std::size_t points, bool has_ring, bool has_time);
  /// `values` by role, time in any unit; those of absent roles are ignored.
  void add(const double (&values)[kPointRoles]);
  /// Call once, after all points.
  void finish();

 private:
  Scan& scan_;
  bool has_ring_;
  std::vector<double> times_;
  bool has_time_;
};

/// The field of each role, in order of `PointRole`; null where there is none.
[[nodiscard]] std::vector<const PointField*> fields_by_role(const RecordLayout& layout);

/// Decodes whole records; a partial one at the end is left out. The layout has x, y and z.
void decode_records(std::string_view bytes, const RecordLayout& layout, Scan& scan);

/// `decode_records` of a file; KITTI's records go right into the points. Throws DatasetError.
void read_records(const std::filesystem::path& file, const RecordLayout& layout, Scan& scan);

/// The layout that `--point-fields` describes: names in order, separated by blanks or commas, each
/// a float32 or `name:type` with type i1 u1 i2 u2 i4 u4 f4 f8; `_` is skipped. Throws DatasetError.
[[nodiscard]] RecordLayout parse_point_fields(std::string_view text);

}  // namespace unimapper::datasets
