#include "ports/datasets/pose_columns.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets {

namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// "%time" and "p_RS_R_x" as "time" and "p_rs_r_x".
std::string plain(std::string_view name) {
  std::string lower = lower_case(name);
  std::erase_if(lower, [](char c) { return c == '#' || c == '%' || c == '"' || c == '\''; });
  return lower;
}

/// Of a stamp in two columns: "nsec", "header.stamp.nanosec".
bool is_nanoseconds(std::string_view name) {
  if (name.ends_with('s')) name.remove_suffix(1);
  return name.ends_with("nsec") || name.ends_with("nanosec") || name.ends_with("nanosecond");
}

bool is_seconds(std::string_view name) {
  if (name.ends_with('s')) name.remove_suffix(1);
  return name.ends_with("sec") || name.ends_with("second");
}

bool is_stamp(std::string_view name) {
  return name == "t" || name == "ns" || is_seconds(name) || contains(name, "time") ||
         contains(name, "stamp");
}

/// Name without its last letter and a separator before that: what says which x is meant.
std::string_view without_axis(std::string_view name) {
  name.remove_suffix(1);
  while (!name.empty() && (name.back() == '_' || name.back() == '.')) name.remove_suffix(1);
  return name;
}

bool is_quaternion(std::string_view name) {
  const std::string_view of = without_axis(name);
  return of.starts_with('q') || contains(of, "quat") || contains(of, "orientation") ||
         contains(of, "rot");
}

bool is_position(std::string_view name) {
  const std::string_view of = without_axis(name);
  return of.empty() || of == "t" || of.starts_with('p') || contains(of, "pos") ||
         contains(of, "trans");
}

}  // namespace

std::optional<PoseColumns> columns_by_count(std::size_t count) {
  PoseColumns columns;
  columns.count = count;
  switch (count) {
    case 8:
      columns.stamp = 0;
      columns.position = {1, 2, 3};
      columns.quaternion = {4, 5, 6, 7};
      return columns;
    case 13:
    case 17:
      columns.stamp = 0;
      columns.matrix = 1;
      columns.matrix_values = count - 1;
      return columns;
    case 12:
    case 16:
      columns.matrix = 0;
      columns.matrix_values = count;
      return columns;
    default:
      return std::nullopt;
  }
}

std::optional<PoseColumns> columns_by_header(const Columns& names) {
  if (names.count > Columns::kMost) return std::nullopt;
  PoseColumns columns;
  columns.count = names.count;
  columns.position.fill(PoseColumns::kNone);
  columns.quaternion.fill(PoseColumns::kNone);
  const auto set = [](std::size_t& column, std::size_t index) {
    if (column != PoseColumns::kNone) return false;
    column = index;
    return true;
  };
  bool has_seconds = false;
  for (std::size_t i = 0; i < names.count; ++i) {
    const std::string name = plain(names.text[i]);
    if (name.empty()) continue;
    if (is_nanoseconds(name)) {
      set(columns.nanoseconds, i);
      continue;
    }
    if (is_stamp(name)) {
      if (set(columns.stamp, i)) has_seconds = is_seconds(name);  // of several, the first
      continue;
    }
    constexpr std::string_view kAxes = "xyzw";
    const std::size_t axis = kAxes.find(name.back());
    if (axis == std::string_view::npos) continue;
    if (is_quaternion(name)) {
      if (!set(columns.quaternion[axis], i)) return std::nullopt;
    } else if (axis < 3 && is_position(name)) {
      if (!set(columns.position[axis], i)) return std::nullopt;
    }
  }
  if (columns.stamp == PoseColumns::kNone) std::swap(columns.stamp, columns.nanoseconds);
  if (!has_seconds) columns.nanoseconds = PoseColumns::kNone;
  const auto is_missing = [](std::size_t column) { return column == PoseColumns::kNone; };
  const bool is_whole =
      std::none_of(columns.position.begin(), columns.position.end(), is_missing) &&
      std::none_of(columns.quaternion.begin(), columns.quaternion.end(), is_missing);
  return is_whole ? std::optional(columns) : std::nullopt;
}

bool names_angles(const Columns& names) {
  for (std::size_t i = 0; i < std::min(names.count, Columns::kMost); ++i) {
    const std::string name = plain(names.text[i]);
    if (contains(name, "yaw") || contains(name, "roll") || contains(name, "heading")) return true;
  }
  return false;
}

std::string accepted_pose_columns() {
  return "accepted are TUM (8 columns: t x y z qx qy qz qw), KITTI (12: a 3x4 matrix by rows), a "
         "4x4 matrix by rows (16), a matrix behind a stamp (13 or 17), or a header that names "
         "the columns";
}

}  // namespace unimapper::datasets
