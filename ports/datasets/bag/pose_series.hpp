// Poses by stamp, interpolated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "ports/datasets/pose_track.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets::bag {

/// Poses of one frame in another, in any order of time until `finish`.
///
/// Memory: 104 bytes for a pose; of poses that repeat, the first and the last are kept.
class PoseSeries {
 public:
  /// Longest time between two poses that is interpolated over.
  static constexpr std::int64_t kMaxGap_ns = 500'000'000;

  /// Adds a pose, in any order of stamps.
  void add(std::int64_t stamp_ns, const Pose& pose);
  /// Sorts by stamp; of poses with one stamp the one added last stays.
  void finish();

  /// No pose was added.
  [[nodiscard]] bool is_empty() const { return stamps_ns_.empty(); }
  /// True if all poses are the same: it holds at any time.
  [[nodiscard]] bool is_constant() const;
  /// First and last stamp; there is at least one pose.
  [[nodiscard]] std::int64_t first_ns() const { return stamps_ns_.front(); }
  /// Stamp of the last pose; of a series that is not empty.
  [[nodiscard]] std::int64_t last_ns() const { return stamps_ns_.back(); }

  /// The stamps in order; of poses that repeat those of the first and the last.
  [[nodiscard]] std::span<const std::int64_t> stamps_ns() const { return stamps_ns_; }

  /// Poses that `finish` left out for another one of their stamp.
  [[nodiscard]] std::size_t repeated() const { return repeated_; }

  /// Whether they alternate between two trajectories; behind `finish`.
  [[nodiscard]] PoseAlternation alternation() const { return find_alternation(stamps_ns_, poses_); }

  /// The pose at a stamp; empty before the first pose, after the last one, and between two that
  /// differ and are more than `kMaxGap_ns` apart.
  [[nodiscard]] std::optional<Pose> at(std::int64_t stamp_ns) const;

 private:
  std::vector<std::int64_t> stamps_ns_;
  std::vector<Pose> poses_;
  std::size_t repeated_ = 0;
};

}  // namespace unimapper::datasets::bag
