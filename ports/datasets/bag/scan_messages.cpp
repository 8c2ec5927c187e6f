// Decoders of the messages that hold points.
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "ports/datasets/bag/message_reader.hpp"
#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/point_fields.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::datasets::bag {

namespace {

/// The type that sensor_msgs/PointField gives this number; empty if there is none.
constexpr std::optional<Scalar> scalar_of(std::uint8_t number) {
  constexpr std::array<Scalar, 8> kTypes = {Scalar::kI8,  Scalar::kU8,  Scalar::kI16, Scalar::kU16,
                                            Scalar::kI32, Scalar::kU32, Scalar::kF32, Scalar::kF64};
  if (number < 1 || number > kTypes.size()) return std::nullopt;
  return kTypes[number - 1];
}
constexpr std::uint8_t kUint8 = 2;
constexpr std::uint8_t kUint32 = 6;
constexpr std::uint8_t kFloat32 = 7;

struct Field {
  std::string_view name;
  std::uint32_t offset;
  std::uint8_t type;  ///< as sensor_msgs/PointField numbers it
};

/// Rows of points whose fields lie at fixed offsets.
struct Cloud {
  MessageHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::uint64_t point_step = 0;
  std::uint64_t row_step = 0;
  bool is_big_endian = false;
  std::vector<Field> fields;
  std::string_view data;

  [[nodiscard]] const char* point(std::size_t row, std::size_t column) const {
    return data.data() + row * row_step + column * point_step;
  }
};

std::string extent_text(const Cloud& cloud) {
  return std::to_string(cloud.height) + " x " + std::to_string(cloud.width) + " points";
}

/// Throws where points lie outside of the data, so that their number is bounded by it.
void check_extent(Cloud& cloud, std::uint64_t last_point_bytes) {
  if (cloud.height == 0 || cloud.width == 0) {
    if (!cloud.data.empty()) {
      throw DatasetError("it has " + std::to_string(cloud.data.size()) + " bytes of data, but " +
                         extent_text(cloud) + ": its driver leaves height or width at 0");
    }
    cloud.height = cloud.width = 0;
    return;
  }
  if (cloud.point_step == 0) throw DatasetError("its points have no bytes (point_step is 0)");
  const std::uint64_t packed_row = cloud.width * cloud.point_step;
  // Some drivers leave the step between rows out.
  cloud.row_step = std::max(cloud.row_step, packed_row);
  const std::uint64_t last_row =
      (std::uint64_t{cloud.width} - 1) * cloud.point_step + last_point_bytes;
  const std::uint64_t rows_before = std::uint64_t{cloud.height} - 1;
  if (last_row > cloud.data.size() ||
      rows_before > (cloud.data.size() - last_row) / cloud.row_step) {
    throw DatasetError(extent_text(cloud) + " of " + std::to_string(cloud.point_step) +
                       " bytes do not fit its " + std::to_string(cloud.data.size()) +
                       " bytes of data");
  }
}

Cloud read_point_cloud(MessageReader& reader) {
  Cloud cloud;
  cloud.header = read_header(reader);
  cloud.height = reader.number<std::uint32_t>();
  cloud.width = reader.number<std::uint32_t>();
  constexpr std::size_t kLeastFieldBytes = 4 + 4 + 1 + 4;
  cloud.fields.resize(reader.count(kLeastFieldBytes));
  for (Field& field : cloud.fields) {
    field.name = reader.text();
    field.offset = reader.number<std::uint32_t>();
    field.type = reader.number<std::uint8_t>();
    (void)reader.number<std::uint32_t>();  // values of the field; the first one is used
  }
  cloud.is_big_endian = reader.number<std::uint8_t>() != 0;
  cloud.point_step = reader.number<std::uint32_t>();
  cloud.row_step = reader.number<std::uint32_t>();
  cloud.data = reader.take(reader.number<std::uint32_t>());
  const std::uint64_t points = std::uint64_t{cloud.height} * cloud.width;
  if (cloud.point_step == 0 && points > 0 && cloud.data.size() % points == 0) {
    cloud.point_step = cloud.data.size() / points;
  }
  check_extent(cloud, cloud.point_step);
  return cloud;
}

/// Livox's own message: its points are records of fixed fields, which CDR fills up to 20 bytes,
/// but not the last one.
Cloud read_livox(MessageReader& reader) {
  Cloud cloud;
  cloud.header = read_header(reader);
  (void)reader.number<std::uint64_t>();  // time base: the header's stamp once more
  (void)reader.number<std::uint32_t>();  // number of points
  reader.take(4);                        // number of the LiDAR, three reserved bytes
  constexpr std::uint64_t kPointBytes = 19;
  cloud.height = 1;
  cloud.width = reader.count(kPointBytes);
  cloud.point_step = reader.is_ros1() ? kPointBytes : kPointBytes + 1;
  cloud.is_big_endian = reader.is_big_endian();
  cloud.fields = {{"offset_time", 0, kUint32}, {"x", 4, kFloat32},           {"y", 8, kFloat32},
                  {"z", 12, kFloat32},         {"reflectivity", 16, kUint8}, {"line", 18, kUint8}};
  cloud.data = reader.take(reader.left());
  check_extent(cloud, kPointBytes);
  return cloud;
}

Cloud read_cloud(std::string_view bytes, Serialization serialization, MessageKind kind) {
  MessageReader reader(bytes, serialization);
  return kind == MessageKind::kLivox ? read_livox(reader) : read_point_cloud(reader);
}

// --- Values of a field

/// One field of all points.
struct FieldReader {
  std::optional<Scalar> type;  ///< empty: there is no such field
  std::size_t offset = 0;
  bool is_swapped = false;

