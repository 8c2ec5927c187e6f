#include "ports/datasets/ply.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>
#include <vector>

#include "ports/datasets/files.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

std::optional<Scalar> scalar_of(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames = {{
      {"char", Scalar::kI8},
      {"int8", Scalar::kI8},
      {"uchar", Scalar::kU8},
      {"uint8", Scalar::kU8},
      {"short", Scalar::kI16},
      {"int16", Scalar::kI16},
      {"ushort", Scalar::kU16},
      {"uint16", Scalar::kU16},
      {"int", Scalar::kI32},
      {"int32", Scalar::kI32},
      {"uint", Scalar::kU32},
      {"uint32", Scalar::kU32},
      {"float", Scalar::kF32},
      {"float32", Scalar::kF32},
      {"double", Scalar::kF64},
      {"float64", Scalar::kF64},
  }};
  for (const auto& [name, scalar] : kNames) {
    if (name == type) return scalar;
  }
  return std::nullopt;
}

/// A property of an element that is passed over.
struct PlyField {
  Scalar type;
  std::optional<Scalar> length;  ///< of the number of values, where it is a list
};

/// An element before the vertices.
struct PlyElement {
  std::uint64_t count = 0;
  std::vector<PlyField> properties;
};

struct PlyHeader {
  std::vector<PlyElement> before;
  RecordLayout layout;
  bool is_ascii = false;
  std::uint64_t vertices = 0;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;  // number of the first line after the header
};

class PlyHeaderParser {
 public:
  PlyHeaderParser(std::string_view bytes, const fs::path& file) : bytes_(bytes), file_(file) {}

  PlyHeader parse() {
    const Columns magic = next_line();
    if (magic.count != 1 || magic.text[0] != "ply") {
      fail_at_line(file_, 1, "is no PLY file (no \"ply\" magic)");
    }
    constexpr std::size_t kMaxHeaderLines = 1000;
    while (line_ < kMaxHeaderLines) {
      const Columns words = next_line();
      if (words.count == 0) continue;
      if (words.text[0] == "end_header") return finish();
      parse_entry(words);
    }
    fail_at_line(file_, line_, "header has no end");
  }

 private:
  Columns next_line() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos) fail_at_line(file_, line_, "header has no end");
    const std::string_view line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
    return split_columns(line);
  }

  void parse_entry(const Columns& words) {
    const std::string_view key = words.text[0];
    if (key == "format") parse_format(words);
    if (key == "element") parse_element(words);
    if (key == "property" && is_vertex_) parse_property(words);
    if (key == "property" && !has_vertex_) parse_passed_over(words);
  }

  void parse_format(const Columns& words) {
    const std::string_view format = words.count > 1 ? words.text[1] : std::string_view{};
    header_.is_ascii = format == "ascii";
    header_.layout.is_swapped = format == "binary_big_endian";
    if (!header_.is_ascii && !header_.layout.is_swapped && format != "binary_little_endian") {
      fail_at_line(file_, line_, "format " + quoted(format) + "; ascii and binary are read");
    }
    has_format_ = true;
  }

  void parse_element(const Columns& words) {
    const bool is_vertex = words.count == 3 && words.text[1] == "vertex";
    if (has_vertex_) {
      if (is_vertex) fail_at_line(file_, line_, "a second element \"vertex\"");
      is_vertex_ = false;
      return;
    }
    if (words.count != 3) fail_at_line(file_, line_, "an element has a name and a number");
    std::uint64_t number = 0;
    const std::string_view count = words.text[2];
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), number);
    if (error != std::errc{} || end != count.data() + count.size()) {
      fail_at_line(file_, line_,
                   quoted(count) + " is no number of " + (is_vertex ? "vertices" : "elements"));
    }
    if (!is_vertex) {
      header_.before.push_back({number, {}});
      return;
    }
    header_.vertices = number;
    has_vertex_ = is_vertex_ = true;
  }

  void parse_passed_over(const Columns& words) {
    if (header_.before.empty()) fail_at_line(file_, line_, "a property of no element");
    const bool is_list = words.count == 5 && words.text[1] == "list";
    const auto length = is_list ? scalar_of(words.text[2]) : std::nullopt;
    const auto type = words.count > 1 ? scalar_of(words.text[is_list ? 3 : 1]) : std::nullopt;
    if (!type || (is_list && !length)) {
      fail_at_line(file_, line_, "a property of an unknown type before the vertices");
    }
    header_.before.back().properties.push_back({*type, length});
  }

  void parse_property(const Columns& words) {
    const std::string_view type = words.count > 1 ? words.text[1] : std::string_view{};
    const auto scalar = scalar_of(type);
    if (!scalar || words.count != 3) {
      fail_at_line(file_, line_,
                   "vertex property of type " + quoted(type) +
                       (type == "list" ? ": export the points without lists, e.g. with CloudCompare"
                                       : std::string()));
    }
    header_.layout.fields.push_back({std::string(words.text[2]), *scalar, header_.layout.bytes});
    header_.layout.bytes += scalar_bytes(*scalar);
  }

  PlyHeader finish() {
    if (!has_vertex_) fail_at_line(file_, line_, "the header names no element \"vertex\"");
    if (!has_format_) fail_at_line(file_, line_, "the header names no format");
    const auto fields = fields_by_role(header_.layout);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (fields[axis] == nullptr) fail(file_, "vertices have no x, y and z");
    }
    header_.data_offset = position_;
    header_.data_line = line_ + 1;
    return std::move(header_);
  }

  std::string_view bytes_;
  const fs::path& file_;
  PlyHeader header_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  bool has_format_ = false;
  bool has_vertex_ = false;
  bool is_vertex_ = false;
};

