// Known mistakes in poses, undone: what the right poses would be
#include "src/input/pose_mistakes.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

#include "ports/events/event_text.hpp"
#include "src/core/known_mistake.hpp"
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

/// Mistakes that each pose tells by itself, the more frequent ones first.
struct NamedMistake {
  const char* name;
  KnownMistake id;
};
constexpr std::array<NamedMistake, 12> kNamed = {{
    {"inverted", KnownMistake::kInverted},
    {"w first", KnownMistake::kWFirst},
    {"w last", KnownMistake::kWLast},
    {"camera axes", KnownMistake::kCameraAxes},
    {"z down", KnownMistake::kZDown},
    {"left-handed", KnownMistake::kLeftHanded},
    {"mirrored x", KnownMistake::kMirroredX},
    {"mirrored z", KnownMistake::kMirroredZ},
    {"yaw 180", KnownMistake::kYaw180},
    {"yaw 90", KnownMistake::kYaw90},
    {"yaw -90", KnownMistake::kYawMinus90},
    {"transposed", KnownMistake::kTransposed},
}};

std::string remedy_of(KnownMistake id) {
  return std::string(events::remedy_of_mistake(static_cast<std::int64_t>(id)));
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
      const auto named = [&](const NamedMistake& known) { return axes_of(known.id) == axes; };
      if (axes.isIdentity() || std::any_of(kNamed.begin(), kNamed.end(), named)) {
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
  for (const NamedMistake& named : kNamed) {
    add_each(named.name, remedy_of(named.id),
             [id = named.id](const Pose& pose) { return correct(id, pose); });
  }
  for (std::uint8_t id = kFirstScale; id < kKnownMistakes; ++id) {
    const auto unit = static_cast<KnownMistake>(id);
    add(text("scale %g", metres_of(unit)), remedy_of(unit), scaled(track, metres_of(unit)));
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
