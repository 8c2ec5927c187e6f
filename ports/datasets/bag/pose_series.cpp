#include "ports/datasets/bag/pose_series.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "src/core/pose_interpolation.hpp"

namespace unimapper::datasets::bag {

namespace {

/// Repeated poses are equal but for the digits of their quaternions.
bool is_same_pose(const Pose& a, const Pose& b) {
  constexpr double kTolerance = 1e-9;
  return (a.rotation - b.rotation).cwiseAbs().maxCoeff() <= kTolerance &&
         (a.translation - b.translation).cwiseAbs().maxCoeff() <= kTolerance;
}

}  // namespace

void PoseSeries::add(std::int64_t stamp_ns, const Pose& pose) {
  const std::size_t count = poses_.size();
  if (count >= 2 && stamps_ns_[count - 2] <= stamps_ns_[count - 1] &&
      stamps_ns_[count - 1] <= stamp_ns && is_same_pose(poses_[count - 2], poses_[count - 1]) &&
      is_same_pose(poses_[count - 1], pose)) {
    stamps_ns_.back() = stamp_ns;
    return;
  }
  stamps_ns_.push_back(stamp_ns);
  poses_.push_back(pose);
}

void PoseSeries::finish() {
  std::vector<std::size_t> order(poses_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [this](std::size_t a, std::size_t b) { return stamps_ns_[a] < stamps_ns_[b]; });
  std::vector<std::int64_t> stamps_ns;
  std::vector<Pose> poses;
  for (const std::size_t i : order) {
    if (!stamps_ns.empty() && stamps_ns.back() == stamps_ns_[i]) {
      if (!is_same_pose(poses.back(), poses_[i])) ++repeated_;
      poses.back() = poses_[i];
      continue;
    }
    stamps_ns.push_back(stamps_ns_[i]);
    poses.push_back(poses_[i]);
  }
  stamps_ns_ = std::move(stamps_ns);
  poses_ = std::move(poses);
}

bool PoseSeries::is_constant() const {
  return std::all_of(poses_.begin(), poses_.end(),
                     [this](const Pose& pose) { return is_same_pose(pose, poses_.front()); });
}

std::optional<Pose> PoseSeries::at(std::int64_t stamp_ns) const {
  const auto after = std::lower_bound(stamps_ns_.begin(), stamps_ns_.end(), stamp_ns);
  if (after == stamps_ns_.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(after - stamps_ns_.begin());
  if (*after == stamp_ns) return poses_[index];
  if (index == 0) return std::nullopt;
  const Pose& a = poses_[index - 1];
  const Pose& b = poses_[index];
  // Unsigned: the difference of two foreign stamps may not fit.
  const auto begin = static_cast<std::uint64_t>(stamps_ns_[index - 1]);
  const std::uint64_t gap = static_cast<std::uint64_t>(*after) - begin;
  if (gap > static_cast<std::uint64_t>(kMaxGap_ns) && !is_same_pose(a, b)) return std::nullopt;
  const std::uint64_t since = static_cast<std::uint64_t>(stamp_ns) - begin;
  return interpolate(a, b, static_cast<double>(since) / static_cast<double>(gap));
}

}  // namespace unimapper::datasets::bag
