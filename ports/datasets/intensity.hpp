// Intensities of scans as bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Intensities as recorded become bytes by one rule: the recording's range is the smallest of 1,
/// 255, 4095 and 65535 that one point in a hundred exceeds at most, in ten scans spread over it.
/// Its end becomes 255, as does what exceeds it, and 0 becomes 1.
class IntensityScale {
 public:
  /// Knows no intensities.
  IntensityScale() = default;
  /// Reads the ten scans. Throws DatasetError.
  explicit IntensityScale(const Dataset& dataset);

  /// The recorded value that becomes 255; 0: the recording has no intensities.
  [[nodiscard]] float range() const { return range_; }
  /// Of each point, from 1; empty without intensities. Valid until the next call. O(points).
  [[nodiscard]] std::span<const std::uint8_t> bytes(const Scan& scan);

 private:
  float range_ = 0.0F;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace unimapper::datasets
