#include "ports/datasets/xyz.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "ports/datasets/files.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kNone = SIZE_MAX;

/// The column of every role; kNone where there is none.
struct PointColumns {
  std::array<std::size_t, kPointRoles> of{kNone, kNone, kNone, kNone, kNone, kNone};
  std::size_t count = 0;  // columns of a line

  [[nodiscard]] bool has(PointRole role) const {
    return of[static_cast<std::size_t>(role)] != kNone;
  }
  [[nodiscard]] bool has_position() const {
    return has(PointRole::kX) && has(PointRole::kY) && has(PointRole::kZ);
  }
};

PointColumns columns_of_header(const Columns& names) {
  PointColumns columns;
  columns.count = names.count;
  for (std::size_t i = 0; i < std::min(names.count, Columns::kMost); ++i) {
    const auto role = role_of(names.text[i]);
    if (!role) continue;
    std::size_t& column = columns.of[static_cast<std::size_t>(*role)];
    if (column == kNone) column = i;
  }
  return columns;
}

PointColumns columns_of_count(std::size_t count) {
  PointColumns columns;
  columns.count = count;
  for (std::size_t axis = 0; axis < 3; ++axis) columns.of[axis] = axis;
  if (count == 4) columns.of[static_cast<std::size_t>(PointRole::kIntensity)] = 3;
  return columns;
}

class XyzParser {
 public:
  XyzParser(const fs::path& file, Scan& scan) : file_(file), scan_(scan) { scan.reset(0); }

  void parse(std::string_view line, std::size_t number) {
    Columns columns = split_columns(line);
    if (columns.count == 0) return;
    const bool is_comment = columns.text[0].starts_with('#') || columns.text[0].starts_with("//");
    if (!is_known_ && (is_comment || !to_number(columns.text[0]))) {
      return parse_header(line, number, is_comment);
    }
    if (is_comment) return;
    // The XYZ of chemists begins with the number of atoms, and so do some of point clouds.
    if (!is_known_ && columns.count == 1 && number == 1) return;
    if (!is_known_) choose(columns.count, number);
    if (columns.count != meaning_.count) {
      fail_at_line(file_, number,
                   "expected " + std::to_string(meaning_.count) + " columns, found " +
                       std::to_string(columns.count));
    }
    add(columns, number);
  }

  void finish() {
    if (is_known_) builder_->finish();
  }

 private:
  void parse_header(std::string_view line, std::size_t number, bool is_comment) {
    std::string names(line);
    std::replace_if(
        names.begin(), names.end(),
        [](char c) { return c == '#' || c == '/' || c == '"' || c == '\''; }, ' ');
    header_ = columns_of_header(split_columns(names));
    if (header_.has_position() || is_comment) return;
    fail_at_line(file_, number,
                 quoted(split_columns(line).text[0]) +
                     " is not a number; expected x y z [intensity] in columns, or a header that "
                     "names x, y and z");
  }

  void choose(std::size_t count, std::size_t number) {
    if (count < 3 || count > Columns::kMost) {
      fail_at_line(file_, number, "expected x y z in columns, found " + std::to_string(count));
    }
    meaning_ = header_.has_position() && header_.count == count ? header_ : columns_of_count(count);
    builder_.emplace(scan_, 0, meaning_.has(PointRole::kRing), meaning_.has(PointRole::kTime));
    is_known_ = true;
  }

  void add(const Columns& columns, std::size_t number) {
    double values[kPointRoles] = {};
    for (std::size_t role = 0; role < kPointRoles; ++role) {
      const std::size_t column = meaning_.of[role];
      if (column == kNone) continue;
      const auto value = to_number(columns.text[column]);
      if (!value) fail_at_line(file_, number, quoted(columns.text[column]) + " is not a number");
      values[role] = *value;
    }
    builder_->add(values);
  }

  const fs::path& file_;
  Scan& scan_;
  PointColumns header_;
  PointColumns meaning_;
  bool is_known_ = false;
  std::optional<ScanBuilder> builder_;
};

}  // namespace

void parse_xyz(std::string_view text, const fs::path& file, Scan& scan) {
  XyzParser parser(file, scan);
  for_each_line(text,
                [&](std::string_view line, std::size_t number) { parser.parse(line, number); });
  parser.finish();
}

}  // namespace unimapper::datasets
