#include "ports/datasets/sweep_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "ports/datasets/sharpness.hpp"
#include "ports/datasets/sweep_motion.hpp"

namespace unimapper::datasets {
namespace {

constexpr std::size_t kWindowScans = 15;
constexpr std::size_t kWindows = 2;
/// At this range a rotation is taken for a motion.
constexpr double kLever_m = 10.0;

double extent_m(const Pose& motion) {
  return motion.translation.norm() + kLever_m * rotation_angle(motion.rotation);
}

/// Scans that see the same surroundings while the sensor moves.
struct Window {
  std::size_t first = 0, stride = 1;
  double motion_m = 0.0;
  [[nodiscard]] std::size_t last() const { return first + (kWindowScans - 1) * stride; }
};

/// Whether windows have times; a scan without is read once.
class WindowTimes {
 public:
  explicit WindowTimes(const Dataset& dataset) : dataset_(dataset) {}
  bool of_scan(std::size_t i) {
    dataset_.read_scan(i, scan_);
    // A scan that cannot be read has no points, and says nothing.
    const bool is_without = scan_.time_s.empty() && !scan_.points.empty();
    if (is_without) without_.push_back(i);
    return !is_without;
  }
  bool operator()(const Window& window) {
    const bool is_known = std::any_of(without_.begin(), without_.end(), [&](std::size_t i) {
      return i >= window.first && i <= window.last();
    });
    return !is_known && of_scan(window.first) && of_scan(window.last());
  }
  /// Scans found without.
  [[nodiscard]] std::size_t without() const { return without_.size(); }

 private:
  const Dataset& dataset_;
  Scan scan_;
  std::vector<std::size_t> without_;
};

/// The windows with most motion, each apart from the others; a driver may begin to give times, or
/// cease, while it is recorded.
std::vector<Window> choose_windows(const Dataset& dataset, WindowTimes& has_times) {
  constexpr double kWindow_s = 3.0;
  const std::size_t count = dataset.scan_count();
  std::vector<Window> chosen;
  if (count < kWindowScans) return chosen;
  const double lasted_s =
      1e-9 * static_cast<double>(dataset.stamp_ns(count - 1) - dataset.stamp_ns(0));
  const double interval_s = std::max(1e-3, lasted_s / static_cast<double>(count - 1));
  const std::size_t stride = std::clamp<std::size_t>(
      static_cast<std::size_t>(kWindow_s / interval_s / kWindowScans), 1, count / kWindowScans);
  std::vector<Window> all;
  for (std::size_t first = 0; first + (kWindowScans - 1) * stride < count; ++first) {
    Window window{first, stride};
    for (std::size_t i = first; i < window.last(); i += stride) {
      window.motion_m += extent_m(dataset.pose(i).inverse() * dataset.pose(i + stride));
    }
    all.push_back(window);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Window& a, const Window& b) { return a.motion_m > b.motion_m; });
  constexpr std::size_t kMostWithout = 16;
  for (const Window& window : all) {
    if (chosen.size() == kWindows || has_times.without() > kMostWithout) break;
    const bool is_apart = std::all_of(chosen.begin(), chosen.end(), [&](const Window& other) {
      return window.last() < other.first || window.first > other.last();
    });
    if (is_apart && has_times(window)) chosen.push_back(window);
  }
  return chosen;
}

/// Ways to read the times; the first leaves the points where they are.
enum Reading : std::size_t { kAsRecorded, kForwards, kBackwards, kLater, kEarlier, kReadings };

TimeReading reading_of(Reading reading, double sweep_s) {
  switch (reading) {
    case kBackwards:
      return {-1.0, 0.0};
    case kLater:
      return {1.0, sweep_s};
    case kEarlier:
      return {1.0, -sweep_s};
    default:
      return {1.0, 0.0};
  }
}

bool is_useful(const Scan::Point& point) {
  const float range2 = point.x * point.x + point.y * point.y + point.z * point.z;
  constexpr float kNear_m = 2.0F;
  constexpr float kFar_m = 40.0F;
  return range2 > kNear_m * kNear_m && range2 < kFar_m * kFar_m;
}

/// Thickness of one window's surfaces by every reading.
class WindowThickness {
 public:
  WindowThickness(const Dataset& dataset, const SensorMotion& poses)
      : dataset_(dataset), poses_(poses) {}

