#include "ports/datasets/pcd.hpp"

#include <lzf.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "ports/datasets/files.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

struct Field {
  std::string_view name;
  std::size_t bytes = 4;   // of one element
  char type = 'F';         // F float, U unsigned, I signed
  std::size_t count = 1;   // elements per point
  std::size_t offset = 0;  // from the start of a point
};

enum class Encoding { kAscii, kBinary, kCompressed };

struct Layout {
  std::vector<Field> fields;
  std::size_t point_bytes = 0;
  Encoding encoding = Encoding::kAscii;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;  // number of the first line after the header
  PcdHeader header;
};

std::vector<std::string_view> words(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\v\f";
  std::vector<std::string_view> result;
  std::size_t begin = line.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    result.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return result;
}

template <typename Number>
bool parse(std::string_view text, Number& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Parses the header line by line; each keyword has its own small member.
class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, const fs::path& file) : bytes_(bytes), file_(file) {}

  Layout parse_header() {
    constexpr std::size_t kMaxHeaderLines = 64;
    std::size_t at = 0;
    for (line_ = 1; line_ <= kMaxHeaderLines; ++line_) {
      const std::size_t end = bytes_.find('\n', at);
      if (end == std::string_view::npos) {
        fail_at_offset(file_, at, "the header ends before its DATA line");
      }
      const auto entry = words(bytes_.substr(at, end - at));
      at = end + 1;
      if (entry.empty() || entry[0].starts_with('#')) continue;
      if (entry[0] == "DATA") {
        parse_encoding(entry);
        layout_.data_offset = at;
        layout_.data_line = line_ + 1;
        finish();
        return std::move(layout_);
      }
      parse_entry(entry);
    }
    fail_at_line(file_, line_, "no DATA line; this is not a PCD file");
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const { fail_at_line(file_, line_, reason); }

  void parse_entry(const std::vector<std::string_view>& entry) {
    const std::string_view key = entry[0];
    if (key == "FIELDS" || key == "COLUMNS") return parse_fields(entry);
    if (key == "SIZE") return parse_sizes(entry);
    if (key == "TYPE") return parse_types(entry);
    if (key == "COUNT") return parse_counts(entry);
    if (key == "WIDTH") return parse_count_of_points(entry, width_);
    if (key == "HEIGHT") return parse_count_of_points(entry, height_);
    if (key == "POINTS") return parse_count_of_points(entry, points_);
    if (key == "VIEWPOINT") return parse_viewpoint(entry);
    if (key != "VERSION") refuse("unknown header entry; this is not a PCD file");
  }

  void parse_fields(const std::vector<std::string_view>& entry) {
    constexpr std::size_t kMaxFields = 64;
    if (entry.size() < 2 || entry.size() - 1 > kMaxFields) refuse("FIELDS names no fields");
    layout_.fields.clear();
    for (std::size_t i = 1; i < entry.size(); ++i) layout_.fields.push_back({.name = entry[i]});
  }

  void require_one_per_field(const std::vector<std::string_view>& entry) const {
    if (layout_.fields.empty()) refuse(std::string(entry[0]) + " comes before FIELDS");
    if (entry.size() != layout_.fields.size() + 1) {
      refuse(std::string(entry[0]) + " has " + std::to_string(entry.size() - 1) + " values for " +
             std::to_string(layout_.fields.size()) + " fields");
    }
  }

  void parse_sizes(const std::vector<std::string_view>& entry) {
    require_one_per_field(entry);
    for (std::size_t i = 0; i < layout_.fields.size(); ++i) {
      std::size_t& bytes = layout_.fields[i].bytes;
      const bool valid =
          parse(entry[i + 1], bytes) && (bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8);
      if (!valid) refuse("SIZE must be 1, 2, 4 or 8");
    }
  }

  void parse_types(const std::vector<std::string_view>& entry) {
    require_one_per_field(entry);
    for (std::size_t i = 0; i < layout_.fields.size(); ++i) {
      if (entry[i + 1] != "F" && entry[i + 1] != "U" && entry[i + 1] != "I") {
        refuse("TYPE must be F, U or I");
      }
      layout_.fields[i].type = entry[i + 1][0];
    }
  }

  void parse_counts(const std::vector<std::string_view>& entry) {
    constexpr std::size_t kMaxCount = 65536;
    require_one_per_field(entry);
    for (std::size_t i = 0; i < layout_.fields.size(); ++i) {
      std::size_t& count = layout_.fields[i].count;
      if (!parse(entry[i + 1], count) || count > kMaxCount) refuse("COUNT is not a small number");
    }
  }

  void parse_count_of_points(const std::vector<std::string_view>& entry,
                             std::optional<std::uint64_t>& count) const {
    std::uint64_t value = 0;
    if (entry.size() != 2 || !parse(entry[1], value)) {
      refuse(std::string(entry[0]) + " is not a number of points");
    }
    count = value;
  }

  void parse_viewpoint(const std::vector<std::string_view>& entry) {
    std::array<double, 7> v{};
    if (entry.size() != v.size() + 1) refuse("VIEWPOINT needs tx ty tz qw qx qy qz");
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!parse(entry[i + 1], v[i])) refuse("VIEWPOINT holds something that is not a number");
    }
    layout_.header.viewpoint = pose_from_quaternion(v[0], v[1], v[2], v[4], v[5], v[6], v[3]);
    has_viewpoint_ = true;
  }

  void parse_encoding(const std::vector<std::string_view>& entry) {
    const std::string_view name = entry.size() == 2 ? entry[1] : std::string_view{};
    if (name == "ascii") {
      layout_.encoding = Encoding::kAscii;
    } else if (name == "binary") {
      layout_.encoding = Encoding::kBinary;
    } else if (name == "binary_compressed") {
      layout_.encoding = Encoding::kCompressed;
    } else {
      refuse("DATA must be ascii, binary or binary_compressed");
    }
  }

  void finish() {
    if (layout_.fields.empty()) refuse("the header has no FIELDS");
    for (Field& field : layout_.fields) {
      if (field.type == 'F' && field.bytes < 4) {
        refuse("field " + std::string(field.name) + " is a float of fewer than 4 bytes");
      }
      field.offset = layout_.point_bytes;
      layout_.point_bytes += field.bytes * field.count;
    }
    if (!points_) points_ = product_of_width_and_height();
    // Every point takes at least a byte on disk, and more than a byte per point in compressed
    // form is checked where the data is read.
    if (*points_ > std::numeric_limits<std::uint32_t>::max()) refuse("POINTS is absurdly large");
    layout_.header.points = static_cast<std::size_t>(*points_);
    if (!has_viewpoint_) layout_.header.viewpoint = Pose{};
    for (const Field& field : layout_.fields) {
      if (field.name != "x") continue;
      const bool is_text = layout_.encoding == Encoding::kAscii;
      layout_.header.coordinate_bytes = is_text ? sizeof(double) : field.bytes;
    }
  }

  std::uint64_t product_of_width_and_height() const {
    if (!width_) refuse("the header has neither POINTS nor WIDTH");
    const std::uint64_t height = height_.value_or(1);
    if (height != 0 && *width_ > std::numeric_limits<std::uint64_t>::max() / height) {
      refuse("WIDTH x HEIGHT is absurdly large");
    }
    return *width_ * height;
  }

  std::string_view bytes_;
  const fs::path& file_;
  std::size_t line_ = 0;
  Layout layout_;
  bool has_viewpoint_ = false;
  std::optional<std::uint64_t> width_;
  std::optional<std::uint64_t> height_;
  std::optional<std::uint64_t> points_;
};

