#include "ports/datasets/poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <span>
#include <string>

#include "ports/datasets/files.hpp"
#include "ports/datasets/pose_columns.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::datasets {

namespace {

/// The nearest rotation, unless `r` is one already to the last digits.
Eigen::Matrix3d orthonormalised(const Eigen::Matrix3d& r) {
  const double error = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return error < 1e-12 ? r : Eigen::Quaterniond(r).normalized().toRotationMatrix();
}

Pose to_pose(std::span<const double> rows, const std::filesystem::path& file, std::size_t line) {
  Pose pose;
  for (std::size_t i = 0; i < 12; ++i) {
    const auto row = static_cast<Eigen::Index>(i / 4);
    const auto column = static_cast<Eigen::Index>(i % 4);
    if (column < 3) {
      pose.rotation(row, column) = rows[i];
    } else {
      pose.translation(row) = rows[i];
    }
  }
  if (!pose.is_rigid()) {
    fail_at_line(file, line,
                 "the first three columns of the 3x4 pose are not a rotation; a matrix stands by "
                 "rows, translation in its last column");
  }
  pose.rotation = orthonormalised(pose.rotation);
  return pose;
}

/// Fourth row of a 4x4 matrix.
void check_last_row(std::span<const double> row, const std::filesystem::path& file,
                    std::size_t line) {
  constexpr std::array<double, 4> kExpected = {0.0, 0.0, 0.0, 1.0};
  constexpr double kTolerance = 1e-6;
  for (std::size_t i = 0; i < kExpected.size(); ++i) {
    if (std::abs(row[i] - kExpected[i]) <= kTolerance) continue;
    fail_at_line(file, line,
                 "the last row of the 4x4 pose is not 0 0 0 1; is it written by columns? Rows are "
                 "expected");
  }
}

Pose parse_matrix(std::span<const std::string_view> columns, const std::filesystem::path& file,
                  std::size_t line) {
  std::array<double, 16> values{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    values[i] = parse_number(columns[i], file, line);
  }
  if (columns.size() == values.size()) check_last_row(std::span(values).last(4), file, line);
  return to_pose(values, file, line);
}

Pose parse_position_quaternion(const Columns& columns, const PoseColumns& meaning,
                               const std::filesystem::path& file, std::size_t line) {
  const auto number = [&](std::size_t column) {
    return parse_number(columns.text[column], file, line);
  };
  const auto& p = meaning.position;
  const auto& q = meaning.quaternion;
  const Eigen::Vector4d quaternion(number(q[0]), number(q[1]), number(q[2]), number(q[3]));
  const auto pose = pose_from_quaternion(number(p[0]), number(p[1]), number(p[2]), quaternion[0],
                                         quaternion[1], quaternion[2], quaternion[3]);
  if (!pose) {
    fail_at_line(file, line,
                 "the quaternion qx qy qz qw does not have length 1 but " +
                     std::to_string(quaternion.norm()) + ": are these angles, or other columns? " +
                     accepted_pose_columns());
  }
  return *pose;
}

/// A header without "[m]" and the like.
std::string without_units(std::string_view header) {
  std::string names;
  bool is_unit = false;
  for (const char c : header) {
    if (c == '[' || c == '(') is_unit = true;
    if (!is_unit) names += c;
    if (c == ']' || c == ')') is_unit = false;
  }
  return names;
}

/// Parses a pose file line by line.
class TrajectoryParser {
 public:
  TrajectoryParser(std::string_view text, const std::filesystem::path& file, StampUnit unit)
      : text_(text), file_(file), unit_(unit) {}

  Trajectory parse_all() {
    for_each_line(text_, [&](std::string_view line, std::size_t number) { parse(line, number); });
    if (rows_ % 4 != 0) fail(file_, "the last 4x4 matrix has fewer than four rows");
    if (trajectory_.poses.empty() && trajectory_.not_finite > 0) {
      fail_at_line(file_, first_not_finite_, "the pose is not finite, nor is any other");
    }
    trajectory_.stamps_ns = parse_stamps(stamps_, lines_, file_, unit_);
    return std::move(trajectory_);
  }