  /// False where a scan has no times.
  bool add(const Window& window) {
    T_window_odometry_ = dataset_.pose(window.first).inverse();
    for (std::size_t i = window.first; i <= window.last(); i += window.stride) {
      dataset_.read_scan(i, scan_);
      if (scan_.points.empty()) continue;
      if (scan_.time_s.size() != scan_.points.size()) return false;
      add_scan(i);
    }
    return true;
  }

  [[nodiscard]] double log_thickness(Reading reading) const {
    return surfaces_[reading].log_thickness();
  }
  /// Largest motion within a sweep.
  [[nodiscard]] double sweep_motion_m() const { return sweep_motion_m_; }

 private:
  void add_scan(std::size_t index) {
    const std::int64_t stamp_ns = dataset_.stamp_ns(index);
    const auto [first, last] = std::minmax_element(scan_.time_s.begin(), scan_.time_s.end());
    const auto at = [&](double time_s) {
      return poses_.at(stamp_ns + static_cast<std::int64_t>(1e9 * time_s));
    };
    sweep_motion_m_ = std::max(sweep_motion_m_, extent_m(at(*first).inverse() * at(*last)));
    const double sweep_s = static_cast<double>(*last) - static_cast<double>(*first);
    const Pose T_window_stamp = T_window_odometry_ * dataset_.pose(index);
    constexpr std::size_t kMostPoints = 10'000;
    const std::size_t step = scan_.points.size() / kMostPoints + 1;
    for (std::size_t r = 0; r < kReadings; ++r) {
      const auto reading = static_cast<Reading>(r);
      const SweepMotion motion(poses_, stamp_ns, scan_, reading_of(reading, sweep_s));
      surfaces_[reading].begin_scan();
      for (std::size_t i = index % step; i < scan_.points.size(); i += step) {
        const Scan::Point& p = scan_.points[i];
        if (!is_useful(p)) continue;
        const Eigen::Vector3f point =
            reading == kAsRecorded ? Eigen::Vector3f(p.x, p.y, p.z) : motion(p, scan_.time_s[i]);
        if (point.allFinite()) surfaces_[reading].add(T_window_stamp * point.cast<double>());
      }
    }
  }

  const Dataset& dataset_;
  const SensorMotion& poses_;
  Pose T_window_odometry_;
  Scan scan_;
  double sweep_motion_m_ = 0.0;
  std::array<SurfaceThickness, kReadings> surfaces_;
};

// Readings whose thickness differs by less, as a logarithm, are equally good.
constexpr double kClear = 0.01;

SweepFinding finding_of(const std::array<double, kReadings>& log_thickness) {
  const auto best = static_cast<std::size_t>(
      std::min_element(log_thickness.begin(), log_thickness.end()) - log_thickness.begin());
  const auto is_good = [&](Reading reading) {
    return log_thickness[reading] < log_thickness[best] + kClear;
  };
  if (is_good(kAsRecorded)) {
    return is_good(kForwards) ? SweepFinding::kNoMotion : SweepFinding::kCompensated;
  }
  // What helps whatever the times are taken for is not the motion: a straight tunnel shows none
  // along it.
  const double best_other =
      std::min({log_thickness[kBackwards], log_thickness[kLater], log_thickness[kEarlier]});
  if (std::abs(log_thickness[kForwards] - best_other) < kClear) return SweepFinding::kUnclear;
  if (best == kForwards) return SweepFinding::kSharper;
  return best == kBackwards ? SweepFinding::kReversed : SweepFinding::kOtherEnd;
}

}  // namespace

