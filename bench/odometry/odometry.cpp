// Odometry over a recording: time per scan, relative and absolute error against its poses
#include "unimapper/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
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

/// The stamp of the first scan is 0, so that no digit of a time is lost.
double seconds_of(const datasets::Dataset& dataset, std::size_t scan) {
  return 1e-9 * static_cast<double>(dataset.stamp_ns(scan) - dataset.stamp_ns(0));
}

Run run_point_to_point(const datasets::Dataset& dataset) {
  const std::vector<Pose> truths = dataset.ground_truth_poses();
  bench::PointToPoint odometry;
  datasets::Scan scan;
  Run run;
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    dataset.read_scan(i, scan);
    const double begin_ms = processor_ms();
    const Pose pose = odometry.add_scan(seconds_of(dataset, i), scan.view(), scan.time_s);
    run.ms.push_back(processor_ms() - begin_ms);
    run.up_off_deg.push_back(0.0);
    run.pairs.push_back({pose, truths.empty() ? dataset.pose(i) : truths[i]});
  }
  return run;
}

Run run(const datasets::Dataset& dataset, Imu imu, bool is_swept, std::size_t first_scan) {
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
  for (std::size_t i = first_scan; i < dataset.scan_count(); ++i) {
    dataset.read_scan(i, scan);
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
    const OdometryResult result =
        (*created)->add_scan(dataset.stamp_ns(i), scan.view(), scan.time_s);
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
  const std::string mode = argc == 3 ? argv[2] : "";
  const Imu imu = mode == "gyroscope" ? Imu::kGyroscope
                  : mode == "imu"     ? Imu::kRecorded
                                      : Imu::kNone;
  const bool is_later = mode.rfind("from=", 0) == 0;
  const bool is_known =
      imu != Imu::kNone || is_later || mode == "swept-as-still" || mode == "point-to-point";
  if (argc != 2 && !is_known) {
    std::fprintf(stderr,
                 "usage: odometry_bench RECORDING [gyroscope | imu | swept-as-still | "
                 "point-to-point | from=SCAN]\n");
    return 2;
  }
  try {
    // The odometry compensates sweeps by itself.
    const auto dataset = datasets::open_dataset(argv[1], {.deskew = datasets::Deskew::kOff});
    const std::size_t first_scan = is_later ? std::stoul(mode.substr(5)) : 0;
    print(mode == "point-to-point" ? run_point_to_point(*dataset)
                                   : run(*dataset, imu, mode != "swept-as-still", first_scan));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "odometry_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