  explicit operator bool() const { return type.has_value(); }
  double operator()(const char* point) const {
    return load_scalar(point + offset, *type, is_swapped);
  }
};

FieldReader reader_of(const Cloud& cloud, const Field& field) {
  const std::string name = "its field '" + std::string(field.name) + "'";
  const std::optional<Scalar> type = scalar_of(field.type);
  if (!type) throw DatasetError(name + " has the unknown type " + std::to_string(field.type));
  const std::size_t bytes = scalar_bytes(*type);
  if (cloud.point_step < bytes || field.offset > cloud.point_step - bytes) {
    throw DatasetError(name + " lies outside of its point");
  }
  return {type, field.offset, cloud.is_big_endian};
}

/// The fields that are used; others are passed over.
struct UsedFields {
  FieldReader x, y, z, intensity, time, ring;
  std::string description;
};

/// Whether its numbers differ, in a few hundred points.
bool varies(const Cloud& cloud, const FieldReader& field) {
  constexpr std::size_t kMost = 300;
  const std::size_t points = std::size_t{cloud.width} * cloud.height;
  const std::size_t step = points / kMost + 1;
  for (std::size_t i = step; i < points; i += step) {
    if (field(cloud.point(i / cloud.width, i % cloud.width)) != field(cloud.point(0, 0))) {
      return true;
    }
  }
  return false;
}

/// The first of `names` that is a field whose numbers differ, else the first that is a field: some
/// drivers leave one of two unset, also of two with one name. Without any: no field.
FieldReader find_field(const Cloud& cloud, std::initializer_list<std::string_view> names,
                       std::string& description) {
  const Field* found = nullptr;
  bool is_told = false;
  for (const std::string_view name : names) {
    for (const Field& field : cloud.fields) {
      if (is_told || lower_case(field.name) != name) continue;
      is_told = varies(cloud, reader_of(cloud, field));
      if (found == nullptr || is_told) found = &field;
    }
  }
  if (found == nullptr) return {};
  description += (description.empty() ? "" : " ") + std::string(found->name);
  return reader_of(cloud, *found);
}

UsedFields used_fields(const Cloud& cloud) {
  UsedFields used;
  std::string& text = used.description;
  used.x = find_field(cloud, {"x"}, text);
  used.y = find_field(cloud, {"y"}, text);
  used.z = find_field(cloud, {"z"}, text);
  // Some drivers publish a cloud without points as one without fields.
  if (cloud.width == 0) return used;
  if (!used.x || !used.y || !used.z) {
    std::string present;
    for (const Field& field : cloud.fields) present.append(" ").append(field.name);
    if (present.empty()) present = " none";
    throw DatasetError("its points have no x, y and z but" + present);
  }
  used.intensity = find_field(
      cloud, {"intensity", "intensities", "i", "reflectivity", "reflectance", "remission"}, text);
  used.time = find_field(cloud,
                         {"t",
                          "time",
                          "timestamp",
                          "time_stamp",
                          "time_offset",
                          "offset_time",
                          "timeoffset",
                          "time_offset_ns",
                          "point_time_offset",
                          "offset_time_ns",
                          "t_offset",
                          "offset",
                          "point_time",
                          "relative_time",
                          "rel_time",
                          "time_us",
                          "time_ns",
                          "timestamp_ns",
                          "ts",
                          "dt",
                          "stamp"},
                         text);
  std::string with_ring = text;
  used.ring = find_field(
      cloud, {"ring", "line", "channel", "laser_id", "laser", "beam", "row", "line_index"},
      with_ring);
  // All points of one laser: the driver leaves the field unset.
  constexpr std::size_t kMany = 100;
  if (used.ring && std::size_t{cloud.width} * cloud.height > kMany && !varies(cloud, used.ring)) {
    used.ring = {};
  } else {
    text = with_ring;
  }
  return used;
}

/// Drivers write NaN or the origin where no light came back.
bool is_return(const Scan::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z) &&
         (point.x != 0.0F || point.y != 0.0F || point.z != 0.0F);
}