/// The field of each role; null where there is none.
using Wanted = std::array<const Field*, kPointRoles>;

const Field* of_role(const Wanted& wanted, PointRole role) {
  return wanted[static_cast<std::size_t>(role)];
}

Wanted find_wanted(const Layout& layout, const fs::path& file) {
  Wanted wanted{};
  for (const Field& field : layout.fields) {
    const auto role = field.count == 0 ? std::nullopt : role_of(field.name);
    if (!role) continue;
    const Field*& found = wanted[static_cast<std::size_t>(*role)];
    if (found == nullptr) found = &field;
  }
  if (wanted[0] == nullptr || wanted[1] == nullptr || wanted[2] == nullptr) {
    fail(file, "the PCD header has no fields x, y and z");
  }
  return wanted;
}

/// A builder for the roles that are there; `points` are known to be in the file.
ScanBuilder builder_for(const Wanted& wanted, std::size_t points, Scan& scan) {
  return {scan, points, of_role(wanted, PointRole::kRing) != nullptr,
          of_role(wanted, PointRole::kTime) != nullptr};
}

/// Adds a point whose numbers `value` gives by field.
template <typename Value>
void add_point(const Wanted& wanted, const Value& value, ScanBuilder& builder) {
  double values[kPointRoles] = {};
  for (std::size_t role = 0; role < kPointRoles; ++role) {
    if (wanted[role] != nullptr) values[role] = value(*wanted[role]);
  }
  builder.add(values);
}

