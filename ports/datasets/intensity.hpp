// Intensities of scans as bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Intensities as recorded become bytes by one rule: the recording's range is the smallest of 1,
/// 255, 4095 and 65535 that one point in a hundred exceeds at most, by the first scan with
/// intensities. Its end becomes 255, as does what exceeds it, and 0 becomes 1.
class IntensityScale {
 public:
  /// Of each point, from 1; empty without intensities. Valid until the next call. O(points).
  [[nodiscard]] std::span<const std::uint8_t> bytes(const Scan& scan);

 private:
  float range_ = 0.0F;  ///< 0: no scan had intensities
  std::vector<std::uint8_t> bytes_;
};

}  // namespace unimapper::datasets
