// Known mistakes in poses, undone: what the right poses would be
#include "src/input/pose_mistakes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

using Relative = std::function<Pose(std::size_t, std::size_t, bool&)>;

using Correct = std::function<Pose(const Pose&)>;

/// Relative motion of poses that are each corrected by themselves.
Relative corrected(const Track& track, Correct correct) {
  return [&track, correct = std::move(correct)](std::size_t i, std::size_t j, bool&) {
    return correct(track.pose(i)).inverse() * correct(track.pose(j));
  };
}

/// Relative motion where scan i has the pose of index `at[i]`.
Relative reordered(const Track& track, const std::shared_ptr<const std::vector<std::size_t>>& at) {
  return [&track, at](std::size_t i, std::size_t j, bool&) {
    return track.pose((*at)[i]).inverse() * track.pose((*at)[j]);
  };
}

Relative scaled(const Track& track, double scale) {
  return [&track, scale](std::size_t i, std::size_t j, bool&) {
    Pose relative = track.pose(i).inverse() * track.pose(j);
    relative.translation *= scale;
    return relative;
  };
}

/// Poses are given in axes that are those of the points after `axes` (rotation or reflection).
Correct in_axes(const Eigen::Matrix3d& axes) {
  return [axes](const Pose& pose) {
    return Pose(Eigen::Matrix3d(pose.rotation * axes), pose.translation);
  };
}

/// Quaternion read as (x, y, z, w) from columns in another order.
Pose with_quaternion(const Pose& pose, bool w_was_first) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {w_was_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())
                      : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()),
          pose.translation};
}

Eigen::Matrix3d matrix(std::array<int, 9> rows) {
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = rows[static_cast<std::size_t>(i)];
  return m;
}

/// "x = -y, y = z, z = x": the poses' axes in the points'.
std::string axes_text(const Eigen::Matrix3d& axes) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (axes(row, column) == 0.0) continue;
      text += std::string(text.empty() ? "" : ", ") + "xyz"[row] + " = " +
              (axes(row, column) < 0.0 ? "-" : "") + "xyz"[column];
    }
  }
  return text;
}

struct NamedAxes {
  const char* name;
  Eigen::Matrix3d axes;
  const char* remedy;
};

const std::vector<NamedAxes>& named_axes() {
  static const std::vector<NamedAxes> kNamed = {
      {"camera axes", matrix({0, -1, 0, 0, 0, -1, 1, 0, 0}),
       "the poses look like those of a camera (x right, y down, z forward); transform them to the "
       "LiDAR, or in the KITTI layout add calib.txt with a line Tr:"},
      {"z down", matrix({1, 0, 0, 0, -1, 0, 0, 0, -1}),
       "the poses look like x forward, y right, z down (NED), the points like z up; convert one of "
       "them, or give --extrinsic 0,0,0,180,0,0"},
      {"left-handed", matrix({1, 0, 0, 0, -1, 0, 0, 0, 1}),
       "poses and points differ in handedness, mirrored along y (to the right in one, to the left "
       "in the other); negate y in one of them"},
      {"mirrored x", matrix({-1, 0, 0, 0, 1, 0, 0, 0, 1}),
       "poses and points differ in handedness, mirrored along x (ahead in one, behind in the "
       "other); negate x in one of them"},
      {"mirrored z", matrix({1, 0, 0, 0, 1, 0, 0, 0, -1}),
       "poses and points differ in handedness, mirrored along z (up in one, down in the other); "
       "negate z in one of them"},
      {"yaw 180", matrix({-1, 0, 0, 0, -1, 0, 0, 0, 1}),
       "the poses look like those of a body whose x axis points backwards in the points' frame; "
       "multiply them by the extrinsic T_body_lidar"},
      {"yaw 90", matrix({0, 1, 0, -1, 0, 0, 0, 0, 1}),
       "the poses look like those of a body turned by 90 degrees against the points; multiply them "
       "by the extrinsic T_body_lidar"},
      {"yaw -90", matrix({0, -1, 0, 1, 0, 0, 0, 0, 1}),
       "the poses look like those of a body turned by -90 degrees against the points; multiply "
       "them by the extrinsic T_body_lidar"},
  };
  return kNamed;
}

/// All 48 signed permutations but identity and the named ones.
std::vector<Eigen::Matrix3d> other_axes() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        axes(row, order[static_cast<std::size_t>(row)]) = (signs >> row & 1) != 0 ? -1.0 : 1.0;
      }
      const auto named = [&](const NamedAxes& known) { return known.axes == axes; };
      if (axes.isIdentity() || std::any_of(named_axes().begin(), named_axes().end(), named)) {
        continue;
      }
      all.push_back(axes);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  // Rotations before reflections.
  std::stable_partition(all.begin(), all.end(),
                        [](const Eigen::Matrix3d& m) { return m.determinant() > 0.0; });
  return all;
}