Scan::Point point_at(const UsedFields& fields, const char* at) {
  return {static_cast<float>(fields.x(at)), static_cast<float>(fields.y(at)),
          static_cast<float>(fields.z(at)),
          fields.intensity ? static_cast<float>(fields.intensity(at)) : 0.0F};
}

/// Calls `visit(point, bytes of the point, row)` for every point with a return.
template <typename Visit>
std::size_t for_each_return(const Cloud& cloud, const UsedFields& fields, const Visit& visit) {
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < cloud.height; ++row) {
    for (std::size_t column = 0; column < cloud.width; ++column) {
      const char* at = cloud.point(row, column);
      const Scan::Point point = point_at(fields, at);
      if (is_return(point)) {
        visit(point, at, row);
      } else {
        ++left_out;
      }
    }
  }
  return left_out;
}

// --- What a message says of itself

/// Share of a few hundred returns whose coordinates are those of a measured point.
double plausible_share(const Cloud& cloud) {
  const UsedFields fields = used_fields(cloud);
  const auto is_plausible = [](float value) {
    const float size = std::abs(value);
    return size == 0.0F || (size > 1e-5F && size < 1e6F);
  };
  constexpr std::size_t kMost = 300;
  const std::size_t points = std::size_t{cloud.width} * cloud.height;
  const std::size_t step = points / kMost + 1;
  std::size_t returns = 0;
  std::size_t plausible = 0;
  for (std::size_t i = 0; i < points; i += step) {
    const Scan::Point p = point_at(fields, cloud.point(i / cloud.width, i % cloud.width));
    if (!is_return(p)) continue;
    ++returns;
    plausible += is_plausible(p.x) && is_plausible(p.y) && is_plausible(p.z) ? 1 : 0;
  }
  return returns == 0 ? 1.0 : static_cast<double>(plausible) / static_cast<double>(returns);
}

/// True where coordinates are numbers of a LiDAR only with their bytes in the other order.
bool is_byte_order_wrong(const Cloud& cloud) {
  constexpr double kFew = 0.2;
  constexpr double kMost = 0.95;
  if (plausible_share(cloud) > kFew) return false;
  Cloud other = cloud;
  other.is_big_endian = !cloud.is_big_endian;
  return plausible_share(other) > kMost;
}

/// Share of the data that is of no point.
double unread_share(const Cloud& cloud) {
  if (cloud.data.empty()) return 0.0;
  const auto read = static_cast<double>(cloud.point_step * cloud.width * cloud.height);
  return 1.0 - std::min(1.0, read / static_cast<double>(cloud.data.size()));
}

// --- Time of a point

/// Of every few points: a clock needs no more.
TimeRange sweep_of(const Cloud& cloud, const UsedFields& fields) {
  constexpr std::size_t kMost = 4000;
  const std::size_t points = std::size_t{cloud.width} * cloud.height;
  const std::size_t step = points / kMost + 1;
  std::vector<double> times;
  for (std::size_t k = 0; k < points / step; ++k) {
    // One of every `step` points, of any laser: another one each time.
    const std::size_t i = k * step + k % step;
    const char* at = cloud.point(i / cloud.width, i % cloud.width);
    if (is_return(point_at(fields, at))) times.push_back(fields.time(at));
  }
  return sweep_range(std::move(times));
}

constexpr double kNanosecond_s = 1e-9;

/// What is taken from a point's time, in its unit, to get the time since the scan's stamp.
double time_of_stamp(const Cloud& cloud, const TimeRange& sweep, const PointClock& clock) {
  switch (clock.zero) {
    case PointClock::Zero::kStamp:
      return 0.0;
    case PointClock::Zero::kEpoch:
      return static_cast<double>(cloud.header.stamp_ns) * kNanosecond_s / clock.seconds_per_unit;
    case PointClock::Zero::kOwn:
      break;
  }
  return sweep.least;
}

/// Lower quartile, median and upper quartile of a row's elevations, degrees.
struct Elevations {
  float low, middle, high;
};

