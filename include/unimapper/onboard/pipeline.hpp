// Onboard pipeline: scans and odometry poses in, keyframes out
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/statistics.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {

/// The final labels of a keyframe, decided when it was evicted from the window, N keyframes after
/// it closed; `Pipeline::relabel` applies them.
struct RelabelledKeyframe {
  bool available = false;               ///< false: there is none, and the rest is 0
  std::uint32_t sequence = 0;           ///< of the keyframe
  std::uint32_t later_keyframes = 0;    ///< whose evidence was used
  std::uint32_t cells_now_dynamic = 0;  ///< cells that were static online
  std::uint32_t cells_now_static = 0;   ///< cells that were dynamic online
};

/// A keyframe with its online labels. Every view points into the pipeline's memory and stays valid
/// until the next call of `add_scan`, `flush` or `work`. With `PipelineConfig::deferred`, place,
/// loops and `relabelled` are empty, and what counts them is 0, until the keyframe is finished.
struct KeyframeView : KeyframeContent {
  std::span<const LoopCandidate> loops;  ///< earlier keyframes that look alike, best first
  /// The keyframe that this one evicted from the window, if there is one.
  RelabelledKeyframe relabelled;
  const KeyframeStatistics* statistics = nullptr;  ///< counts and times of this keyframe
};

/// What became of a scan. Look at all members: a jump of the pose refuses the scan *and* closes
/// the keyframe that was open.
struct [[nodiscard]] ScanResult {
  /// `kOk`, or why the scan was refused. A refused scan gets no labels, but it takes a scan
  /// index: `KeyframeScan::scan_index` counts every call. Apart from that, and from a jump of the
  /// pose, it leaves the state unchanged.
  Error error;
  /// `keyframe()` holds a new keyframe, `labels` its labels: the one that this call closed, unless
  /// `PipelineConfig::deferred`; then one that was closed in an earlier call, or in this one.
  bool keyframe_ready = false;
  /// `finished_keyframe()` holds a new keyframe: the one that is ready, unless that repeats earlier
  /// ones. With `PipelineConfig::deferred` one that became ready in an earlier call, or in this
  /// one.
  bool keyframe_finished = false;
};

/// What a call of `Pipeline::work` left.
struct [[nodiscard]] WorkResult {
  bool work_left = false;          ///< a scan waits, or a keyframe is not finished yet
  bool keyframe_ready = false;     ///< as in `ScanResult`
  bool keyframe_finished = false;  ///< `finished_keyframe()` holds a new keyframe
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
  ///
  /// Refuses, with the reason: a pose that is not rigid (`kInvalidPose`), a stamp that is not
  /// later than the last accepted one (`kTimeReversed`), a scan without a valid point
  /// (`kEmptyScan`), and a pose farther from the last one than configured (`kPoseJump`). A jump
  /// is refused once: it closes the open keyframe and the pose is remembered. If the next scan
  /// agrees with it, the odometry was restarted: the evidence of earlier keyframes is forgotten
  /// and mapping goes on from there, in a new session if the base is to use it: one that has such a
  /// step is left out of its map. If the next scan agrees with the pose before the jump, the
  /// jump was a glitch and nothing is forgotten. Stamps more than a minute ahead, or back for the
  /// second time in a row and increasing, close the open keyframe, too (`kTimeJump`): a clock that
  /// was set ahead costs one scan, one that was set back two, and nothing is forgotten.
  ///
  /// Cost: O(points), and in the call that closes a keyframe O(cells x images of the window). With
  /// `PipelineConfig::deferred` each call does its share of that in slices, so that all cost about
  /// the same; scans are copied meanwhile and wait. Scans are checked at once either way.
  ScanResult add_scan(const PointView& points, const Pose& T_odometry_sensor,
                      std::int64_t stamp_ns) noexcept;

  /// Tells what the pose of the next scan is uncertain by, since that of the scan before, along
  /// axes that the odometry did not determine (`slip_of` of the own odometry): covariance of the
  /// translation along the odometry frame's axes, m². Keyframes carry it to the base, whose pose
  /// graph then gives way along these axes alone. Several calls add up. False, with nothing
  /// changed, for what is no covariance (`is_slip`); zero is one. O(1).
  [[nodiscard]] bool add_slip(const Eigen::Matrix3d& covariance_m2) noexcept;

  /// Closes a keyframe that has fewer scans than configured (end of a run) and finishes it. With
  /// `PipelineConfig::deferred` keyframes before may have to be closed and finished first, and one
  /// call does so with no more than one: call until none is ready and none finished any more.
  ScanResult flush() noexcept;

  /// With `PipelineConfig::deferred`: does more of the deferred work, for callers who have time
  /// before the next scan. `add_scan` does its share all the same, so this need not be called. One
  /// slice, and as many more as begin within `budget_us` by `PipelineConfig::clock_ns`, but no scan
  /// that waits is added in a call that makes a keyframe ready. A slice is bounded by counted
  /// elements (16,384 blocks of cells, a quarter of a million projections, one scan that waits,
  /// 2,048 cells relabelled, 16,384 described, 8,192 triangles compared), not by the clock. When
  /// and whether it is called changes no result.
  WorkResult work(std::uint32_t budget_us = 0) noexcept;

  /// The last keyframe that is ready; valid until the next call of `add_scan`, `flush`, `work` or
  /// `relabel_next`.
  [[nodiscard]] const KeyframeView& keyframe() const noexcept;

  /// The last keyframe that was finished: with its place, its loops, and the keyframe it evicted.
  /// The same as `keyframe()` unless that repeats earlier ones, or with `PipelineConfig::deferred`.
  /// Meaningful only right after a call that said `keyframe_finished`.
  [[nodiscard]] const KeyframeView& finished_keyframe() const noexcept;

  /// Online label of every point of scan `scan_in_keyframe` of `keyframe()`, in input order. To be
  /// called before the next call of `add_scan`, `flush` or `work`: afterwards there are none.
  /// Writes at most `out.size()` labels and returns how many.
  /// `kUnknown` is given only to points that are not finite or out of range.
  std::size_t labels(std::size_t scan_in_keyframe, std::span<PointLabel> out) const noexcept;

  /// Applies the final labels of the keyframe `finished_keyframe().relabelled` to the labels of one
  /// scan. The caller kept them, and the scan: hand in the same points and pose as to `add_scan`.
  /// Returns how many labels changed. O(points).
  std::size_t relabel(const PointView& points, const Pose& T_odometry_sensor,
                      std::span<PointLabel> labels) const noexcept;

  /// After the last scan and `flush`: relabels the oldest keyframe that is still in the window, so
  /// that `finished_keyframe().relabelled` tells of it; false if there is none left. Call until
  /// then.
  bool relabel_next() noexcept;

  /// The places loop search knows; insert those of earlier runs (sessions from 1) here. The
  /// pipeline's own keyframes are session 0. Finishes the last keyframe that is ready first: ask
  /// anew for each use.
  [[nodiscard]] PlaceDatabase& places() noexcept;

  /// The configuration the pipeline was created with.
  [[nodiscard]] const PipelineConfig& config() const noexcept;

 private:
  struct State;
  Pipeline() = default;
  State* state_ = nullptr;
};

}  // namespace unimapper
