#include "calibration_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "src/core/quantile.hpp"
#include "src/core/rotation_vector.hpp"

namespace unimapper::onboard {
namespace {

constexpr double kStands_m = 0.3;  // corrections and motions
constexpr double kStands_rad = 2.0 / kDegreesPerRadian;
constexpr std::uint32_t kMostScans = 15;  ///< of a pair
constexpr std::uint32_t kFewScans = 2;    ///< of a pair where nothing is known of how scans move
constexpr std::uint32_t kStarts = 3;      // of a registration: as given, as before, unmoved

Twist twist_of(const Pose& motion) noexcept {
  Twist twist;
  twist << rotation_vector(motion.rotation), motion.translation;
  return twist;
}

Pose pose_of(const Twist& twist) noexcept {
  return {rotation_of(twist.head<3>()), twist.tail<3>()};
}

bool is_small(const Pose& motion) noexcept {
  const Twist twist = twist_of(motion);
  return twist.head<3>().norm() < kStands_rad && twist.tail<3>().norm() < kStands_m;
}

}  // namespace

void CalibrationMonitor::Ring::add(const MotionPair& pair) noexcept {
  pairs[next] = pair;
  next = (next + 1) % kPairs;
  size = std::min(size + 1, kPairs);
}

void CalibrationMonitor::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  constexpr float kFarthest_m = 80.0F;
  const float farthest_m = std::min(config.keyframe.range_max_m, kFarthest_m);
  range_min_m2_ = std::max(config.keyframe.range_min_m * config.keyframe.range_min_m, 0.01F);
  range_max_m2_ = farthest_m * farthest_m;
  planes_.allocate(arena);
  points_ = arena.allocate<Eigen::Vector3f>(kSecondPoints);
  chosen_ = arena.allocate<Eigen::Vector3f>(kChosen);
  lively_.pairs = arena.allocate<MotionPair>(kPairs);
  steady_.pairs = arena.allocate<MotionPair>(kPairs);
  motions_ = arena.allocate<HandEyeMotion>(2 * std::size_t{kPairs});
  magnitudes_ = arena.allocate<double>(4 * std::size_t{kPairs});
}

void CalibrationMonitor::forget() noexcept {
  history_.forget();
  first_ = 0;
  second_ = 0;
  task_ = Task::kNone;
}

// ---------------------------------------------------------------------------------------------
// Scans to pairs

template <typename Use>
void CalibrationMonitor::sample(const PointView& points, std::uint32_t most,
                                const Use& use) const noexcept {
  // One point of each part of the scan, anywhere in it: a constant step would meet few rings.
  const std::size_t parts = std::min<std::size_t>(points.count, most);
  std::uint32_t dice = 1;
  for (std::size_t k = 0; k < parts; ++k) {
    const std::size_t begin = points.count * k / parts;
    const std::size_t end = points.count * (k + 1) / parts;
    dice = dice * 1664525U + 1013904223U;
    const Eigen::Vector3f point = points[begin + (dice >> 8U) % (end - begin)];
    const float squared = point.squaredNorm();
    // False for NaN.
    if (squared >= range_min_m2_ && squared <= range_max_m2_) use(point);
  }
}

void CalibrationMonitor::begin_pair(const PointView& points) noexcept {
  first_ = scan_;
  second_ = 0;
  pair_.begin(0, history_);
  planes_.clear();
  sample(points, kFirstPoints,
         [this](const Eigen::Vector3f& point) noexcept { planes_.add(point); });
}

void CalibrationMonitor::end_pair(const PointView& points) noexcept {
  second_ = scan_;
  pair_.begin(1, history_);
  size_ = 0;
  sample(points, kSecondPoints,
         [this](const Eigen::Vector3f& point) noexcept { points_[size_++] = point; });
}

