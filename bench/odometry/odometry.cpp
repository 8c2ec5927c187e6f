// Odometry over a recording: time per scan, relative and absolute error against its poses
#include "unimapper/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/odometry/point_to_point.hpp"
#include "ports/datasets/dataset.hpp"
#include "src/core/quantile.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/evaluate/trajectory.hpp"

using namespace unimapper;

namespace {

using evaluate::PosePair;

/// Distance along the true poses up to each.
std::vector<double> path_of(const std::vector<PosePair>& pairs) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] =
        path_m[i - 1] + (pairs[i].truth.translation - pairs[i - 1].truth.translation).norm();
  }
  return path_m;
}

/// KITTI's relative error, with segments of lengths that short drives have.
struct RelativeError {
  double translation_percent = 0.0;
  std::size_t segments = 0;
};

RelativeError relative_error(const std::vector<PosePair>& pairs) {
  const std::vector<double> path_m = path_of(pairs);
  RelativeError error;
  for (std::size_t first = 0; first < pairs.size(); ++first) {
    for (double length_m = 20.0; length_m <= 100.0; length_m += 20.0) {
      const auto end = std::lower_bound(path_m.begin(), path_m.end(), path_m[first] + length_m);
      if (end == path_m.end()) break;
      const auto last = static_cast<std::size_t>(end - path_m.begin());
      const Pose truth = pairs[first].truth.inverse() * pairs[last].truth;
      const Pose estimate = pairs[first].estimate.inverse() * pairs[last].estimate;
      error.translation_percent +=
          100.0 * (estimate.inverse() * truth).translation.norm() / length_m;
      ++error.segments;
    }
  }
  error.translation_percent /= std::max(1.0, static_cast<double>(error.segments));
  return error;
}

/// Time of this thread on the processor: other programs share the machine.
double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Error of the place since the first scan, odometry axes.
Eigen::Vector3d error_of(const PosePair& first, const PosePair& last) {
  const Pose truth = first.truth.inverse() * last.truth;
  const Pose estimate = first.estimate.inverse() * last.estimate;
  return first.estimate.rotation * (estimate.translation - truth.translation);
}

/// What the sum of covariances says of an error in its direction.
double sigma_of(const Eigen::Matrix3d& covariance_m2, const Eigen::Vector3d& error) {
  const Eigen::Vector3d along = error.normalized();
  return std::sqrt(along.dot(covariance_m2 * along));
}

/// What an odometry said of every scan of a recording.
struct Run {
  std::vector<PosePair> pairs;
  std::vector<double> ms;          ///< of each scan
  std::vector<double> up_off_deg;  ///< of up, or else of the z axis, in each scan
  double up_sigma_deg = 0.0;       ///< at the end, by the accelerometer
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< of the place at the end
  std::size_t degenerate = 0;
  std::size_t lost = 0;
  double most_sigmas = 0.0;  ///< off from the truth by so many, where that is more than 1 m
};

/// Tells the odometry of what a gyroscope would measure: 200 Hz, by the recorded poses.
class SimulatedGyroscope {
 public:
  explicit SimulatedGyroscope(const datasets::Dataset& dataset) : dataset_(dataset) {}

  /// All samples up to a time.
  void tell(std::int64_t until_ns, LidarOdometry& odometry) {
    constexpr std::int64_t kPeriod_ns = 5'000'000;
    if (next_ns_ == 0) next_ns_ = until_ns - 400'000'000;
    for (; next_ns_ <= until_ns; next_ns_ += kPeriod_ns) {
      const auto before = dataset_.pose_at(next_ns_ - kPeriod_ns / 2);
      const auto after = dataset_.pose_at(next_ns_ + kPeriod_ns / 2);
      if (!before || !after) continue;
      const Eigen::AngleAxisd turn(before->rotation.transpose() * after->rotation);
      const Eigen::Vector3d noise(noise_(random_), noise_(random_), noise_(random_));
      const Eigen::Vector3d bias(0.01, -0.02, 0.015);
      static_cast<void>(odometry.add_angular_velocity(
          next_ns_, turn.angle() / (1e-9 * kPeriod_ns) * turn.axis() + bias + noise));
    }
  }