std::vector<Elevations> elevations_of_rows(const Cloud& cloud, const UsedFields& fields) {
  std::vector<std::vector<float>> rows(cloud.height);
  // The lasers of one LiDAR do not start from one point, which shows near it.
  constexpr float kNear_m = 3.0F;
  for_each_return(cloud, fields, [&](const Scan::Point& p, const char* /*at*/, std::size_t row) {
    const float level = std::hypot(p.x, p.y);
    if (level > kNear_m) rows[row].push_back(std::atan2(p.z, level) * 57.29578F);
  });
  std::vector<Elevations> found;
  for (std::vector<float>& row : rows) {
    if (row.size() < 8) continue;
    std::sort(row.begin(), row.end());
    found.push_back({row[row.size() / 4], row[row.size() / 2], row[row.size() * 3 / 4]});
  }
  return found;
}

/// True where the elevations of most rows spread less than half the way to the next row's. Rows of
/// the two returns of a pulse, or of a camera's image, are no lasers.
bool are_rows_lasers(const Cloud& cloud, const UsedFields& fields) {
  constexpr std::uint32_t kMostLasers = 256;
  if (cloud.height < 2 || cloud.height > kMostLasers) return false;
  std::vector<Elevations> rows = elevations_of_rows(cloud, fields);
  // Nothing is known of clouds with a few points.
  if (rows.size() < 2) return true;
  std::sort(rows.begin(), rows.end(),
            [](const Elevations& a, const Elevations& b) { return a.middle < b.middle; });
  std::vector<float> spacings;
  std::vector<float> spreads;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    spreads.push_back(rows[i].high - rows[i].low);
    if (i > 0) spacings.push_back(rows[i].middle - rows[i - 1].middle);
  }
  return median(std::span(spreads)) < 0.5F * median(std::span(spacings));
}

std::uint16_t ring_number(double value) {
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  return value >= 0.0 && value <= kMost ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
}

}  // namespace

ScanLayout find_layout(std::string_view bytes, Serialization serialization, MessageKind kind,
                       std::int64_t log_time_ns) {
  Cloud cloud = read_cloud(bytes, serialization, kind);
  if (cloud.header.stamp_ns == 0) cloud.header.stamp_ns = log_time_ns;
  const bool are_bytes_swapped = is_byte_order_wrong(cloud);
  cloud.is_big_endian = cloud.is_big_endian != are_bytes_swapped;
  const UsedFields fields = used_fields(cloud);
  ScanLayout layout;
  layout.are_bytes_swapped = are_bytes_swapped;
  layout.unread_share = unread_share(cloud);
  layout.description = fields.description;
  for (const Field& field : cloud.fields) layout.all_fields.append(" ").append(field.name);
  layout.has_time_field = static_cast<bool>(fields.time);
  if (fields.time) {
    layout.times = sweep_of(cloud, fields);
    layout.clock = find_clock(layout.times, cloud.header.stamp_ns);
  }
  if (!fields.ring && are_rows_lasers(cloud, fields)) layout.laser_rows = cloud.height;
  return layout;
}

std::size_t decode_scan(std::string_view bytes, Serialization serialization, MessageKind kind,
                        const ScanLayout& layout, Scan& scan, std::int64_t log_time_ns) {
  Cloud cloud = read_cloud(bytes, serialization, kind);
  if (cloud.header.stamp_ns == 0) cloud.header.stamp_ns = log_time_ns;
  cloud.is_big_endian = cloud.is_big_endian != layout.are_bytes_swapped;
  const UsedFields fields = used_fields(cloud);
  const bool may_have_time = fields.time && layout.clock.has_value();
  const TimeRange sweep = may_have_time ? sweep_of(cloud, fields) : TimeRange{};
  const auto found = may_have_time ? find_clock_like(*layout.clock, layout.times.span(), sweep,
                                                     cloud.header.stamp_ns)
                                   : std::nullopt;
  const bool has_time = found.has_value();
  const PointClock clock = found.value_or(PointClock{});
  const double zero = has_time ? time_of_stamp(cloud, sweep, clock) : 0.0;
  // Times are a sample's, which lacks the few returns beside a part of the sweep without any.
  const double beside = sweep.is_among_others ? 0.0 : sweep.span();
  const TimeRange wide{sweep.least - beside, sweep.greatest + beside, sweep.unset};
  const bool has_rows = layout.laser_rows > 0 && layout.laser_rows == cloud.height;
  scan.reset(0);
  return for_each_return(cloud, fields,
                         [&](const Scan::Point& point, const char* at, std::size_t row) {
                           scan.points.push_back(point);
                           if (has_time) {
                             const double time = fields.time(at);
                             scan.add_time(time, zero, clock.seconds_per_unit, wide.contains(time));
                           }
                           if (fields.ring) {
                             scan.ring.push_back(ring_number(fields.ring(at)));
                           } else if (has_rows) {
                             scan.ring.push_back(static_cast<std::uint16_t>(row));
                           }
                         });
}

}  // namespace unimapper::datasets::bag