bool CalibrationMonitor::is_far_enough(const Pose& pose) const noexcept {
  constexpr std::uint32_t kFewestScans = 4;
  constexpr double kFar_m = 4.0;
  constexpr double kTurned_rad = 20.0 / kDegreesPerRadian;
  const std::uint32_t scans = scan_ - first_;
  if (scans >= most_scans_) return true;
  if (scans < kFewestScans) return false;
  const Pose moved = pair_.moved_to(pose);
  return moved.translation.norm() >= kFar_m ||
         rotation_vector(moved.rotation).norm() >= kTurned_rad;
}

bool CalibrationMonitor::is_ready() const noexcept {
  return second_ != 0 && scan_ - second_ >= MotionPair::kAbout;
}

void CalibrationMonitor::add_scan(const PointView& points, const Pose& T_odometry_sensor,
                                  std::int64_t stamp_ns) noexcept {
  ++scan_;
  history_.add(T_odometry_sensor, stamp_ns);
  if (first_ != 0) pair_.add(0, scan_ - first_, T_odometry_sensor, stamp_ns);
  if (second_ != 0) {
    pair_.add(1, scan_ - second_, T_odometry_sensor, stamp_ns);
  } else if (first_ == 0) {
    if (history_.before(MotionPair::kAbout) != nullptr) begin_pair(points);
  } else if (is_far_enough(T_odometry_sensor)) {
    end_pair(points);
  }
}

// ---------------------------------------------------------------------------------------------
// Pairs to motions

bool CalibrationMonitor::step() noexcept {
  constexpr int kStepsOfSlice = 3;
  switch (task_) {
    case Task::kNone:
      if (!is_ready()) return false;
      if (!pair_.close()) {
        first_ = 0;
        second_ = 0;
        return false;
      }
      planes_.fit();
      tries_ = 0;
      best_fit_ = {};
      begin_try();
      task_ = Task::kTry;
      return true;
    case Task::kTry: {
      const std::span<const Eigen::Vector3f> points(chosen_, chosen_size_);
      for (int k = 0; k < kStepsOfSlice; ++k) {
        if (registration_.step(planes_, points)) continue;
        if (end_try()) {
          begin_try();
          return true;
        }
        const bool tells = keep_pair();
        first_ = 0;
        second_ = 0;
        task_ = tells && pairs() >= kFewestMotions ? Task::kEvaluate : Task::kNone;
        steps_left_ = found_.motions == 0 ? 5 : 2;
        return task_ != Task::kNone;
      }
      return true;
    }
    default:
      break;
  }
  if (evaluate()) return true;
  task_ = Task::kNone;
  say();
  return false;
}

void CalibrationMonitor::begin_try() noexcept {
  switch (tries_++) {
    case 0:
      registration_.begin(pair_.given());
      break;
    case 1:
      registration_.begin(pose_of(pair_.seconds() * speed_));
      break;
    default:
      registration_.begin(Pose());
      break;
  }
  chosen_size_ = choose_points(planes_, {points_, size_}, registration_.pose(), {chosen_, kChosen});
}

bool CalibrationMonitor::end_try() noexcept {
  constexpr float kFewestPoints = 60;
  constexpr float kAgreesWell = 0.9F;
  if (registration_.is_valid()) {
    const PlaneFit fit = fit_of(planes_, {points_, size_}, registration_.pose());
    if (static_cast<float>(fit.points) >= kFewestPoints && fit.share > best_fit_.share) {
      best_fit_ = fit;
      best_ = registration_.pose();
    }
  }
  if (tries_ >= kStarts) return false;
  // Another start shows whether the given motion is but one that looks alike.
  if (pairs() < kFewestMotions) return true;
  return !(best_fit_.share >= kAgreesWell * usual_share_ && best_fit_.share > 0.0F &&
           is_small(pair_.given().inverse() * best_));
}