Scalar scalar_of(const Field& field) {
  if (field.type == 'F') return field.bytes == 4 ? Scalar::kF32 : Scalar::kF64;
  const bool is_signed = field.type == 'I';
  if (field.bytes == 1) return is_signed ? Scalar::kI8 : Scalar::kU8;
  if (field.bytes == 2) return is_signed ? Scalar::kI16 : Scalar::kU16;
  if (field.bytes == 4) return is_signed ? Scalar::kI32 : Scalar::kU32;
  return is_signed ? Scalar::kI64 : Scalar::kU64;
}

/// The first elements of the fields, as records have them.
RecordLayout record_layout(const Layout& layout) {
  RecordLayout records;
  records.bytes = layout.point_bytes;
  for (const Field& field : layout.fields) {
    if (field.count > 0) {
      records.fields.push_back({std::string(field.name), scalar_of(field), field.offset});
    }
  }
  return records;
}

/// More than padding behind the points: they are fewer than were measured.
void refuse_surplus(const fs::path& file, std::size_t left, std::size_t all, std::size_t points) {
  if (left <= all / 10) return;
  fail(file, std::to_string(left) + " of " + std::to_string(all) +
                 " bytes of data lie behind the " + std::to_string(points) +
                 " points announced: are POINTS, WIDTH and HEIGHT right?");
}

void parse_binary(std::string_view bytes, const fs::path& file, const Layout& layout, Scan& scan) {
  (void)find_wanted(layout, file);  // refuses a file without coordinates
  const std::string_view data = bytes.substr(layout.data_offset);
  const std::size_t points = layout.header.points;
  if (data.size() / layout.point_bytes < points) {
    fail_at_offset(file, bytes.size(),
                   "truncated: " + std::to_string(points) + " points of " +
                       std::to_string(layout.point_bytes) + " bytes announced, " +
                       std::to_string(data.size() / layout.point_bytes) + " are there");
  }
  refuse_surplus(file, data.size() - points * layout.point_bytes, data.size(), points);
  decode_records(data.substr(0, points * layout.point_bytes), record_layout(layout), scan);
}

/// Decompresses the payload: all x, then all y, ...
std::vector<char> decompress(std::string_view bytes, const fs::path& file, const Layout& layout) {
  const std::string_view data = bytes.substr(layout.data_offset);
  constexpr std::size_t kSizesBytes = 8;
  if (data.size() < kSizesBytes) {
    fail_at_offset(file, bytes.size(), "truncated: the compressed size is missing");
  }
  std::uint32_t compressed_bytes = 0;
  std::uint32_t raw_bytes = 0;
  std::memcpy(&compressed_bytes, data.data(), sizeof compressed_bytes);
  std::memcpy(&raw_bytes, data.data() + 4, sizeof raw_bytes);
  if (compressed_bytes > data.size() - kSizesBytes) {
    fail_at_offset(file, bytes.size(),
                   "truncated: " + std::to_string(compressed_bytes) +
                       " compressed bytes announced, " + std::to_string(data.size() - kSizesBytes) +
                       " are there");
  }
  if (raw_bytes != std::uint64_t{layout.header.points} * layout.point_bytes) {
    fail_at_offset(file, layout.data_offset + 4,
                   "the uncompressed size does not fit the number of points");
  }
  // LZF turns three bytes into at most 264, so no small file may ask for a huge buffer.
  constexpr std::uint64_t kMaxExpansion = 88;
  if (raw_bytes > compressed_bytes * kMaxExpansion) {
    fail_at_offset(file, layout.data_offset, "the compressed size is too small for the points");
  }
  std::vector<char> raw(raw_bytes);
  if (raw.empty()) return raw;
  const unsigned int written =
      lzf_decompress(data.data() + kSizesBytes, compressed_bytes, raw.data(), raw_bytes);
  if (written != raw_bytes) {
    fail_at_offset(file, layout.data_offset + kSizesBytes, "the compressed data is damaged");
  }
  return raw;
}