SweepCheck check_sweeps(const Dataset& dataset, const SensorMotion& poses) {
  SweepCheck check;
  if (dataset.scan_count() == 0) return check;
  WindowTimes has_times(dataset);
  const std::size_t last = dataset.scan_count() - 1;
  if (!has_times.of_scan(0) && !has_times.of_scan(last / 2) && !has_times.of_scan(last)) {
    return check;
  }
  check.finding = SweepFinding::kNoMotion;
  std::array<double, kReadings> sums{};
  double most_m = 0.0;
  for (const Window& window : choose_windows(dataset, has_times)) {
    WindowThickness thickness(dataset, poses);
    if (!thickness.add(window)) continue;
    for (std::size_t r = 0; r < kReadings; ++r) {
      sums[r] += thickness.log_thickness(static_cast<Reading>(r));
    }
    check.scans += kWindowScans;
    most_m = std::max(most_m, thickness.sweep_motion_m());
  }
  // Less is below what surfaces are thick by noise.
  constexpr double kLeast_m = 0.02;
  if (check.scans == 0 || most_m < kLeast_m) return check;
  const auto windows = static_cast<double>(check.scans / kWindowScans);
  for (double& sum : sums) sum /= windows;
  check.finding = finding_of(sums);
  check.compensated = std::exp(sums[kForwards] - sums[kAsRecorded]);
  check.best_other =
      std::exp(std::min({sums[kBackwards], sums[kLater], sums[kEarlier]}) - sums[kAsRecorded]);
  return check;
}

bool is_sharper_without_times(
    const Dataset& dataset,
    const std::function<BothReadings(std::size_t first, std::size_t end)>& read) {
  WindowTimes has_times(dataset);
  double as_recorded = 0.0;
  double compensated = 0.0;                // by the poses found with times
  double compensated_without_times = 0.0;  // by the others
  double windows = 0.0;
  for (const Window& window : choose_windows(dataset, has_times)) {
    const BothReadings both = read(window.first, window.last() + 1);
    const SensorMotion with_motion(*both.with_times);
    const SensorMotion without_motion(*both.without_times);
    WindowThickness with(*both.with_times, with_motion);
    WindowThickness without(*both.without_times, without_motion);
    if (!with.add(window) || !without.add(window)) continue;
    as_recorded += without.log_thickness(kAsRecorded);
    compensated += with.log_thickness(kForwards);
    compensated_without_times += without.log_thickness(kForwards);
    windows += 1.0;
  }
  return std::min(compensated, compensated_without_times) > as_recorded + windows * kClear;
}

std::string SweepCheck::text() const {
  char shares[96] = "";
  if (compensated > 0.0) {
    std::snprintf(shares, sizeof shares, " (by it surfaces of %zu scans are %.0f %% as thick)",
                  scans, 100.0 * compensated);
  }
  switch (finding) {
    case SweepFinding::kSharper:
      return std::string("motion within sweeps compensated") + shares;
    case SweepFinding::kNoMotion:
      if (scans == 0) {
        return "motion within sweeps not compensated: too few scans to tell whether that is right; "
               "--deskew on compensates it";
      }
      return std::string("motion within sweeps is too small to matter") + shares;
    case SweepFinding::kCompensated:
      return std::string(
                 "motion within sweeps not compensated: it would blur the scans, whose "
                 "points seem to be compensated already") +
             shares;
    case SweepFinding::kReversed:
      return std::string(
                 "motion within sweeps not compensated: the points' times seem to run "
                 "backwards, or poses and scans are of different axes") +
             shares;
    case SweepFinding::kOtherEnd:
      return std::string(
                 "motion within sweeps not compensated: the stamps seem to be of the other "
                 "end of the sweep than the points' times") +
             shares;
    case SweepFinding::kUnclear:
      return std::string(
                 "motion within sweeps not compensated: the surroundings do not show "
                 "whether that is right; --deskew on compensates it") +
             shares;
    case SweepFinding::kNoTimes:
      break;
  }
  return "motion within sweeps not compensated: the recording has no time per point";
}

}  // namespace unimapper::datasets