 private:
  const datasets::Dataset& dataset_;
  std::int64_t next_ns_ = 0;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0.0, 0.005};  // rad/s
};

enum class Imu { kNone, kGyroscope, kRecorded };

/// Which scans of a recording are taken, in which order, and how far they are seen: one recording
/// is several then.
struct Selection {
  std::size_t first = 0;
  std::size_t every = 1;
  bool is_reversed = false;
  double range_m = LidarOdometryConfig{}.max_range_m;

  [[nodiscard]] std::vector<std::size_t> scans(std::size_t count) const {
    std::vector<std::size_t> chosen;
    for (std::size_t i = first; i < count; i += every) chosen.push_back(i);
    if (is_reversed) std::reverse(chosen.begin(), chosen.end());
    return chosen;
  }
  /// Since the first scan that is taken.
  [[nodiscard]] std::int64_t stamp_ns(const datasets::Dataset& dataset, std::size_t scan) const {
    const std::size_t count = dataset.scan_count();
    return is_reversed ? dataset.stamp_ns(count - 1) - dataset.stamp_ns(scan)
                       : dataset.stamp_ns(scan) - dataset.stamp_ns(first);
  }
};

/// Points out of range are no numbers.
void cut(datasets::Scan& scan, double range_m) {
  for (datasets::Scan::Point& point : scan.points) {
    if (std::hypot(point.x, point.y, point.z) > range_m) {
      point.x = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

Run run_point_to_point(const datasets::Dataset& dataset, const Selection& selection) {
  const std::vector<Pose> truths = dataset.ground_truth_poses();
  bench::PointToPoint odometry;
  datasets::Scan scan;
  Run run;
  for (const std::size_t i : selection.scans(dataset.scan_count())) {
    dataset.read_scan(i, scan);
    cut(scan, selection.range_m);
    // The first stamp is 0, so that no digit of a time is lost.
    const double stamp_s = 1e-9 * static_cast<double>(selection.stamp_ns(dataset, i));
    const double begin_ms = processor_ms();
    const Pose pose = odometry.add_scan(stamp_s, scan.view(), scan.time_s);
    run.ms.push_back(processor_ms() - begin_ms);
    run.up_off_deg.push_back(0.0);
    run.pairs.push_back({pose, truths.empty() ? dataset.pose(i) : truths[i]});
  }
  return run;
}

Run run(const datasets::Dataset& dataset, Imu imu, bool is_swept, const Selection& selection) {
  const LidarOdometryConfig config;
  MemoryBlock memory(LidarOdometry::required_bytes(config));
  const auto created = LidarOdometry::create(config, memory.span());
  if (!created) throw std::runtime_error(created.error().message);
  const std::vector<Pose> truths = dataset.ground_truth_poses();
  Run run;
  SimulatedGyroscope gyroscope(dataset);
  datasets::RecordedGyroscope recorded;
  if (imu == Imu::kRecorded) recorded = dataset.gyroscope();
  auto sample = recorded.samples.begin();
  datasets::Scan scan;
  for (const std::size_t i : selection.scans(dataset.scan_count())) {
    dataset.read_scan(i, scan);
    cut(scan, selection.range_m);
    if (!is_swept) scan.time_s.clear();
    const float last_s =
        scan.time_s.empty() ? 0.0F : *std::max_element(scan.time_s.begin(), scan.time_s.end());
    const std::int64_t last_ns = dataset.stamp_ns(i) + static_cast<std::int64_t>(1e9F * last_s);
    if (imu == Imu::kGyroscope) gyroscope.tell(last_ns, **created);
    for (; sample != recorded.samples.end() && sample->stamp_ns <= last_ns; ++sample) {
      static_cast<void>((*created)->add_angular_velocity(sample->stamp_ns, sample->rad_s));
      static_cast<void>((*created)->add_acceleration(sample->stamp_ns, sample->acceleration));
    }
    const double begin_ms = processor_ms();
    const OdometryResult result = (*created)->add_scan(
        selection.is_reversed ? selection.stamp_ns(dataset, i) : dataset.stamp_ns(i), scan.view(),
        scan.time_s);
    run.ms.push_back(processor_ms() - begin_ms);
    run.degenerate += result.state == OdometryState::kDegenerate ? 1 : 0;
    run.lost += result.state == OdometryState::kLost ? 1 : 0;
    const Pose& truth = truths.empty() ? dataset.pose(i) : truths[i];
    const Eigen::Vector3d up =
        result.T_odometry_sensor.rotation * truth.rotation.transpose().col(2);
    run.up_off_deg.push_back(kDegreesPerRadian * up.cross(result.up).norm());
    run.covariance_m2 += result.covariance.topLeftCorner<3, 3>();
    run.up_sigma_deg = kDegreesPerRadian * result.up_sigma_rad;
    run.pairs.push_back({result.T_odometry_sensor, truth});
    const Eigen::Vector3d error = error_of(run.pairs.front(), run.pairs.back());
    if (error.norm() > 1.0) {
      run.most_sigmas =
          std::max(run.most_sigmas, error.norm() / sigma_of(run.covariance_m2, error));
    }
  }
  return run;
}

void print(Run run) {
  const std::vector<PosePair>& pairs = run.pairs;
  const RelativeError relative = relative_error(pairs);
  const auto ate = evaluate::trajectory_error(pairs, evaluate::align(pairs).T_truth_estimate);
  const double path_m = path_of(pairs).back();
  const Eigen::Vector3d end = error_of(pairs.front(), pairs.back());
  const double end_m = end.norm();
  std::printf(
      "path_m %.1f rel_percent %.3f segments %zu ate_m %.3f drift_percent %.3f ms_p50 %.1f ms_p99 "
      "%.1f degenerate %zu lost %zu up_off_deg %.2f up_sigma_deg %.2f "
      "end_m %.2f end_sigma_m %.2f most_sigmas %.1f\n",
      path_m, relative.translation_percent, relative.segments, ate.translation_m.rmse,
      100.0 * end_m / std::max(1.0, path_m), quantile(std::span(run.ms), 0.5),
      quantile(std::span(run.ms), 0.99), run.degenerate, run.lost,
      quantile(std::span(run.up_off_deg), 0.5), run.up_sigma_deg, end_m,
      sigma_of(run.covariance_m2, end), run.most_sigmas);
}

}  // namespace

int main(int argc, char** argv) {
  Imu imu = Imu::kNone;
  bool is_swept = true;
  bool is_point_to_point = false;
  bool is_known = argc >= 2;
  Selection selection;
  for (int i = 2; i < argc; ++i) {
    const std::string option = argv[i];
    const std::string value = option.substr(std::min(option.size(), option.find('=') + 1));
    if (option == "gyroscope")
      imu = Imu::kGyroscope;
    else if (option == "imu")
      imu = Imu::kRecorded;
    else if (option == "swept-as-still")
      is_swept = false;
    else if (option == "point-to-point")
      is_point_to_point = true;
    else if (option == "reversed")
      selection.is_reversed = true;
    else if (option.starts_with("from="))
      selection.first = std::stoul(value);
    else if (option.starts_with("every="))
      selection.every = std::stoul(value);
    else if (option.starts_with("range="))
      selection.range_m = std::stod(value);
    else
      is_known = false;
  }
  if (!is_known) {
    std::fprintf(stderr,
                 "usage: odometry_bench RECORDING [gyroscope | imu | swept-as-still | "
                 "point-to-point] [from=SCAN] [every=SCANS] [range=METRES] [reversed]\n"
                 "reversed: of scans whose points have no times\n");
    return 2;
  }
  try {
    // The odometry compensates sweeps by itself.
    const auto dataset = datasets::open_dataset(argv[1], {.deskew = datasets::Deskew::kOff});
    print(is_point_to_point ? run_point_to_point(*dataset, selection)
                            : run(*dataset, imu, is_swept, selection));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "odometry_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