void parse_compressed(std::string_view bytes, const fs::path& file, const Layout& layout,
                      Scan& scan) {
  const Wanted wanted = find_wanted(layout, file);
  const std::vector<char> raw = decompress(bytes, file, layout);
  const std::size_t points = layout.header.points;
  ScanBuilder builder = builder_for(wanted, points, scan);
  for (std::size_t i = 0; i < points; ++i) {
    const auto value = [&](const Field& field) {
      const std::size_t at = field.offset * points + i * field.bytes * field.count;
      return load_scalar(raw.data() + at, scalar_of(field));
    };
    add_point(wanted, value, builder);
  }
  builder.finish();
}

/// Column of a field's first element in an ascii line.
std::size_t column_of(const Layout& layout, const Field* wanted) {
  std::size_t column = 0;
  for (const Field& field : layout.fields) {
    if (&field == wanted) break;
    column += field.count;
  }
  return column;
}

void parse_ascii(std::string_view bytes, const fs::path& file, const Layout& layout, Scan& scan) {
  const Wanted wanted = find_wanted(layout, file);
  std::array<std::size_t, kPointRoles> column_of_role{};
  for (std::size_t role = 0; role < kPointRoles; ++role) {
    column_of_role[role] = column_of(layout, wanted[role]);
  }
  std::size_t columns = 0;
  for (const Field& field : layout.fields) columns += field.count;
  ScanBuilder builder = builder_for(wanted, 0, scan);
  std::size_t at = layout.data_offset;
  std::size_t line = layout.data_line;
  for (; at < bytes.size() && scan.points.size() < layout.header.points; ++line) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    const auto entry = words(bytes.substr(at, end - at));
    at = end + 1;
    if (entry.empty()) continue;
    if (entry.size() != columns) {
      fail_at_line(
          file, line,
          "expected " + std::to_string(columns) + " values, found " + std::to_string(entry.size()));
    }
    const auto value = [&](const Field& field) {
      const auto role = static_cast<std::size_t>(std::find(wanted.begin(), wanted.end(), &field) -
                                                 wanted.begin());
      double number = 0.0;
      if (!parse(entry[column_of_role[role]], number)) {
        fail_at_line(file, line, "a value is not a number");
      }
      return number;
    };
    add_point(wanted, value, builder);
  }
  if (scan.points.size() < layout.header.points) {
    fail_at_line(file, line,
                 "truncated: " + std::to_string(layout.header.points) + " points announced, " +
                     std::to_string(scan.points.size()) + " are there");
  }
  const std::size_t end = bytes.find_last_not_of(" \t\r\n") + 1;
  refuse_surplus(file, std::max(end, at) - at, bytes.size() - layout.data_offset,
                 layout.header.points);
  builder.finish();
}

}  // namespace

PcdHeader parse_pcd_header(std::string_view bytes, const fs::path& file) {
  return HeaderParser(bytes, file).parse_header().header;
}

PcdHeader parse_pcd(std::string_view bytes, const fs::path& file, Scan& scan) {
  const Layout layout = HeaderParser(bytes, file).parse_header();
  switch (layout.encoding) {
    case Encoding::kAscii:
      parse_ascii(bytes, file, layout, scan);
      break;
    case Encoding::kBinary:
      parse_binary(bytes, file, layout, scan);
      break;
    case Encoding::kCompressed:
      parse_compressed(bytes, file, layout, scan);
      break;
  }
  return layout.header;
}

}  // namespace unimapper::datasets