 private:
  void parse(std::string_view line, std::size_t number) {
    const std::string_view content = without_comment(line);
    const Columns columns = split_columns(content);
    if (columns.count == 0) {
      // "# timestamp tx ty tz qw qx qy qz" tells the order as well as a header does.
      const bool is_comment = content.size() < line.size() && !is_known_;
      if (is_comment) {
        line.remove_prefix(std::min(line.find_first_not_of("#/% ", content.size()), line.size()));
        comment_ = without_units(line);
      }
      return;
    }
    const bool may_be_header = !is_known_ && rows_ == 0;
    if (may_be_header && !to_number(columns.text[0])) return parse_header(content, number);
    if (!is_known_ && columns.count == 4) return parse_row(columns, number);
    if (!is_known_) choose(columns, number);
    if (meaning_.stamp != PoseColumns::kNone && is_without_pose(columns)) {
      if (trajectory_.not_finite++ == 0) first_not_finite_ = number;
      return;
    }
    if (columns.count != meaning_.count) {
      fail_at_line(file_, number,
                   "expected " + std::to_string(meaning_.count) + " columns like the lines " +
                       "before, found " + std::to_string(columns.count));
    }
    parse_pose(columns, number);
  }

  /// A lost tracker writes NaN, a spreadsheet nothing.
  [[nodiscard]] bool is_without_pose(const Columns& columns) const {
    if (columns.count == 1) return meaning_.count > 1 && meaning_.stamp == 0;
    for (std::size_t i = 0; i < std::min(columns.count, Columns::kMost); ++i) {
      const auto value = to_number(columns.text[i]);
      if (i != meaning_.stamp && value && !std::isfinite(*value)) return true;
    }
    return false;
  }

  void parse_header(std::string_view line, std::size_t number) {
    const std::string header = without_units(line);
    const Columns names = split_columns(header);
    const auto meaning = columns_by_header(names);
    if (!meaning) {
      constexpr std::size_t kLeastNames = 7;
      // Garbage is no header: its first word says more than what would be accepted.
      fail_at_line(file_, number,
                   quoted(split_columns(line).text[0]) + " is not a number" +
                       (names.count >= kLeastNames ? ", nor is this a header that names each of x "
                                                     "y z qx qy qz qw"
                                                   : "") +
                       (names_angles(names) ? ", and a header with angles is not read: convert "
                                              "them to a quaternion; "
                                            : "; ") +
                       accepted_pose_columns());
    }
    meaning_ = *meaning;
    is_known_ = true;
  }

  void choose(const Columns& columns, std::size_t number) {
    const Columns names = split_columns(comment_);
    if (names.count == columns.count) meaning_ = columns_by_header(names).value_or(PoseColumns{});
    if (meaning_.count == 0) {
      const auto meaning = columns_by_count(columns.count);
      if (!meaning) refuse_count(columns.count, number);
      meaning_ = *meaning;
    }
    is_known_ = true;
  }

  [[noreturn]] void refuse_count(std::size_t count, std::size_t number) const {
    constexpr std::size_t kLog = 20;  // FAST-LIO's has 20 or 25, Point-LIO's 25
    if (count >= kLog && lower_case(file_.filename().string()) == "pos_log.txt") {
      fail_at_line(
          file_, number,
          "this is a log of FAST-LIO or Point-LIO, of the IMU and from time 0 on, and does "
          "not tell rotation vectors from angles; write the poses of the LiDAR from "
          "/Odometry as poses_tum.txt (t x y z qx qy qz qw), or hand in a bag with that "
          "topic; --odometry own goes without");
    }
    const bool may_be_angles = count >= 3 && count <= 7;
    fail_at_line(file_, number,
                 "expected a pose of 12 (KITTI) or 8 (TUM) columns, found " +
                     std::to_string(count) +
                     (may_be_angles ? " (a position with angles, or a quaternion without a stamp? "
                                      "angles are not read: convert them to a quaternion); "
                                    : "; ") +
                     accepted_pose_columns());
  }

