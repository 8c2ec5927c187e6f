// Labelled scans in memory, for tests of what scores them.
#pragma once

#include "src/evaluate/dynamic.hpp"
#include "tests/test.hpp"

namespace unimapper::evaluate::testing {

inline constexpr std::uint32_t kWall = 50;
inline constexpr std::uint32_t kWalker = (7U << 16U) | 254U;
inline constexpr std::uint32_t kKept = 9;
inline constexpr std::uint32_t kRemoved = 251;

struct LabelledScan {
  std::vector<Eigen::Vector3f> points;
  Pose T_world_sensor;
  std::vector<std::uint32_t> truth;
  std::vector<std::uint32_t> predicted;

  void add(const Eigen::Vector3f& point, std::uint32_t is, std::uint32_t called) {
    points.push_back(point);
    truth.push_back(is);
    predicted.push_back(called);
  }
  [[nodiscard]] ScoredScan scored() const { return {points, T_world_sensor, truth, predicted}; }
};

class MemorySource : public ScanSource {
 public:
  std::vector<LabelledScan> scans;
  [[nodiscard]] std::size_t scan_count() const override { return scans.size(); }
  ScoredScan scan(std::size_t i) override { return scans[i].scored(); }
};

/// Static points, those of them kept, dynamic points, those of them removed.
using Counts = std::array<std::uint64_t, 4>;

inline Counts counts(const Tally& tally) {
  return {tally.static_points, tally.static_kept, tally.dynamic_points, tally.dynamic_removed};
}

}  // namespace unimapper::evaluate::testing