bool CalibrationMonitor::keep_pair() noexcept {
  constexpr float kLeast = 2.0F;
  // Of the points; noise of normals alone says as much as 0.004 of them in a bare tunnel.
  constexpr float kLeastOfPoints = 0.005F;
  constexpr float kLeastShare = 0.4F;
  constexpr float kUnmoved = 0.05F;
  constexpr float kAgreesWell = 0.85F;
  constexpr float kFading = 0.95F;
  constexpr double kLively_rad = 5.0 / kDegreesPerRadian;
  most_scans_ = kFewScans;
  if (best_fit_.points == 0) return false;
  const float share = best_fit_.share;
  const bool agrees = share >= kLeastShare && share >= kAgreesWell * usual_share_;
  usual_share_ = std::max(share, kFading * usual_share_ + (1.0F - kFading) * share);
  // Poses that no scan confirms say nothing of how far apart scans are.
  const bool is_confirmed = is_small(pair_.given().inverse() * best_);
  most_scans_ = agrees ? (is_confirmed ? kMostScans : 2 * kFewScans) : kFewScans;
  const float least = std::max(kLeast, kLeastOfPoints * static_cast<float>(best_fit_.points));
  if (!agrees || best_fit_.least < least) return false;
  const Twist moved = twist_of(best_);
  speed_ = moved / pair_.seconds();
  const bool stands = is_small(best_);
  if (stands && is_small(pair_.given())) return false;
  if (!stands && share < fit_of(planes_, {points_, size_}, Pose()).share + kUnmoved) return false;
  pair_.registered = best_;
  (moved.head<3>().norm() >= kLively_rad ? lively_ : steady_).add(pair_);
  return true;
}

// ---------------------------------------------------------------------------------------------
// Motions to estimates

template <typename Use>
void CalibrationMonitor::for_pairs(const Use& use) const noexcept {
  for (const Ring* ring : {&lively_, &steady_}) {
    for (std::uint32_t i = 0; i < ring->size; ++i) use(ring->pairs[i]);
  }
}

std::uint32_t CalibrationMonitor::collect() noexcept {
  std::uint32_t size = 0;
  const double delay_s = solution_.parameters[6];
  for_pairs([&](const MotionPair& pair) noexcept {
    HandEyeMotion& motion = motions_[size];
    motion.registered = pair.registered;
    if (pair.given(delay_s, motion.given) &&
        pair.given(delay_s + HandEye::kLater_s, motion.given_later)) {
      ++size;
    }
  });
  return size;
}

Twist CalibrationMonitor::noise() noexcept {
  Twist sigmas;
  for (std::size_t c = 0; c < 6; ++c) {
    std::size_t size = 0;
    for_pairs([&](const MotionPair& pair) noexcept {
      for (const auto& difference : pair.differences) {
        magnitudes_[size++] = std::fabs(static_cast<double>(difference[c]));
      }
    });
    sigmas[static_cast<Eigen::Index>(c)] = scale_of({magnitudes_, size});
  }
  return sigmas;
}

bool CalibrationMonitor::evaluate() noexcept {
  const HandEye hand_eye(noise());
  solution_ = hand_eye.start(solution_.parameters);
  const std::uint32_t size = collect();
  const bool solved =
      2 * size >= pairs() && size >= kFewestMotions && hand_eye.step({motions_, size}, solution_);
  if (!solved || solution_.parameters.cwiseAbs().maxCoeff() > 10.0) solution_ = {};
  return solved && --steps_left_ > 0;
}

const Estimate& CalibrationMonitor::estimate(Part part) const noexcept {
  switch (part) {
    case kRoll:
      return found_.roll_deg;
    case kPitch:
      return found_.pitch_deg;
    case kYaw:
      return found_.yaw_deg;
    case kX:
      return found_.x_m;
    case kY:
      return found_.y_m;
    case kZ:
      return found_.z_m;
    case kDelay:
      return found_.delay_s;
    default:
      return found_.scale;
  }
}