  /// A 4x4 matrix over four lines.
  void parse_row(const Columns& columns, std::size_t number) {
    const std::size_t row = rows_++ % 4;
    for (std::size_t i = 0; i < 4; ++i) {
      matrix_[4 * row + i] = parse_number(columns.text[i], file_, number);
    }
    if (row < 3) return;
    if (trajectory_.poses.empty() && matrix_[15] != 1.0) {
      fail_at_line(file_, number,
                   "lines of 4 columns are rows of 4x4 matrices, whose fourth row is 0 0 0 1 (a "
                   "position with an angle or a stamp? angles are not read: convert them to a "
                   "quaternion; or a matrix by columns?); " +
                       accepted_pose_columns());
    }
    check_last_row(std::span(matrix_).last(4), file_, number);
    trajectory_.poses.push_back(to_pose(matrix_, file_, number));
  }

  void parse_pose(const Columns& columns, std::size_t number) {
    if (rows_ > 0) {
      fail_at_line(file_, number, "expected a row of a 4x4 matrix like the lines before");
    }
    if (meaning_.stamp != PoseColumns::kNone) {
      stamps_.push_back(stamp_of(columns, number));
      lines_.push_back(number);
    }
    trajectory_.poses.push_back(
        meaning_.matrix == PoseColumns::kNone
            ? parse_position_quaternion(columns, meaning_, file_, number)
            : parse_matrix(std::span(columns.text).subspan(meaning_.matrix, meaning_.matrix_values),
                           file_, number));
  }

  /// Seconds with the nanoseconds of another column behind their point.
  std::string_view stamp_of(const Columns& columns, std::size_t number) {
    const std::string_view seconds = columns.text[meaning_.stamp];
    if (meaning_.nanoseconds == PoseColumns::kNone) return seconds;
    const double ns = parse_number(columns.text[meaning_.nanoseconds], file_, number);
    constexpr double kMost = 999'999'999.0;
    if (!(ns >= 0.0 && ns <= kMost)) {
      fail_at_line(file_, number, "nanoseconds of a stamp are not between 0 and 1e9");
    }
    std::string digits = std::to_string(std::llround(ns));
    digits.insert(0, 9 - digits.size(), '0');
    return joined_.emplace_back(std::string(seconds.substr(0, seconds.find('.'))) + "." + digits);
  }

  std::string_view text_;
  const std::filesystem::path& file_;
  StampUnit unit_;
  PoseColumns meaning_;
  bool is_known_ = false;
  std::string comment_;  // the last one before the poses
  std::size_t rows_ = 0;
  std::array<double, 16> matrix_{};
  std::size_t first_not_finite_ = 0;  // line
  std::vector<std::string_view> stamps_;
  std::deque<std::string> joined_;  // stamps of two columns
  std::vector<std::size_t> lines_;
  Trajectory trajectory_;
};

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
  return TrajectoryParser(text, file, unit).parse_all();
}

std::vector<std::int64_t> parse_times(std::string_view text, const std::filesystem::path& file) {
  std::vector<std::int64_t> dates_ns;
  std::vector<std::string_view> texts;
  std::vector<std::size_t> lines;
  for_each_row(text, [&](const Columns& columns, std::size_t line) {
    if (columns.count == 2) {
      if (const auto date_ns = parse_date(columns.text[0], columns.text[1])) {
        dates_ns.push_back(*date_ns);
        return;
      }
    }
    if (columns.count != 1) fail_at_line(file, line, "expected one time in seconds per line");
    texts.push_back(columns.text[0]);
    lines.push_back(line);
  });
  if (!dates_ns.empty() && !texts.empty()) {
    fail_at_line(file, lines.front(), "dates and other times in one file");
  }
  return dates_ns.empty() ? parse_stamps(texts, lines, file, StampUnit::kAuto) : dates_ns;
}

std::optional<Pose> parse_calibration(std::string_view text, const std::filesystem::path& file) {
  std::optional<Pose> T_camera_lidar;
  for_each_row(text, [&](const Columns& columns, std::size_t line) {
    if (columns.text[0] != "Tr:") return;
    if (columns.count != 13) fail_at_line(file, line, "expected 12 values after 'Tr:'");
    T_camera_lidar = parse_matrix(std::span(columns.text).subspan(1, 12), file, line);
  });
  return T_camera_lidar;
}

}  // namespace unimapper::datasets
