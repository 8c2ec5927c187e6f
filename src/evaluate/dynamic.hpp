// Static and dynamic accuracy of labelled points (paper section VII-B).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::evaluate {

/// Ground truth of a point. SemanticKITTI ids 251..259 are dynamic; 0 (unlabelled) and 1 (outlier)
/// are ignored; everything else is static.
enum class Truth : std::uint8_t { kIgnored, kStatic, kDynamic };

/// Truth of a label; only its lower 16 bits count, the upper ones hold the instance.
[[nodiscard]] Truth truth_of(std::uint32_t label) noexcept;

/// True if the run labelled a point dynamic. Unknown (0) counts as kept.
[[nodiscard]] bool is_removed(std::uint32_t label) noexcept;

/// Classes that get a figure of their own, with the moving and the standing form of each.
inline constexpr std::size_t kClassCount = 24;

/// Index of the class of a label in [0, kClassCount).
[[nodiscard]] std::size_t class_of(std::uint32_t label) noexcept;

/// English name of a class, e.g. "pedestrian", "cyclist", "car" or "pole".
[[nodiscard]] std::string_view class_name(std::size_t index) noexcept;

/// Counts of one set of points.
struct Tally {
  std::uint64_t static_points = 0;    ///< static by ground truth
  std::uint64_t static_kept = 0;      ///< static points that were labelled static
  std::uint64_t dynamic_points = 0;   ///< dynamic by ground truth
  std::uint64_t dynamic_removed = 0;  ///< dynamic points that were labelled dynamic

  /// Counts one point.
  void add(Truth truth, bool removed) noexcept;
  Tally& operator+=(const Tally& other) noexcept;

  /// Static points that were removed.
  [[nodiscard]] std::uint64_t lost() const noexcept { return static_points - static_kept; }
  /// Dynamic points that were kept.
  [[nodiscard]] std::uint64_t missed() const noexcept { return dynamic_points - dynamic_removed; }
  /// Points with the wrong label.
  [[nodiscard]] std::uint64_t wrong() const noexcept { return lost() + missed(); }

  /// Accuracies in [0, 1]; NaN where there is no point of that kind.
  [[nodiscard]] double static_accuracy() const noexcept;      ///< SA
  [[nodiscard]] double dynamic_accuracy() const noexcept;     ///< DA
  [[nodiscard]] double associated_accuracy() const noexcept;  ///< AA = sqrt(SA DA)
  [[nodiscard]] double harmonic_accuracy() const noexcept;    ///< HA = 2 SA DA / (SA + DA)
};

/// Upper ends of the range bins in metres; the last bin is open.
inline constexpr std::array<float, 5> kRangeBinEnds = {10.0F, 20.0F, 30.0F, 50.0F, 80.0F};
inline constexpr std::size_t kRangeBinCount = kRangeBinEnds.size() + 1;

/// Index of the bin a range falls into; a range equal to an end belongs to the next bin.
[[nodiscard]] std::size_t range_bin(float range_m) noexcept;

/// "10-20" in metres, or "80+" for the open last bin.
[[nodiscard]] std::string range_bin_name(std::size_t bin);

/// One accuracy under one protocol, broken down.
struct DynamicScore {
  Tally total;                                   ///< all labelled points
  std::array<Tally, kClassCount> by_class{};     ///< labelled points by `class_of`
  std::array<Tally, kRangeBinCount> by_range{};  ///< labelled points by `range_bin`
  std::uint64_t ignored = 0;                     ///< points without a label

  /// Counts a labelled point, or counts it as ignored.
  void add(std::uint32_t truth_label, float range_m, bool removed) noexcept;
};

/// One scan, ready to be scored. All spans have the same length.
struct ScoredScan {
  std::span<const Eigen::Vector3f> points;   ///< sensor frame, metres
  Pose T_world_sensor;                       ///< sensor frame to world frame, metres
  std::span<const std::uint32_t> truth;      ///< SemanticKITTI labels
  std::span<const std::uint32_t> predicted;  ///< the run's labels
};

/// Source of scans. Scans are requested in ascending order, possibly several times.
class ScanSource {
 public:
  virtual ~ScanSource() = default;
  /// Number of scans.
  [[nodiscard]] virtual std::size_t scan_count() const = 0;
  /// Scan `i`; the spans stay valid until the next call.
  virtual ScoredScan scan(std::size_t i) = 0;
};

/// Per point, every range: the run's label against the truth. O(points).
[[nodiscard]] DynamicScore score_points(ScanSource& source);

/// One scan of these; points without a position cannot be in any map and count as ignored.
void score_scan(const ScoredScan& scan, DynamicScore& score);

/// Dynamic points by their object's motion while it was seen.
struct MotionScore {
  Tally moving;                                      ///< objects that moved while they were seen
  Tally standing;                                    ///< objects that did not
  std::array<Tally, kClassCount> moving_by_class{};  ///< `moving` by `class_of`
};

/// Separates objects that moved while they were seen from those that moved at some other time
/// (a queue, a bus at a stop): both are labelled dynamic, but no observation until then reveals
/// the latter. An object (by its instance number) stands during `stretch` scans if a third of the
/// 0.4 m cells it occupies are common to the first and the last of them, as a share of the smaller
/// set; points without instance count as moving. O(points).
[[nodiscard]] MotionScore score_by_motion(ScanSource& source, std::size_t stretch = 10);

/// Scans during which an object moves, first and last included.
struct MotionInterval {
  std::uint32_t object = 0;    ///< instance number
  std::size_t first_scan = 0;  ///< of the motion
  std::size_t last_scan = 0;   ///< of the motion
};

/// Points by what had begun to move when they were seen.
struct SinceMotionScore {
  /// Dynamic: points of objects from when they first begin to move, pauses included, whatever
  /// their label. Static: points with a static label of everything else.
  DynamicScore since;
  Tally moving;  ///< of the dynamic ones, those whose object moves in that very scan
  Tally paused;  ///< of the dynamic ones, the others
  Tally before;  ///< points with a dynamic label of objects that have not begun to move
};

/// Counts objects as dynamic from when they begin to move: in the first scan of `motions` in which
/// an object moves and before which, or in which, it was seen. What it did before it was first
/// seen does not count. Points with a dynamic label but without instance count as moving.
/// O(points log objects).
[[nodiscard]] SinceMotionScore score_since_motion(ScanSource& source,
                                                  std::span<const MotionInterval> motions);

/// Parameters of the protocol of DynamicMap_Benchmark.
struct BenchmarkConfig {
  float neighbour_m = 0.05F;  ///< a point this near to a kept point counts as kept
  float max_range_m = 50.0F;  ///< points at or beyond it are ignored
  float ego_range_m = 3.0F;   ///< unlabelled points nearer than this are the robot itself
  std::size_t batch_points = 8'000'000;  ///< removed points held in memory at a time
};

/// The score, and the tally under upstream's treatment of unlabelled points.
struct BenchmarkScore {
  DynamicScore score;  ///< unlabelled points ignored
  /// Unlabelled points counted as upstream does: dynamic within `ego_range_m`, static beyond.
  Tally with_unlabelled;
};

/// The protocol of DynamicMap_Benchmark: the static map is made of the points the run kept, in
/// the world frame; a ground-truth point counts as removed when no kept point lies within
/// `neighbour_m`. A kept point is its own neighbour, so only removed points are searched for:
/// memory is bounded by `batch_points` (about 30 bytes each), every further batch costs one
/// more pass over the scans.
[[nodiscard]] BenchmarkScore score_benchmark(ScanSource& source, const BenchmarkConfig& config);

}  // namespace unimapper::evaluate