[[noreturn]] void fail_truncated(const fs::path& file, std::uint64_t offset, std::uint64_t vertices,
                                 std::uint64_t there) {
  fail_at_offset(file, offset,
                 "truncated: the header promises " + std::to_string(vertices) + " vertices, " +
                     std::to_string(there) + " are there");
}

/// Where the vertices begin in binary data: behind the elements before them.
std::size_t offset_of_vertices(std::string_view bytes, const fs::path& file,
                               const PlyHeader& header) {
  std::size_t at = header.data_offset;
  const auto pass = [&](std::uint64_t count, std::size_t value_bytes) {
    if (count > (bytes.size() - at) / value_bytes) {
      fail_at_offset(file, bytes.size(), "truncated within the elements before its vertices");
    }
    at += static_cast<std::size_t>(count) * value_bytes;
  };
  for (const PlyElement& element : header.before) {
    for (std::uint64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
      for (const PlyField& property : element.properties) {
        std::uint64_t values = 1;
        if (property.length) {
          const std::size_t length_at = at;
          pass(1, scalar_bytes(*property.length));
          const double length =
              load_scalar(bytes.data() + length_at, *property.length, header.layout.is_swapped);
          values = length >= 0.0 && length < 1e15 ? static_cast<std::uint64_t>(length)
                                                  : std::uint64_t{UINT64_MAX};
        }
        pass(values, scalar_bytes(property.type));
      }
    }
  }
  return at;
}

void parse_binary_ply(std::string_view bytes, const fs::path& file, const PlyHeader& header,
                      Scan& scan) {
  const std::string_view data = bytes.substr(offset_of_vertices(bytes, file, header));
  const std::size_t available = data.size() / header.layout.bytes;
  if (available < header.vertices) fail_truncated(file, bytes.size(), header.vertices, available);
  decode_records(data.substr(0, static_cast<std::size_t>(header.vertices) * header.layout.bytes),
                 header.layout, scan);
}

void parse_ascii_ply(std::string_view bytes, const fs::path& file, const PlyHeader& header,
                     Scan& scan) {
  const auto& fields = header.layout.fields;
  const auto wanted = fields_by_role(header.layout);
  const auto has = [&](PointRole role) {
    return wanted[static_cast<std::size_t>(role)] != nullptr;
  };
  ScanBuilder builder(scan, 0, has(PointRole::kRing), has(PointRole::kTime));
  std::size_t line = header.data_line;
  std::size_t at = header.data_offset;
  // Every element before has a line of its own.
  std::uint64_t passed_over = 0;
  for (const PlyElement& element : header.before) {
    // Numbers of elements are foreign: their sum may not fit.
    passed_over += std::min<std::uint64_t>(element.count, bytes.size());
  }
  for (; at < bytes.size() && scan.points.size() < header.vertices; ++line) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    const Columns columns = split_columns(bytes.substr(at, end - at));
    at = end + 1;
    if (columns.count == 0) continue;
    if (passed_over > 0) {
      --passed_over;
      continue;
    }
    if (columns.count != fields.size() || columns.count > Columns::kMost) {
      fail_at_line(file, line,
                   "expected " + std::to_string(fields.size()) + " values, found " +
                       std::to_string(columns.count));
    }
    double values[kPointRoles] = {};
    for (std::size_t role = 0; role < kPointRoles; ++role) {
      if (wanted[role] == nullptr) continue;
      const auto column = static_cast<std::size_t>(wanted[role] - fields.data());
      const auto value = to_number(columns.text[column]);
      if (!value) fail_at_line(file, line, quoted(columns.text[column]) + " is not a number");
      values[role] = *value;
    }
    builder.add(values);
  }
  if (scan.points.size() < header.vertices) {
    fail_truncated(file, bytes.size(), header.vertices, scan.points.size());
  }
  builder.finish();
}

}  // namespace

void parse_ply(std::string_view bytes, const fs::path& file, Scan& scan) {
  // An editor's byte-order mark.
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  const PlyHeader header = PlyHeaderParser(bytes, file).parse();
  if (header.is_ascii) {
    parse_ascii_ply(bytes, file, header, scan);
  } else {
    parse_binary_ply(bytes, file, header, scan);
  }
}

}  // namespace unimapper::datasets
