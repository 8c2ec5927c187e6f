// Mount, clock and scale of the given poses against how scans move, while the robot drives
#pragma once

#include <array>
#include <cstdint>

#include "direction_planes.hpp"
#include "motion_pair.hpp"
#include "pair_registration.hpp"
#include "src/core/calibration.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Estimates what is constant between given motions and registered ones (`HandEye`). Registers
/// pairs of scans, one after the other: a few points of one to planes of an earlier one. The last
/// forty motions count. Says what is off in two estimates in a row
/// (docs/design/plausibility.md#while-the-robot-drives).
class CalibrationMonitor {
 public:
  /// What may be off.
  enum Part : std::uint8_t { kRoll, kPitch, kYaw, kX, kY, kZ, kDelay, kScale, kMotion };
  static constexpr std::uint32_t kParts = 9;

  void allocate(Arena& arena, const PipelineConfig& config) noexcept;
  /// The odometry was restarted: the motions that were found remain.
  void forget() noexcept;

  /// A scan as it came, with the pose it came with. O(1): of two scans in a pair a bounded share of
  /// the points.
  void add_scan(const PointView& points, const Pose& T_odometry_sensor,
                std::int64_t stamp_ns) noexcept;
  /// A keyframe closes: a slice of registering the pair that is complete, and of the estimate.
  /// False once nothing is left to do. O(1).
  bool step() noexcept;
  /// Something is left to do.
  [[nodiscard]] bool is_busy() const noexcept { return task_ != Task::kNone || is_ready(); }

  /// What is off by the last estimate: a bit for each `Part`.
  [[nodiscard]] std::uint32_t said() const noexcept { return said_; }
  /// Of roll, pitch, yaw (degrees), x, y, z (m), delay (s) or scale.
  [[nodiscard]] const Estimate& estimate(Part part) const noexcept;
  [[nodiscard]] const Calibration& found() const noexcept { return found_; }
  /// Where `kMotion` is said: length of the given motions over that of the registered ones, median.
  [[nodiscard]] double length_ratio() const noexcept { return length_ratio_; }
  [[nodiscard]] KnownMistake mistake() const noexcept { return mistake_; }
  [[nodiscard]] std::uint32_t pairs() const noexcept { return lively_.size + steady_.size; }

 private:
  static constexpr std::uint32_t kFirstPoints = 6144;
  static constexpr std::uint32_t kSecondPoints = 3072;
  static constexpr std::uint32_t kChosen = 384;  ///< of those
  static constexpr std::uint32_t kPairs = 20;    ///< of a ring

  enum class Task : std::uint8_t { kNone, kTry, kEvaluate };

  /// The last pairs of a kind.
  struct Ring {
    MotionPair* pairs = nullptr;
    std::uint32_t size = 0;
    std::uint32_t next = 0;
    void add(const MotionPair& pair) noexcept;
  };

  [[nodiscard]] bool is_ready() const noexcept;
  void begin_pair(const PointView& points) noexcept;
  void end_pair(const PointView& points) noexcept;
  [[nodiscard]] bool is_far_enough(const Pose& pose) const noexcept;
  template <typename Use>
  void sample(const PointView& points, std::uint32_t most, const Use& use) const noexcept;

  void begin_try() noexcept;
  /// Notes what a start led to. True if another start may lead farther.
  bool end_try() noexcept;
  /// Keeps the pair if it tells something. True if it does.
  bool keep_pair() noexcept;
  bool evaluate() noexcept;
  void say() noexcept;
  void look_for_mistake() noexcept;
  template <typename Use>
  void for_pairs(const Use& use) const noexcept;
  [[nodiscard]] std::uint32_t collect() noexcept;
  [[nodiscard]] Twist noise() noexcept;

  float range_min_m2_ = 0.0F;
  float range_max_m2_ = 0.0F;
  // The pair at hand.
  PoseHistory history_;
  MotionPair pair_;
  std::uint32_t scan_ = 0;         ///< the last one
  std::uint32_t first_ = 0;        ///< of the pair, as `scan_` counts; 0: none yet
  std::uint32_t second_ = 0;       ///< of the pair; 0: none yet
  std::uint32_t most_scans_ = 15;  ///< from the first to the second
  DirectionPlanes planes_;
  Eigen::Vector3f* points_ = nullptr;  ///< of the second scan
  std::uint32_t size_ = 0;
  // Its registration.
  Eigen::Vector3f* chosen_ = nullptr;
  std::uint32_t chosen_size_ = 0;
  Task task_ = Task::kNone;
  PairRegistration registration_;
  std::uint32_t tries_ = 0;
  Pose best_;
  PlaneFit best_fit_;
  float usual_share_ = 0.0F;     ///< of points on planes, of the pairs that were kept
  Twist speed_ = Twist::Zero();  ///< of the last pair, for a second
  // Pairs that turn or change their speed, and others.
  Ring lively_;
  Ring steady_;
  HandEyeMotion* motions_ = nullptr;
  double* magnitudes_ = nullptr;
  std::uint32_t steps_left_ = 0;
  HandEye::Solution solution_;
  double interval_s_ = 0.0;
  Calibration found_;
  double length_ratio_ = 1.0;
  KnownMistake mistake_ = KnownMistake::kNone;
  std::uint32_t said_ = 0;
  std::array<std::uint8_t, kParts> in_a_row_{};
};

}  // namespace unimapper::onboard
