// Meaning of the columns of a pose file.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "ports/datasets/text.hpp"

namespace unimapper::datasets {

/// What stands in the columns of every line.
struct PoseColumns {
  /// Number of a column that is not there.
  static constexpr std::size_t kNone = SIZE_MAX;
  std::size_t count = 0;                    ///< columns of a line
  std::size_t stamp = kNone;                ///< kNone: no stamps
  std::size_t nanoseconds = kNone;          ///< of `stamp`, which is whole seconds then; or kNone
  std::array<std::size_t, 3> position{};    ///< x y z
  std::array<std::size_t, 4> quaternion{};  ///< x y z w
  std::size_t matrix = kNone;               ///< first value of a matrix by rows, or kNone
  std::size_t matrix_values = 0;            ///< 12 or 16
};

/// The columns of a file without a header, by their number; empty if that is none of the known.
[[nodiscard]] std::optional<PoseColumns> columns_by_count(std::size_t count);

/// The columns as a header names them: position, quaternion, and a stamp where there is one.
/// Understands the names that TUM, EuRoC and ROS tools write. Empty if any of x y z qx qy qz qw is
/// missing or there twice.
[[nodiscard]] std::optional<PoseColumns> columns_by_header(const Columns& names);

/// True where a header names angles instead of a quaternion.
[[nodiscard]] bool names_angles(const Columns& names);

/// What is accepted, for messages.
[[nodiscard]] std::string accepted_pose_columns();

}  // namespace unimapper::datasets
