#include "ports/datasets/poses.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets {

namespace {

constexpr std::size_t kMaxColumns = 16;

struct Columns {
  std::array<std::string_view, kMaxColumns> text;
  std::size_t count = 0;  // may exceed kMaxColumns; the surplus is not kept
};

bool is_separator(char c) {
  return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r' || c == '\0';
}

Columns split(std::string_view line) {
  Columns columns;
  line = line.substr(0, line.find('#'));
  for (std::size_t i = 0; i < line.size();) {
    if (is_separator(line[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < line.size() && !is_separator(line[end])) ++end;
    if (columns.count < kMaxColumns) columns.text[columns.count] = line.substr(i, end - i);
    ++columns.count;
    i = end;
  }
  return columns;
}

/// Calls `consume(columns, line number)` for every line that is not blank or a comment.
template <typename Consume>
void for_each_line(std::string_view text, const Consume& consume) {
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const Columns columns = split(text.substr(0, end));
    ++number;
    if (columns.count > 0) consume(columns, number);
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  }
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kShown = 32;
  std::string shown = "'";
  for (const char c : text.substr(0, kShown)) shown += c >= ' ' && c <= '~' ? c : '?';
  return shown + (text.size() > kShown ? "...'" : "'");
}

double parse_number(std::string_view text, const std::filesystem::path& file, std::size_t line) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    fail_at_line(file, line, quoted(text) + " is not a number");
  }
  if (!std::isfinite(value)) fail_at_line(file, line, quoted(text) + " is not finite");
  return value;
}

std::int64_t parse_nanoseconds(std::string_view text, const std::filesystem::path& file,
                               std::size_t line) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    fail_at_line(file, line, quoted(text) + " is not a stamp in whole nanoseconds");
  }
  return value;
}

/// Seconds written as digits with an optional fraction: exact to the nanosecond, which a double
/// is not for today's Unix times. Empty if written any other way.
std::optional<std::int64_t> parse_plain_seconds(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  constexpr std::size_t kMaxSecondDigits = 10;  // keeps the result far from overflow
  const std::size_t point = std::min(text.find('.'), text.size());
  std::string_view whole = text.substr(0, point);
  while (whole.size() > 1 && whole.front() == '0') whole.remove_prefix(1);
  if (whole.empty() || whole.size() > kMaxSecondDigits) return std::nullopt;
  std::int64_t value = 0;
  for (const char c : whole) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value * 10 + (c - '0');
  }
  if (value > std::numeric_limits<std::int64_t>::max() / kNanosecondsPerSecond - 1) {
    return std::nullopt;
  }
  value *= kNanosecondsPerSecond;
  std::int64_t unit = kNanosecondsPerSecond / 10;
  for (std::size_t i = point + 1; i < text.size(); ++i, unit /= 10) {
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    value += (text[i] - '0') * unit;
  }
  return negative ? -value : value;
}

std::int64_t parse_seconds(std::string_view text, const std::filesystem::path& file,
                           std::size_t line) {
  if (const auto plain = parse_plain_seconds(text)) return *plain;
  const double seconds = parse_number(text, file, line);
  constexpr double kLimitSeconds = 9.0e9;
  if (std::abs(seconds) > kLimitSeconds) {
    fail_at_line(file, line, quoted(text) + " is out of range for a time in seconds");
  }
  return std::llround(seconds * 1e9);
}

/// The nearest rotation, unless `r` is one already to the last digits.
Eigen::Matrix3d orthonormalised(const Eigen::Matrix3d& r) {
  const double error = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return error < 1e-12 ? r : Eigen::Quaterniond(r).normalized().toRotationMatrix();
}

Pose parse_matrix(std::span<const std::string_view> columns, const std::filesystem::path& file,
                  std::size_t line) {
  Pose pose;
  for (std::size_t i = 0; i < 12; ++i) {
    const double value = parse_number(columns[i], file, line);
    const auto row = static_cast<Eigen::Index>(i / 4);
    const auto column = static_cast<Eigen::Index>(i % 4);
    if (column < 3) {
      pose.rotation(row, column) = value;
    } else {
      pose.translation(row) = value;
    }
  }
  if (!pose.is_rigid()) {
    fail_at_line(file, line, "the first three columns of the 3x4 pose are not a rotation");
  }
  pose.rotation = orthonormalised(pose.rotation);
  return pose;
}

Pose parse_position_quaternion(std::span<const std::string_view> columns,
                               const std::filesystem::path& file, std::size_t line) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = parse_number(columns[i], file, line);
  const auto pose = pose_from_quaternion(v[0], v[1], v[2], v[3], v[4], v[5], v[6]);
  if (!pose) fail_at_line(file, line, "the quaternion qx qy qz qw does not have length 1");
  return *pose;
}

}  // namespace

std::optional<Pose> pose_from_quaternion(double x, double y, double z, double qx, double qy,
                                         double qz, double qw) {
  const Eigen::Quaterniond q(qw, qx, qy, qz);
  constexpr double kLengthTolerance = 1e-2;
  if (!(std::abs(q.norm() - 1.0) < kLengthTolerance)) return std::nullopt;
  const Pose pose(q, Eigen::Vector3d(x, y, z));
  if (!pose.is_rigid()) return std::nullopt;
  return pose;
}

Trajectory parse_trajectory(std::string_view text, const std::filesystem::path& file,
                            StampUnit unit) {
  Trajectory trajectory;
  std::size_t expected_columns = 0;
  for_each_line(text, [&](const Columns& columns, std::size_t line) {
    if (columns.count != 12 && columns.count != 8) {
      fail_at_line(file, line,
                   "expected a pose of 12 (KITTI) or 8 (TUM) columns, found " +
                       std::to_string(columns.count));
    }
    if (expected_columns == 0) expected_columns = columns.count;
    if (columns.count != expected_columns) {
      fail_at_line(file, line,
                   "expected " + std::to_string(expected_columns) + " columns like the lines " +
                       "before, found " + std::to_string(columns.count));
    }
    const std::span<const std::string_view> values(columns.text.data(), columns.count);
    if (columns.count == 12) {
      trajectory.poses.push_back(parse_matrix(values, file, line));
      return;
    }
    trajectory.stamps_ns.push_back(unit == StampUnit::kSeconds
                                       ? parse_seconds(values[0], file, line)
                                       : parse_nanoseconds(values[0], file, line));
    trajectory.poses.push_back(parse_position_quaternion(values.subspan(1), file, line));
  });
  return trajectory;
}

std::vector<std::int64_t> parse_times(std::string_view text, const std::filesystem::path& file) {
  std::vector<std::int64_t> stamps_ns;
  for_each_line(text, [&](const Columns& columns, std::size_t line) {
    if (columns.count != 1) fail_at_line(file, line, "expected one time in seconds per line");
    stamps_ns.push_back(parse_seconds(columns.text[0], file, line));
  });
  return stamps_ns;
}

std::optional<Pose> parse_calibration(std::string_view text, const std::filesystem::path& file) {
  std::optional<Pose> T_camera_lidar;
  for_each_line(text, [&](const Columns& columns, std::size_t line) {
    if (columns.text[0] != "Tr:") return;
    if (columns.count != 13) fail_at_line(file, line, "expected 12 values after 'Tr:'");
    T_camera_lidar = parse_matrix(std::span(columns.text).subspan(1, 12), file, line);
  });
  return T_camera_lidar;
}

}  // namespace unimapper::datasets
