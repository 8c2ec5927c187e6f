#include "ports/datasets/point_fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <span>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/point_clock.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::datasets {

std::size_t scalar_bytes(Scalar type) {
  constexpr std::array<std::size_t, 10> kBytes = {1, 1, 2, 2, 4, 4, 4, 8, 8, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

namespace {

template <typename Value>
double load_ordered(const char* at, bool is_swapped) {
  std::array<char, sizeof(Value)> bytes;
  std::memcpy(bytes.data(), at, bytes.size());
  if (is_swapped) std::reverse(bytes.begin(), bytes.end());
  Value value;
  std::memcpy(&value, bytes.data(), bytes.size());
  return static_cast<double>(value);
}

}  // namespace

double load_scalar(const char* at, Scalar type, bool is_swapped) {
  switch (type) {
    case Scalar::kI8:
      return load_ordered<std::int8_t>(at, is_swapped);
    case Scalar::kU8:
      return load_ordered<std::uint8_t>(at, is_swapped);
    case Scalar::kI16:
      return load_ordered<std::int16_t>(at, is_swapped);
    case Scalar::kU16:
      return load_ordered<std::uint16_t>(at, is_swapped);
    case Scalar::kI32:
      return load_ordered<std::int32_t>(at, is_swapped);
    case Scalar::kU32:
      return load_ordered<std::uint32_t>(at, is_swapped);
    case Scalar::kI64:
      return load_ordered<std::int64_t>(at, is_swapped);
    case Scalar::kU64:
      return load_ordered<std::uint64_t>(at, is_swapped);
    case Scalar::kF64:
      return load_ordered<double>(at, is_swapped);
    case Scalar::kF32:
      break;
  }
  return load_ordered<float>(at, is_swapped);
}

std::optional<PointRole> role_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, PointRole>, 20> kNames = {{
      {"x", PointRole::kX},
      {"y", PointRole::kY},
      {"z", PointRole::kZ},
      {"intensity", PointRole::kIntensity},
      {"i", PointRole::kIntensity},
      {"reflectivity", PointRole::kIntensity},
      {"remission", PointRole::kIntensity},
      {"scalar_intensity", PointRole::kIntensity},
      {"ring", PointRole::kRing},
      {"line", PointRole::kRing},
      {"laser", PointRole::kRing},
      {"laser_id", PointRole::kRing},
      {"channel", PointRole::kRing},
      {"scalar_ring", PointRole::kRing},
      {"time", PointRole::kTime},
      {"t", PointRole::kTime},
      {"timestamp", PointRole::kTime},
      {"time_offset", PointRole::kTime},
      {"offset_time", PointRole::kTime},
      {"scalar_time", PointRole::kTime},
  }};
  const std::string lower = lower_case(name);
  for (const auto& [known, role] : kNames) {
    if (known == lower) return role;
  }
  return std::nullopt;
}

ScanBuilder::ScanBuilder(Scan& scan, std::size_t points, bool has_ring, bool has_time)
    : scan_(scan), has_ring_(has_ring), has_time_(has_time) {
  scan_.reset(0);
  scan_.points.reserve(points);
  if (has_ring_) scan_.ring.reserve(points);
  if (has_time_) times_.reserve(points);
}

void ScanBuilder::add(const double (&values)[kPointRoles]) {
  const auto value = [&](PointRole role) { return values[static_cast<std::size_t>(role)]; };
  const auto coordinate = [&](PointRole role, int axis) {
    return static_cast<float>(value(role) - scan_.origin[axis]);
  };
  scan_.points.push_back({coordinate(PointRole::kX, 0), coordinate(PointRole::kY, 1),
                          coordinate(PointRole::kZ, 2),
                          static_cast<float>(value(PointRole::kIntensity))});
  if (has_ring_) {
    constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
    const double ring = value(PointRole::kRing);
    scan_.ring.push_back(ring >= 0.0 && ring <= kMost ? static_cast<std::uint16_t>(ring)
                                                      : std::uint16_t{0});
  }
  if (has_time_) times_.push_back(value(PointRole::kTime));
}

void ScanBuilder::finish() {
  const TimeRange range = sweep_range(times_);
  const auto clock = find_clock(range, std::nullopt);
  if (!clock) return;
  const double origin = clock->zero == PointClock::Zero::kStamp ? 0.0 : range.least;
  scan_.time_s.reserve(times_.size());
  for (const double time : times_) {
    scan_.add_time(time, origin, clock->seconds_per_unit, range.contains(time));
  }
}

std::vector<const PointField*> fields_by_role(const RecordLayout& layout) {
  std::vector<const PointField*> found(kPointRoles, nullptr);
  for (const PointField& field : layout.fields) {
    const auto role = role_of(field.name);
    if (!role) continue;
    const PointField*& of_role = found[static_cast<std::size_t>(*role)];
    if (of_role == nullptr) of_role = &field;
  }
  return found;
}

namespace {

/// Records that lie in memory as a scan's points do: KITTI's.
bool is_points(const RecordLayout& layout, const std::vector<const PointField*>& fields) {
  if (layout.bytes != sizeof(Scan::Point) || layout.is_swapped) return false;
  for (std::size_t role = 0; role < 4; ++role) {
    const PointField* field = fields[role];
    if (field == nullptr || field->type != Scalar::kF32 || field->offset != role * sizeof(float)) {
      return false;
    }
  }
  return true;
}

/// The first field of times whose numbers differ, else `first`: some drivers leave one at zero.
const PointField* time_field(std::string_view bytes, const RecordLayout& layout,
                             const PointField* first) {
  const auto number = [&](std::size_t i, const PointField& field) {
    return load_scalar(bytes.data() + i * layout.bytes + field.offset, field.type,
                       layout.is_swapped);
  };
  constexpr std::size_t kMost = 300;
  const std::size_t points = bytes.size() / layout.bytes;
  const std::size_t step = points / kMost + 1;
  for (const PointField& field : layout.fields) {
    if (role_of(field.name) != PointRole::kTime) continue;
    for (std::size_t i = step; i < points; i += step) {
      if (number(i, field) != number(0, field)) return &field;
    }
  }
  return first;
}

}  // namespace

void decode_records(std::string_view bytes, const RecordLayout& layout, Scan& scan) {
  auto fields = fields_by_role(layout);
  if (is_points(layout, fields) && scan.origin.isZero()) {
    scan.reset(bytes.size() / sizeof(Scan::Point));
    if (!scan.points.empty()) {
      std::memcpy(scan.points.data(), bytes.data(), scan.points.size() * sizeof(Scan::Point));
    }
    return;
  }
  const PointField*& time = fields[static_cast<std::size_t>(PointRole::kTime)];
  const bool has_time = time != nullptr;
  if (has_time) time = time_field(bytes, layout, time);
  const bool has_ring = fields[static_cast<std::size_t>(PointRole::kRing)] != nullptr;
  const std::size_t points = bytes.size() / layout.bytes;
  ScanBuilder builder(scan, points, has_ring, has_time);
  for (std::size_t i = 0; i < points; ++i) {
    const char* record = bytes.data() + i * layout.bytes;
    double values[kPointRoles] = {};
    for (std::size_t role = 0; role < kPointRoles; ++role) {
      const PointField* field = fields[role];
      if (field == nullptr) continue;
      values[role] = load_scalar(record + field->offset, field->type, layout.is_swapped);
    }
    builder.add(values);
  }
  builder.finish();
}

void read_records(const std::filesystem::path& file, const RecordLayout& layout, Scan& scan) {
  if (!is_points(layout, fields_by_role(layout)) || !scan.origin.isZero()) {
    return decode_records(read_file(file), layout, scan);
  }
  scan.reset(static_cast<std::size_t>(file_bytes(file)) / sizeof(Scan::Point));
  const std::span<Scan::Point> points(scan.points);
  const std::span<char> bytes(reinterpret_cast<char*>(points.data()), points.size_bytes());
  scan.points.resize(read_file(file, bytes) / sizeof(Scan::Point));
}

namespace {

[[noreturn]] void refuse_fields(const std::string& reason) {
  throw DatasetError("--point-fields: " + reason +
                     "; e.g. \"x y z intensity ring\", or \"x y z intensity:u1 ring:u2 t:u4\" "
                     "(types i1 u1 i2 u2 i4 u4 f4 f8, f4 where none is given; _ is skipped)");
}

Scalar parse_type(std::string_view text) {
  constexpr std::array<std::string_view, 8> kTypes = {"i1", "u1", "i2", "u2",
                                                      "i4", "u4", "f4", "f8"};
  const auto found = std::find(kTypes.begin(), kTypes.end(), text);
  if (found == kTypes.end()) refuse_fields(quoted(text) + " is no type");
  return static_cast<Scalar>(found - kTypes.begin());
}

}  // namespace

RecordLayout parse_point_fields(std::string_view text) {
  RecordLayout layout;
  const Columns names = split_columns(text);
  if (names.count > Columns::kMost) refuse_fields("too many fields");
  for (std::size_t i = 0; i < names.count; ++i) {
    const std::string_view entry = names.text[i];
    const std::size_t colon = std::min(entry.find(':'), entry.size());
    const std::string_view name = entry.substr(0, colon);
    const Scalar type = colon == entry.size() ? Scalar::kF32 : parse_type(entry.substr(colon + 1));
    if (name != "_" && !role_of(name)) refuse_fields(quoted(name) + " is no field that is read");
    layout.fields.push_back({std::string(name), type, layout.bytes});
    layout.bytes += scalar_bytes(type);
  }
  const auto fields = fields_by_role(layout);
  if (std::find(fields.begin(), fields.begin() + 3, nullptr) != fields.begin() + 3) {
    refuse_fields("x, y and z are needed");
  }
  return layout;
}

}  // namespace unimapper::datasets
