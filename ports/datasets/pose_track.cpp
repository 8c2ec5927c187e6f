#include "ports/datasets/pose_track.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <span>

#include "ports/datasets/files.hpp"
#include "src/core/pose_interpolation.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

/// Stamps printed with few digits may end a little before the last scan.
constexpr std::int64_t kRounding_ns = 1'000'000;

double way_m(const std::vector<Pose>& poses) {
  double way = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    way += (poses[i].translation - poses[i - 1].translation).norm();
  }
  return way;
}

/// Poses by stamp, each once. Sorting mends a file whose order was lost; of two drives in it, or
/// where a clock was set back, it makes a zigzag.
Trajectory in_order(const Trajectory& given, const fs::path& file, TimedPoses& found) {
  if (given.poses.empty()) fail(file, "holds no poses");
  if (given.stamps_ns.empty()) fail_at_line(file, 1, "expected t x y z qx qy qz qw");
  std::vector<std::size_t> order(given.poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return given.stamps_ns[a] < given.stamps_ns[b];
  });
  found.was_sorted = !std::is_sorted(order.begin(), order.end());
  constexpr double kPrinted = 1e-6;  // of a copy
  Trajectory sorted;
  for (const std::size_t i : order) {
    if (!sorted.poses.empty() && sorted.stamps_ns.back() == given.stamps_ns[i]) {
      const double apart_m = (sorted.poses.back().translation - given.poses[i].translation).norm();
      if (apart_m > kPrinted ||
          !sorted.poses.back().rotation.isApprox(given.poses[i].rotation, kPrinted)) {
        char apart[32];
        std::snprintf(apart, sizeof apart, "%.3f", apart_m);
        fail(file, "stamps do not increase after " + std::to_string(given.stamps_ns[i]) +
                       " ns (pose " + std::to_string(i) + "): two poses " + apart +
                       " m apart have this stamp; were stamps printed with too few digits, or are "
                       "there two drives in it?");
      }
      ++found.copies;
      continue;
    }
    sorted.stamps_ns.push_back(given.stamps_ns[i]);
    sorted.poses.push_back(given.poses[i]);
  }
  if (found.was_sorted && way_m(sorted.poses) > way_m(given.poses)) {
    const auto disorder =
        std::adjacent_find(given.stamps_ns.begin(), given.stamps_ns.end(), std::greater<>());
    fail(file, "stamps do not increase after " + std::to_string(*disorder) + " ns (pose " +
                   std::to_string(disorder - given.stamps_ns.begin() + 1) +
                   "), and in order of their stamps poses jump to and fro: are there two drives in "
                   "it, or was a clock set back? Give each part as a recording of its own");
  }
  return sorted;
}

/// Unsigned: the difference of two foreign stamps may not fit.
std::uint64_t difference(std::int64_t later, std::int64_t earlier) {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}

/// Poses of one trajectory by time, and how scans lie to them.
class PoseTrack {
 public:
  explicit PoseTrack(const Trajectory& trajectory) : trajectory_(trajectory) {}

  void find(std::int64_t stamp_ns, TimedPoses& found) const {
    found.poses.push_back(at(stamp_ns, found));
  }

 private:
  [[nodiscard]] std::optional<Pose> at(std::int64_t stamp_ns, TimedPoses& found) const {
    const auto& stamps = trajectory_.stamps_ns;
    const auto after = std::lower_bound(stamps.begin(), stamps.end(), stamp_ns);
    const auto index = static_cast<std::size_t>(after - stamps.begin());
    if (after != stamps.end() && *after == stamp_ns) return trajectory_.poses[index];
    if (index == 0 || after == stamps.end()) {
      const std::size_t end = index == 0 ? 0 : stamps.size() - 1;
      const std::uint64_t away =
          index == 0 ? difference(stamps.front(), stamp_ns) : difference(stamp_ns, stamps.back());
      if (away <= kRounding_ns) return trajectory_.poses[end];
      ++found.outside;
      return std::nullopt;
    }
    return between(index, stamp_ns, found);
  }

