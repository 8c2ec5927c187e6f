#include "src/apps/evaluate/ply_cloud.hpp"

#include <array>
#include <charconv>
#include <cstring>
#include <sstream>
#include <string>
#include <string_view>

#include "ports/datasets/files.hpp"

namespace unimapper::apps {
namespace {

using datasets::fail;
using datasets::fail_at_line;

std::size_t type_bytes(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
  if (type == "float" || type == "float32") return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

struct Header {
  std::size_t bytes = 0;  // of the header itself
  std::size_t vertices = 0;
  std::size_t stride = 0;
  std::array<std::size_t, 3> offsets{SIZE_MAX, SIZE_MAX, SIZE_MAX};  // of x, y and z
};

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::filesystem::path& file)
      : text_(text), file_(file) {}

  Header parse() {
    if (next_line() != "ply") fail_at_line(file_, 1, "is no PLY file (no \"ply\" magic)");
    for (;;) {
      std::istringstream words{std::string(next_line())};
      std::string keyword;
      words >> keyword;
      if (keyword == "end_header") break;
      if (keyword == "format") parse_format(words);
      if (keyword == "element") parse_element(words);
      if (keyword == "property" && in_vertex_) parse_property(words);
    }
    for (const std::size_t offset : header_.offsets) {
      if (offset == SIZE_MAX) fail(file_, "vertices have no float x, y and z");
    }
    header_.bytes = position_;
    return header_;
  }

 private:
  std::string_view next_line() {
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string_view::npos) fail_at_line(file_, line_, "header has no end");
    std::string_view line = text_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  void parse_format(std::istringstream& words) {
    std::string format;
    words >> format;
    if (format != "binary_little_endian") {
      fail_at_line(file_, line_, "format " + format + "; only binary_little_endian is read");
    }
  }

  void parse_element(std::istringstream& words) {
    std::string name;
    std::string count;
    words >> name >> count;
    in_vertex_ = name == "vertex";
    if (in_vertex_ == seen_vertex_) {
      if (!seen_vertex_) fail_at_line(file_, line_, "the first element must be \"vertex\"");
      if (in_vertex_) fail_at_line(file_, line_, "a second element \"vertex\"");
    }
    if (!in_vertex_) return;
    seen_vertex_ = true;
    const auto [end, error] =
        std::from_chars(count.data(), count.data() + count.size(), header_.vertices);
    if (error != std::errc{} || end != count.data() + count.size()) {
      fail_at_line(file_, line_, "\"" + count + "\" is no number of vertices");
    }
  }

  void parse_property(std::istringstream& words) {
    std::string type;
    std::string name;
    words >> type >> name;
    const std::size_t bytes = type_bytes(type);
    if (bytes == 0) fail_at_line(file_, line_, "vertex property of type \"" + type + "\"");
    const bool is_float = type == "float" || type == "float32";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (is_float && name.size() == 1 && name[0] == "xyz"[axis]) {
        header_.offsets[axis] = header_.stride;
      }
    }
    header_.stride += bytes;
  }

  std::string_view text_;
  const std::filesystem::path& file_;
  Header header_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  bool in_vertex_ = false;
  bool seen_vertex_ = false;
};

}  // namespace

std::vector<Eigen::Vector3f> read_ply_positions(const std::filesystem::path& file) {
  const std::string bytes = datasets::read_file(file);
  const Header header = HeaderParser(bytes, file).parse();
  const std::size_t available = (bytes.size() - header.bytes) / header.stride;
  if (available < header.vertices) {
    datasets::fail_at_offset(file, bytes.size(),
                             "truncated: the header promises " + std::to_string(header.vertices) +
                                 " vertices, " + std::to_string(available) + " are there");
  }
  std::vector<Eigen::Vector3f> points;
  points.reserve(header.vertices);
  for (std::size_t i = 0; i < header.vertices; ++i) {
    const char* vertex = bytes.data() + header.bytes + i * header.stride;
    Eigen::Vector3f p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::memcpy(&p[static_cast<Eigen::Index>(axis)], vertex + header.offsets[axis],
                  sizeof(float));
    }
    if (p.allFinite()) points.push_back(p);
  }
  return points;
}

}  // namespace unimapper::apps
