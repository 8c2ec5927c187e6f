// Error of the estimated up against the truth of recordings
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/core/quantile.hpp"
#include "src/core/tilt_prior.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;

namespace {

constexpr std::uint32_t kFirstKeyframe = 2;  // from 0; up is rarely known before

/// What is found in one recording, or in all of them.
struct Result {
  std::size_t keyframes = 0;
  std::size_t within = 0;
  std::vector<double> error_deg;  ///< where up is known
  std::vector<double> sigma_deg;  ///< the larger standard deviation there
  std::vector<double> odometry_deg;

  void add(const Result& other) {
    keyframes += other.keyframes;
    within += other.within;
    const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(error_deg, other.error_deg);
    append(sigma_deg, other.sigma_deg);
    append(odometry_deg, other.odometry_deg);
  }
};

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegreesPerRadian;
}

/// The rotation by which all poses are turned: what odometry from identity does where the sensor is
/// mounted tilted. The points stay as they are.
Eigen::Matrix3d tilt_of(const std::vector<double>& roll_pitch_deg) {
  return (Eigen::AngleAxisd(roll_pitch_deg[1] / kDegreesPerRadian, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_pitch_deg[0] / kDegreesPerRadian, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

void add_keyframe(const KeyframeView& view, const Eigen::Vector3d& true_up, Result& result) {
  if (view.sequence < kFirstKeyframe) return;
  ++result.keyframes;
  result.odometry_deg.push_back(angle_deg(true_up, Eigen::Vector3d::UnitZ()));
  if (!view.up.known) return;
  const Eigen::Vector3d in_frame = view.T_odometry_keyframe.rotation.transpose() * true_up;
  result.error_deg.push_back(angle_deg(in_frame, Eigen::Vector3d::UnitZ()));
  result.sigma_deg.push_back(view.up.sigma() * kDegreesPerRadian);
  // Two dimensions: 95.4 % of what is normal lies within.
  const auto xx = static_cast<double>(view.up.variance_x);
  const auto xy = static_cast<double>(view.up.covariance_xy);
  const auto yy = static_cast<double>(view.up.variance_y);
  const double x = in_frame.x();
  const double y = in_frame.y();
  const double squared = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
  result.within += squared <= 6.18 ? 1 : 0;
}

Result run(const std::string& recording, const Eigen::Matrix3d& tilt) {
  const auto dataset = datasets::open_dataset(recording);
  const std::string name = dataset->sensor();
  const SensorModel* const sensor = find_sensor(name.empty() ? "hdl-64e" : name);
  if (sensor == nullptr) throw std::runtime_error("unknown sensor " + name);
  PipelineConfig config = preset(sensor->kind);
  config.loop_search.max_places = 16;
  OwnedPipeline pipeline(config);
  if (!pipeline) throw std::runtime_error(pipeline.error().message);
  const std::vector<Pose> truth = dataset->ground_truth_poses();
  Result result;
  const auto take_keyframe = [&] {
    const KeyframeView& view = pipeline->keyframe();
    const KeyframeScan& scan = view.scans[view.reference_scan];
    // Without truth the odometry is taken for level.
    const Eigen::Vector3d up_in_sensor =
        truth.empty() ? dataset->pose(scan.scan_index).rotation.row(2).transpose().eval()
                      : truth[scan.scan_index].rotation.row(2).transpose().eval();
    add_keyframe(view, scan.T_odometry_sensor.rotation * up_in_sensor, result);
  };
  datasets::Scan scan;
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    dataset->read_scan(i, scan);
    Pose pose = dataset->pose(i);
    pose.rotation = tilt * pose.rotation;
    pose.translation = tilt * pose.translation;
    if (pipeline->add_scan(scan.view(), pose, dataset->stamp_ns(i)).keyframe_ready) {
      take_keyframe();
    }
  }
  if (pipeline->flush().keyframe_ready) take_keyframe();
  return result;
}

void print(const std::string& name, Result result) {
  const auto at = [](std::vector<double>& values, double share) {
    return values.empty() ? 0.0 : quantile(std::span(values), share);
  };
  const std::size_t known = result.error_deg.size();
  std::printf(
      "%-34s %4zu %4zu %6.2f %6.2f %6.2f %6.2f %6.2f %5.1f\n", name.c_str(), result.keyframes,
      known, at(result.odometry_deg, 0.5), at(result.error_deg, 0.5), at(result.error_deg, 0.95),
      at(result.error_deg, 1.0), at(result.sigma_deg, 0.5),
      known == 0 ? 0.0 : 100.0 * static_cast<double>(result.within) / static_cast<double>(known));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Error of the estimated up against the truth of recordings, degrees");
  std::vector<std::string> recordings;
  std::vector<double> tilt_deg = {0.0, 0.0};
  app.add_option("RECORDING", recordings, "Folders of recordings")->required();
  app.add_option("--tilt", tilt_deg, "Roll and pitch by which all poses are turned, degrees")
      ->expected(2);
  CLI11_PARSE(app, argc, argv);
  std::printf("%-34s %4s %4s %6s %6s %6s %6s %6s %5s\n", "", "kf", "known", "odom.", "median",
              "95 %", "max", "sigma", "in 2s");
  Result all;
  for (const std::string& recording : recordings) {
    const Result result = run(recording, tilt_of(tilt_deg));
    print(std::filesystem::path(recording).lexically_normal().filename().string(), result);
    all.add(result);
  }
  print("all", std::move(all));
  return 0;
}
