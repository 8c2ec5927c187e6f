// Ring of the latest samples of a gyroscope or an accelerometer.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper::odometry {

/// Samples are numbered from 0 on, in the order of their stamps.
class ImuSamples {
 public:
  struct Sample {
    std::int64_t stamp_ns;
    double value[3];

    [[nodiscard]] Eigen::Vector3d vector() const noexcept { return {value[0], value[1], value[2]}; }
  };

  void allocate(Arena& arena) noexcept { samples_ = arena.allocate<Sample>(kKept); }

  /// Takes a sample of components below `most`, else `refusal` says why not (`kInvalidPose`; NaN,
  /// too). `kTimeReversed`: it is not later than the one before. Refused ones change nothing.
  Error add(std::int64_t stamp_ns, const Eigen::Vector3d& value, double most,
            const char* refusal) noexcept {
    constexpr std::int64_t kLatest_ns = 1LL << 62U;  // so that no difference overflows
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(value[axis]) < most)) return {ErrorCode::kInvalidPose, refusal};
    }
    const bool is_later = count_ == 0 || stamp_ns > (*this)[count_ - 1].stamp_ns;
    if (!is_later || stamp_ns >= kLatest_ns || stamp_ns <= -kLatest_ns) {
      return {ErrorCode::kTimeReversed, "the stamp is not later than that of the sample before"};
    }
    samples_[count_++ % kKept] = {stamp_ns, {value.x(), value.y(), value.z()}};
    return {};
  }

  /// Of all samples taken; the next one's number.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// The oldest one that is kept.
  [[nodiscard]] std::uint64_t first() const noexcept { return count_ - std::min(count_, kKept); }
  [[nodiscard]] const Sample& operator[](std::uint64_t i) const noexcept {
    return samples_[i % kKept];
  }

 private:
  static constexpr std::uint64_t kKept = 1024;  // a second of the fastest IMUs

  Sample* samples_ = nullptr;
  std::uint64_t count_ = 0;
};

}  // namespace unimapper::odometry