/// at[i]: where scan i stands when all names are sorted in lexicographic order.
std::vector<std::size_t> lexicographic_rank(std::size_t size,
                                            const std::function<std::string(std::size_t)>& name) {
  std::vector<std::string> names(size);
  for (std::size_t i = 0; i < size; ++i) names[i] = name(i);
  std::vector<std::size_t> order(size);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return names[a] < names[b]; });
  std::vector<std::size_t> rank(size);
  for (std::size_t k = 0; k < size; ++k) rank[order[k]] = k;
  return rank;
}

/// at[i]: the scan's true number where scans named `first`, `first` + 1, ... without leading zeros
/// were written in the order of their names.
std::vector<std::size_t> written_in_order_of_names(std::size_t size, std::size_t first) {
  const auto number = [first](std::size_t i) { return std::to_string(first + i); };
  const std::vector<std::size_t> rank = lexicographic_rank(size, number);
  std::vector<std::size_t> inverse(size);
  for (std::size_t i = 0; i < size; ++i) inverse[rank[i]] = i;
  return inverse;
}

Relative accumulated(const Track& track) {
  auto poses = std::make_shared<std::vector<Pose>>();
  for (std::size_t i = 0; i < track.size; ++i) {
    poses->push_back(i == 0 ? track.pose(0) : poses->back() * track.pose(i));
  }
  return
      [poses](std::size_t i, std::size_t j, bool&) { return (*poses)[i].inverse() * (*poses)[j]; };
}

}  // namespace

std::vector<PoseMistake> known_mistakes(const Track& track,
                                        const std::function<std::string(std::size_t)>& name) {
  std::vector<PoseMistake> all;
  const auto add = [&](std::string id, std::string remedy, Relative relative) {
    all.push_back({std::move(id), std::move(remedy), std::move(relative)});
  };
  const auto add_each = [&](std::string id, std::string remedy, const Correct& correct) {
    all.push_back({std::move(id), std::move(remedy), corrected(track, correct), correct});
  };
  add_each("inverted", "the poses look like T_sensor_world; invert them (T_world_sensor is needed)",
           [](const Pose& pose) { return pose.inverse(); });
  add_each("w first",
           "the quaternions look like qw qx qy qz; write them as qx qy qz qw (w last), as TUM does",
           [](const Pose& pose) { return with_quaternion(pose, true); });
  add_each("w last",
           "the quaternions look like qx qy qz qw where w is expected first; write them as qw qx "
           "qy qz",
           [](const Pose& pose) { return with_quaternion(pose, false); });
  for (const NamedAxes& named : named_axes()) {
    add_each(named.name, named.remedy, in_axes(named.axes));
  }
  add_each("transposed",
           "the rotations look transposed (stored by columns); write the 3x4 matrices row by row",
           [](const Pose& pose) {
             return Pose(Eigen::Matrix3d(pose.rotation.transpose()), pose.translation);
           });
  const std::array<std::pair<double, const char*>, 8> scales = {{
      {1e-3, "millimetres"},
      {1e-2, "centimetres"},
      {1e3, "kilometres"},
      {0.3048, "feet"},
      {1e-1, "decimetres"},
      {1e2, "hundreds of metres"},
      {1e1, "tens of metres"},
      {1.0 / 0.3048, "metres, and the points like feet"},
  }};
  for (const auto& [scale, unit] : scales) {
    add(text("scale %g", scale),
        text("the poses' positions look like %s; multiply them by %g", unit, scale),
        scaled(track, scale));
  }
  add("increments",
      "the poses look like motions from scan to scan; accumulate them into poses in one frame",
      accumulated(track));
  std::vector<std::size_t> backwards(track.size);
  for (std::size_t i = 0; i < track.size; ++i) backwards[i] = track.size - 1 - i;
  add("reversed", "the poses look reversed in time; give scans and poses the same order",
      reordered(track, std::make_shared<const std::vector<std::size_t>>(std::move(backwards))));
  add("sorted as text",
      "scans and poses differ in order as 1, 10, 2 from 1, 2, 10; name the scans with leading "
      "zeros in the order of the poses",
      reordered(track, std::make_shared<const std::vector<std::size_t>>(
                           lexicographic_rank(track.size, name))));
  for (const std::size_t first : {0U, 1U}) {
    add("written in order of names",
        "scans and poses differ in order as 1, 10, 2 from 1, 2, 10; give scans and poses the same "
        "order",
        reordered(track, std::make_shared<const std::vector<std::size_t>>(
                             written_in_order_of_names(track.size, first))));
  }
  for (const Eigen::Matrix3d& axes : other_axes()) {
    add_each(
        "axes " + axes_text(axes),
        "the poses' axes look like " + axes_text(axes) + " of the points'; " +
            (axes.determinant() > 0.0 ? "multiply them by the extrinsic T_body_lidar"
                                      : "they differ in handedness: negate an axis of the points"),
        in_axes(axes));
    all.back().is_named = false;
  }
  return all;
}

}  // namespace unimapper::input