  [[nodiscard]] std::optional<Pose> between(std::size_t after, std::int64_t stamp_ns,
                                            TimedPoses& found) const {
    const std::int64_t begin_ns = trajectory_.stamps_ns[after - 1];
    const std::int64_t end_ns = trajectory_.stamps_ns[after];
    const std::uint64_t gap_ns = difference(end_ns, begin_ns);
    if (gap_ns > kMaxPoseGap_ns) {
      ++found.in_gaps;
      return std::nullopt;
    }
    found.farthest_ns =
        std::max(found.farthest_ns, std::min(stamp_ns - begin_ns, end_ns - stamp_ns));
    const double share = static_cast<double>(stamp_ns - begin_ns) / static_cast<double>(gap_ns);
    return interpolate(trajectory_.poses[after - 1], trajectory_.poses[after], share);
  }

  const Trajectory& trajectory_;
};

}  // namespace

PoseAlternation find_alternation(std::span<const std::int64_t> stamps_ns,
                                 std::span<const Pose> poses) {
  constexpr double kJump_m = 1.0;
  constexpr double kFastest_mps = 100.0;
  const auto distance_m = [poses](std::size_t a, std::size_t b) {
    return (poses[b].translation - poses[a].translation).norm();
  };
  PoseAlternation found;
  for (std::size_t from = 0; from + 1 < poses.size(); ++from) {
    ++found.steps;
    const double jump_m = distance_m(from, from + 1);
    const double lasts_s =
        1e-9 * static_cast<double>(difference(stamps_ns[from + 1], stamps_ns[from]));
    if (!(jump_m > kJump_m) || jump_m <= kFastest_mps * lasts_s) continue;
    bool is_back = false;
    for (std::size_t to = from + 2; to < std::min(from + 4, poses.size()); ++to) {
      is_back = is_back || distance_m(from, to) < 0.5 * jump_m;
    }
    found.jumps += is_back ? 1 : 0;
  }
  return found;
}

std::string alternation_text(const PoseAlternation& found) {
  return "alternate between two trajectories: " + std::to_string(found.jumps) + " of " +
         std::to_string(found.steps) + " steps jump and come back";
}

std::string poses_apart_text(std::span<const std::int64_t> stamps_ns) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) {
    intervals_s.push_back(1e-9 * static_cast<double>(difference(stamps_ns[i], stamps_ns[i - 1])));
  }
  if (intervals_s.empty()) return "there is one pose only";
  const double usual_s = median(std::span(intervals_s));
  const double longest_s = *std::max_element(intervals_s.begin(), intervals_s.end());
  char text[160];
  std::snprintf(text, sizeof text,
                "poses are %.1f s apart (median; at most %.1f s), at most %.1f s are bridged",
                usual_s, longest_s, 1e-9 * static_cast<double>(kMaxPoseGap_ns));
  return text;
}

std::string remedy_for_sparse_poses() {
  return "give the odometry at its own rate instead of poses of keyframes, or only the scans that "
         "have a pose of their own";
}

TimedPoses poses_at(const std::vector<std::int64_t>& stamps_ns, const Trajectory& given,
                    const fs::path& file) {
  TimedPoses found;
  const Trajectory trajectory = in_order(given, file, found);
  const PoseAlternation alternation = find_alternation(trajectory.stamps_ns, trajectory.poses);
  if (alternation.is_of_two()) {
    fail(file, "its poses " + alternation_text(alternation) + "; are those of two programs in it?");
  }
  const PoseTrack track(trajectory);
  for (const std::int64_t stamp_ns : stamps_ns) track.find(stamp_ns, found);
  const std::size_t missing = found.outside + found.in_gaps;
  if (2 * missing <= stamps_ns.size()) return found;
  const auto [first, last] = std::minmax_element(stamps_ns.begin(), stamps_ns.end());
  const std::string ranges =
      ": the scans are from " + seconds_text(*first) + " to " + seconds_text(*last) +
      ", the poses from " + seconds_text(trajectory.stamps_ns.front()) + " to " +
      seconds_text(trajectory.stamps_ns.back()) + "; both must be of one clock and in one unit";
  if (found.in_gaps > found.outside) {
    fail(file, poses_apart_text(trajectory.stamps_ns) + ": " + std::to_string(found.in_gaps) +
                   " of " + std::to_string(stamps_ns.size()) +
                   " scans lie between poses farther apart; " + remedy_for_sparse_poses());
  }
  if (missing == stamps_ns.size()) fail(file, "covers none of the scans" + ranges);
  fail(file, "covers only " + std::to_string(stamps_ns.size() - missing) + " of " +
                 std::to_string(stamps_ns.size()) + " scans" + ranges);
}

}  // namespace unimapper::datasets