void CalibrationMonitor::say() noexcept {
  constexpr std::uint8_t kInARow = 2;
  constexpr double kSaidScale = 0.06;
  constexpr double kSurely = 4.0;
  // A mount that is turned by more undoes a mistake of the poses on some ways, and makes others.
  constexpr double kFar_rad = 45.0 / kDegreesPerRadian;
  std::size_t size = 0;
  for_pairs([&](const MotionPair& pair) noexcept { magnitudes_[size++] = pair.interval_s(); });
  interval_s_ = size > 0 ? median(std::span(magnitudes_, size)) : 0.0;
  found_ = calibration_of(solution_, interval_s_);
  const bool knows = found_.motions > 0;
  const bool is_far = solution_.parameters.head<3>().cwiseAbs().maxCoeff() > kFar_rad;
  const auto beyond = [&](Part part, double least, double surely) noexcept {
    return knows && estimate(part).is_surely_beyond(least, surely);
  };
  const std::array<bool, kParts> off = {beyond(kRoll, kSaidRoll_deg, kSurely),
                                        beyond(kPitch, kSaid_deg, kSurely),
                                        beyond(kYaw, kSaid_deg, kSurely),
                                        beyond(kX, kSaid_m, kSurely),
                                        beyond(kY, kSaid_m, kSurely),
                                        beyond(kZ, kSaid_m, kMoreSurely),
                                        beyond(kDelay, found_.least_delay_s(), kMoreSurely),
                                        beyond(kScale, kSaidScale, kSurely),
                                        (!knows || is_far) && pairs() >= kFewestMotions};
  said_ = 0;
  for (std::size_t k = 0; k < kParts; ++k) {
    in_a_row_[k] = off[k] ? static_cast<std::uint8_t>(std::min(in_a_row_[k] + 1, 255)) : 0;
    if (in_a_row_[k] >= kInARow) said_ |= 1U << k;
  }
  mistake_ = KnownMistake::kNone;
  if (said_ == 0) return;
  look_for_mistake();
  if (mistake_ != KnownMistake::kNone) said_ = 1U << kMotion;
}

void CalibrationMonitor::look_for_mistake() noexcept {
  constexpr double kTurned_rad = 1.5 / kDegreesPerRadian;
  constexpr double kMoved_m = 0.1;
  constexpr double kMovedShare = 0.1;
  constexpr double kSurely = 6.0;
  constexpr double kUnknown = 5.0;
  const auto cost_of_motion = [&](const Pose& registered, const Pose& moved) noexcept {
    const Twist off = twist_of(registered.inverse() * moved);
    const double metres = kMoved_m + kMovedShare * registered.translation.norm();
    return log_of_1_plus(off.head<3>().squaredNorm() / (kTurned_rad * kTurned_rad)) +
           log_of_1_plus(off.tail<3>().squaredNorm() / (metres * metres));
  };
  const auto cost_of = [&](KnownMistake mistake) noexcept {
    double sum = 0.0;
    for_pairs([&](const MotionPair& pair) noexcept {
      sum += cost_of_motion(pair.registered, pair.without(mistake));
    });
    return sum;
  };
  // A mistake explains the motions surely better than the given poses, and as well as a mount and
  // a delay do.
  double least = cost_of(KnownMistake::kNone) - kSurely;
  if (found_.motions > 0) {
    const Pose mount = HandEye::mount_of(solution_.parameters);
    const std::uint32_t known = collect();
    double calibrated = kUnknown * static_cast<double>(pairs() - known);
    for (std::uint32_t i = 0; i < known; ++i) {
      Pose given = motions_[i].given;
      given.translation *= 1.0 + solution_.parameters[7];
      calibrated += cost_of_motion(motions_[i].registered, mount.inverse() * given * mount);
    }
    least = std::min(least, calibrated + kSurely);
  }
  for (std::uint8_t id = 1; id < kKnownMistakes; ++id) {
    const auto mistake = static_cast<KnownMistake>(id);
    const double cost = cost_of(mistake);
    if (cost >= least) continue;
    least = cost;
    mistake_ = mistake;
  }
  std::size_t size = 0;
  for_pairs([&](const MotionPair& pair) noexcept {
    magnitudes_[size++] =
        pair.given().translation.norm() / std::max(pair.registered.translation.norm(), 1e-3);
  });
  length_ratio_ = median(std::span(magnitudes_, size));
}

}  // namespace unimapper::onboard
