// Odometry over a recording: time per scan, relative and absolute error against its poses
#include "unimapper/odometry/odometry.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/evaluate/trajectory.hpp"

using namespace unimapper;

namespace {

using evaluate::PosePair;

/// KITTI's relative error, with segments of lengths that short drives have.
struct RelativeError {
  double translation_percent = 0.0;
  double rotation_deg_per_m = 0.0;
  std::size_t segments = 0;
};

RelativeError relative_error(const std::vector<PosePair>& pairs) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] =
        path_m[i - 1] + (pairs[i].truth.translation - pairs[i - 1].truth.translation).norm();
  }
  RelativeError error;
  for (std::size_t first = 0; first < pairs.size(); ++first) {
    for (double length_m = 20.0; length_m <= 100.0; length_m += 20.0) {
      const auto end = std::lower_bound(path_m.begin(), path_m.end(), path_m[first] + length_m);
      if (end == path_m.end()) break;
      const auto last = static_cast<std::size_t>(end - path_m.begin());
      const Pose truth = pairs[first].truth.inverse() * pairs[last].truth;
      const Pose estimate = pairs[first].estimate.inverse() * pairs[last].estimate;
      const Pose difference = estimate.inverse() * truth;
      error.translation_percent += 100.0 * difference.translation.norm() / length_m;
      error.rotation_deg_per_m +=
          rotation_angle(difference.rotation) * kDegreesPerRadian / length_m;
      ++error.segments;
    }
  }
  const double count = std::max(1.0, static_cast<double>(error.segments));
  error.translation_percent /= count;
  error.rotation_deg_per_m /= count;
  return error;
}

/// Time of this thread on the processor: other programs share the machine.
double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

const char* name_of(OdometryState state) {
  switch (state) {
    case OdometryState::kStarting:
      return "starting";
    case OdometryState::kTracking:
      return "tracking";
    case OdometryState::kDegenerate:
      return "degenerate";
    case OdometryState::kLost:
      return "lost";
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Odometry over a recording"};
  std::string folder;
  std::string out;
  std::size_t most = 100000;
  LidarOdometryConfig config;
  bool states = false;
  bool each = false;
  app.add_option("recording", folder)->required();
  app.add_option("--out", out, "TUM file of the poses");
  app.add_option("--scans", most, "Most scans");
  app.add_option("--voxel", config.voxel_m);
  app.add_option("--max-range", config.max_range_m);
  app.add_option("--min-range", config.min_range_m);
  app.add_flag("--states", states, "Print changes of the state");
  app.add_flag("--each", each, "Print the error of each step");
  CLI11_PARSE(app, argc, argv);

  datasets::OpenOptions options;
  options.deskew = datasets::Deskew::kOff;
  const auto dataset = datasets::open_dataset(folder, options);
  MemoryBlock memory(LidarOdometry::required_bytes(config));
  const auto created = LidarOdometry::create(config, memory.span());
  if (!created) throw std::runtime_error(created.error().message);
  LidarOdometry& odometry = **created;

  std::vector<PosePair> pairs;
  std::vector<double> ms;
  std::ofstream tum(out.empty() ? "/dev/null" : out);
  tum.precision(12);
  datasets::Scan scan;
  OdometryState state = OdometryState::kStarting;
  std::size_t counts[4] = {};
  const std::vector<Pose> truths = dataset->ground_truth_poses();
  for (std::size_t i = 0; i < std::min(most, dataset->scan_count()); ++i) {
    dataset->read_scan(i, scan);
    const double begin_ms = processor_ms();
    const OdometryResult result = odometry.add_scan(dataset->stamp_ns(i), scan.view(), scan.time_s);
    ms.push_back(processor_ms() - begin_ms);
    ++counts[static_cast<int>(result.state)];
    if (states && (result.state != state || !result.error.ok())) {
      std::printf("scan %zu: %s %s %s\n", i, name_of(result.state), result.reason,
                  result.error.message);
      for (std::uint32_t k = 0; k < result.weak.count; ++k) {
        std::printf("  weak %.2f %.2f %.2f  %.2f %.2f %.2f\n", result.weak.axes(0, k),
                    result.weak.axes(1, k), result.weak.axes(2, k), result.weak.axes(3, k),
                    result.weak.axes(4, k), result.weak.axes(5, k));
      }
    }
    state = result.state;
    pairs.push_back({result.T_odometry_sensor, truths.empty() ? dataset->pose(i) : truths[i]});
    if (each && pairs.size() > 1) {
      const PosePair& a = pairs[pairs.size() - 2];
      const PosePair& b = pairs.back();
      const Pose truth = a.truth.inverse() * b.truth;
      const Pose off = truth.inverse() * (a.estimate.inverse() * b.estimate);
      const Pose whole = (pairs[0].truth.inverse() * b.truth).inverse() *
                         (pairs[0].estimate.inverse() * b.estimate);
      std::printf("%zu step_m %.3f deg %.2f error_m %.3f deg %.3f whole_m %.3f deg %.3f\n", i,
                  truth.translation.norm(), rotation_angle(truth.rotation) * kDegreesPerRadian,
                  off.translation.norm(), rotation_angle(off.rotation) * kDegreesPerRadian,
                  whole.translation.norm(), rotation_angle(whole.rotation) * kDegreesPerRadian);
    }
    const Eigen::Quaterniond q = result.T_odometry_sensor.quaternion();
    const Eigen::Vector3d& t = result.T_odometry_sensor.translation;
    tum << static_cast<double>(dataset->stamp_ns(i)) * 1e-9 << ' ' << t.x() << ' ' << t.y() << ' '
        << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
  const RelativeError relative = relative_error(pairs);
  const auto ate = evaluate::trajectory_error(pairs, evaluate::align(pairs).T_truth_estimate);
  double path_m = 0.0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path_m += (pairs[i].truth.translation - pairs[i - 1].truth.translation).norm();
  }
  const Pose begin_to_end = pairs.front().truth.inverse() * pairs.back().truth;
  const Pose estimated = pairs.front().estimate.inverse() * pairs.back().estimate;
  const double end_m = (begin_to_end.translation - estimated.translation).norm();
  std::vector<double> sorted = ms;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  std::printf(
      "scans %zu path_m %.1f rel_percent %.3f rot_deg_per_100m %.2f segments %zu ate_m %.3f "
      "end_m %.3f drift_percent %.3f ms_p50 %.1f ms_p99 %.1f ms_max %.1f memory_mb %.1f starting "
      "%zu "
      "tracking %zu degenerate %zu lost %zu time %d\n",
      pairs.size(), path_m, relative.translation_percent, 100.0 * relative.rotation_deg_per_m,
      relative.segments, ate.translation_m.rmse, end_m, 100.0 * end_m / std::max(1.0, path_m),
      at(0.5), at(0.99), sorted.back(), static_cast<double>(memory.size()) / 1048576.0, counts[0],
      counts[1], counts[2], counts[3], scan.time_s.empty() ? 0 : 1);
  return 0;
}
