// The onboard pipeline: scans and odometry poses in, keyframes out.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/place.hpp"

namespace unimapper {

/// Counted causes of loss and stage times of one keyframe.
struct KeyframeStatistics;

/// A finished keyframe. Every view points into the pipeline's memory and stays valid until the
/// next call of `add_scan` or `flush`.
struct KeyframeView {
  std::uint32_t sequence = 0;  ///< running number, from 0
  std::uint32_t reference_scan =
      0;                     ///< index into `scans` of the scan whose pose is the keyframe's
  Pose T_odometry_keyframe;  ///< levelled frame at the reference scan's sensor pose
  std::span<const KeyframeScan> scans;
  std::span<const FineCell> static_cells;
  std::span<const FineCell> dynamic_cells;  ///< what was removed, for display and audit
  PlaceView place;
  std::span<const LoopCandidate> loops;  ///< earlier keyframes that look alike, best first
  const KeyframeStatistics* statistics = nullptr;
};

/// What became of a scan.
struct ScanResult {
  Error error;                  ///< `kOk`, or why the scan was refused; the state is unchanged then
  bool keyframe_ready = false;  ///< `keyframe()` holds a new keyframe
};

/// Hard real time after construction: no heap, no locks, no exceptions, no system call; every
/// loop bounded. Not thread safe: one pipeline per thread.
class Pipeline {
 public:
  /// Exactly the bytes `create` takes from the caller's block.
  static std::size_t required_bytes(const PipelineConfig& config) noexcept;

  /// Lays the pipeline out in `memory` (64-byte aligned, at least `required_bytes`), which must
  /// outlive it.
  static Expected<Pipeline*> create(const PipelineConfig& config,
                                    std::span<std::byte> memory) noexcept;

  /// Adds one motion-compensated scan in sensor coordinates with its odometry pose. The
  /// odometry world's z axis points up. Labels of this scan are final for the online decision
  /// when its keyframe is ready.
  ScanResult add_scan(const PointView& points, const Pose& T_odometry_sensor,
                      std::int64_t stamp_ns) noexcept;

  /// Closes a keyframe that has fewer scans than configured (end of a run).
  ScanResult flush() noexcept;

  [[nodiscard]] const KeyframeView& keyframe() const noexcept;

  /// Online decision for every point of scan `scan_in_keyframe` of the finished keyframe, in
  /// input order. Writes at most `out.size()` labels and returns how many.
  std::size_t labels(std::size_t scan_in_keyframe, std::span<PointLabel> out) const noexcept;
};

}  // namespace unimapper
