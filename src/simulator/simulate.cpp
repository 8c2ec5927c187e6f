#include "simulate.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "attitude.hpp"
#include "drive.hpp"
#include "odometry.hpp"
#include "random.hpp"
#include "run_writer.hpp"
#include "scanner.hpp"
#include "scene.hpp"

namespace unimapper::simulator {
namespace {

void check_sampling(const SimulationConfig& config) {
  const Sampling& sampling = config.sampling;
  if (!sampling.is_own() && !is_spinning(config.sensor)) {
    throw SimulationError("columns and rings are those of a spinning LiDAR; the " +
                          std::string(sensor_model(config.sensor).name) +
                          " has a scan pattern of its own");
  }
  if (sampling.columns != 0 && (sampling.columns < 256 || sampling.columns > 2048)) {
    throw SimulationError("the number of columns must be 256 to 2048");
  }
  if (sampling.rings != 0 && (sampling.rings < 8 || sampling.rings > 128)) {
    throw SimulationError("the number of rings must be 8 to 128");
  }
}

void check_attitude(const SimulationConfig& config) {
  const auto require = [](bool holds, const char* message) {
    if (!holds) throw SimulationError(message);
  };
  constexpr double kMostTilt = 45.0;
  require(
      std::abs(config.mount.roll_deg) <= kMostTilt && std::abs(config.mount.pitch_deg) <= kMostTilt,
      "the mount's roll and pitch must be within 45 degrees");
  const AttitudeNoise& noise = config.attitude_noise;
  require(noise.sigma_deg >= 0.0 && noise.sigma_deg <= 10.0,
          "the attitude noise must be 0 to 10 degrees");
  require(noise.correlated_s >= 0.0 && noise.correlated_s <= 60.0,
          "the attitude noise must be correlated over 0 to 60 seconds");
  const Sway& sway = config.sway;
  require(sway.amplitude_deg >= 0.0 && sway.amplitude_deg <= 20.0, "sway must be 0 to 20 degrees");
  require(sway.amplitude_deg == 0.0 || (sway.frequency_hz > 0.0 && sway.frequency_hz <= 5.0),
          "sway must have a frequency of at most 5 Hz");
}

void check(const SimulationConfig& config) {
  if (!is_scene(config.scene)) {
    throw SimulationError("unknown scene '" + config.scene + "'; there are: " + scene_names());
  }
  if (config.route < 'A' || config.route > 'C') {
    throw SimulationError(std::string("unknown route '") + config.route + "'; there are: A, B, C");
  }
  if (config.scans < 1 || config.scans > 100000) {
    throw SimulationError("the number of scans must be 1 to 100000");
  }
  if (config.thin < 1 || config.thin > 64) {
    throw SimulationError("thinning must be 1 to 64");
  }
  check_sampling(config);
  check_attitude(config);
}

double stamp_of(std::uint32_t scan) { return kSweepSeconds * (scan + 1); }

constexpr std::int64_t kSweepNanoseconds = 100'000'000;
std::int64_t stamp_ns_of(std::uint32_t scan) { return kSweepNanoseconds * (scan + 1); }

/// Hands on what comes in any order in the order of the scans.
class StepQueue {
 public:
  explicit StepQueue(const DriveObserver& observer) : observer_(observer) {}

  void add(DriveStep step) {
    const std::lock_guard lock(mutex_);
    const std::uint32_t scan = step.scan;
    waiting_.emplace(scan, std::move(step));
    for (auto next = waiting_.begin(); next != waiting_.end() && next->first == due_;
         next = waiting_.erase(next), ++due_) {
      observer_(next->second);
    }
  }

 private:
  const DriveObserver& observer_;
  std::mutex mutex_;
  std::map<std::uint32_t, DriveStep> waiting_;
  std::uint32_t due_ = 0;
};

/// State shared by the threads that simulate scans.
class Run {
 public:
  Run(const SimulationConfig& config, std::uint32_t day, const std::filesystem::path& out,
      const DriveObserver& observer)
      : config_(config),
        observer_(observer),
        steps_(observer),
        model_(checked_model(config.sensor)),
        writer_(out),
        scene_(make_scene(config.scene, {config.seed, day, config.route, stamp_of(config.scans)})),
        standing_(scene_->world()),
        key_(Random(config.seed, Stream::kRay, static_cast<std::uint64_t>(config.route),
                    day * 16ULL + static_cast<std::uint64_t>(config.sensor))
                 .bits()),
        sway_(config.sway, derive_key(key_, 0x5BA7)),
        T_body_sensor_(mount_frame(config.mount)),
        T_points_sensor_(config.points == PointFrame::kBody ? T_body_sensor_ : Frame{}) {}

  void write_trajectory(std::uint32_t day) {
    std::vector<Frame> truth;
    std::vector<double> stamps;
    for (std::uint32_t scan = 0; scan < config_.scans; ++scan) {
      stamps.push_back(stamp_of(scan));
      truth.push_back(sensor_frame(stamps.back()) * T_points_sensor_.inverse());
    }
    std::vector<Frame> odometry =
        drifting_odometry(truth, config_.drift, derive_key(key_, 0xD41F7));
    add_attitude_noise(config_.attitude_noise, kSweepSeconds,
                       T_body_sensor_ * T_points_sensor_.inverse(), derive_key(key_, 0xA771),
                       odometry);
    if (config_.odometry_start == OdometryStart::kIdentity) start_at_identity(odometry);
    writer_.write_times(stamps);
    writer_.write_motions(scene_->motions(stamps));
    writer_.write_objects(scene_->world());
    writer_.write_poses("gt_poses.txt", truth);
    writer_.write_poses("poses.txt", odometry);
    writer_.write_description(config_, day, 100);
    odometry_ = ContinuousOdometry(std::move(truth), std::move(odometry), kSweepSeconds);
  }

  /// Worker loop: simulates scans until none is left.
  void work(const Progress& progress) {
    MovingScene moving(standing_);
    const Caster caster(standing_, moving);
    Scanner scanner(model_, caster, key_);
    std::vector<PatternRay> rays;
    if (repeats(config_.sensor)) {
      make_pattern(config_.sensor, 0.0, config_.thin, rays, config_.sampling);
    }
    std::vector<LidarReturn> returns;
    for (std::uint32_t scan = next_++; scan < config_.scans && !failed_; scan = next_++) {
      const double end = stamp_of(scan);
      const double begin = end - kSweepSeconds;
      if (!repeats(config_.sensor)) make_pattern(config_.sensor, begin, config_.thin, rays);
      const SweepFrames frames = sweep_frames(begin);
      const Vec3 here = frames.back().origin;
      moving.set(scene_->during(begin, end, {here.x, here.y}));
      returns.clear();
      scanner.scan(scan, rays, frames, returns);
      if (observer_) steps_.add(drive_step(scan, returns));
      if (!config_.is_distorted) compensate_motion(scan, frames, returns);
      if (config_.points == PointFrame::kBody) {
        for (LidarReturn& r : returns) r.point = T_points_sensor_(r.point);
      }
      writer_.write_scan(scan, returns);
      const std::lock_guard lock(progress_mutex_);
      ++done_;
      if (progress) progress(done_, config_.scans);
    }
  }

  void stop() { failed_ = true; }

 private:
  static LidarModel checked_model(SensorKind kind) {
    try {
      return lidar_model(kind);
    } catch (const std::runtime_error& error) {
      throw SimulationError(error.what());
    }
  }

  /// T_world_sensor as mounted on the body as it sways.
  [[nodiscard]] Frame sensor_frame(double time_s) const {
    return scene_->sensor_frame(time_s) * sway_.at(time_s) * T_body_sensor_;
  }

  /// A sample every 10 ms. None is at time zero, which ROS takes for no time.
  [[nodiscard]] std::vector<OdometrySample> odometry_during(std::uint32_t scan) const {
    constexpr std::int64_t kInterval_ns = 10'000'000;
    constexpr std::int64_t kFirst_ns = 1'000'000;
    std::vector<OdometrySample> samples;
    const std::int64_t end_ns = stamp_ns_of(scan);
    const auto add = [&](std::int64_t stamp_ns) {
      const double time_s = 1e-9 * static_cast<double>(stamp_ns);
      const Frame truth = sensor_frame(time_s) * T_points_sensor_.inverse();
      samples.push_back({stamp_ns, odometry_.at(time_s, truth), truth});
    };
    if (scan == 0) add(kFirst_ns);
    for (std::int64_t ns = end_ns - kSweepNanoseconds + kInterval_ns; ns <= end_ns;
         ns += kInterval_ns) {
      add(ns);
    }
    return samples;
  }

  /// What drivers would publish, from returns whose motion is not compensated.
  [[nodiscard]] DriveStep drive_step(std::uint32_t scan,
                                     const std::vector<LidarReturn>& returns) const {
    DriveStep step{scan, stamp_ns_of(scan), {}, odometry_during(scan)};
    step.points.reserve(returns.size());
    for (const LidarReturn& r : returns) {
      const Vec3 point = T_points_sensor_(r.point);
      step.points.push_back({static_cast<float>(point.x), static_cast<float>(point.y),
                             static_cast<float>(point.z), r.intensity, r.ring,
                             static_cast<float>(kSweepSeconds * (r.time - 1.0))});
    }
    return step;
  }

  [[nodiscard]] SweepFrames sweep_frames(double begin) const {
    constexpr int kParts = 10;
    SweepFrames frames;
    for (int i = 0; i <= kParts; ++i) {
      frames.push_back(sensor_frame(begin + kSweepSeconds * i / kParts));
    }
    return frames;
  }

  /// Moves every return to where the sensor is at the end of the sweep, as an odometry would: with
  /// a velocity that is wrong by about 1.5 %.
  void compensate_motion(std::uint32_t scan, const SweepFrames& frames,
                         std::vector<LidarReturn>& returns) const {
    constexpr double kVelocityError = 0.015;
    Random random(derive_key(derive_key(key_, 0xDE5C), scan));
    const double stretch = 1.0 + kVelocityError * random.gauss();
    const double twist = 1.0 + kVelocityError * random.gauss();
    const Frame T_end_world = frames.back().inverse();
    std::vector<Frame> T_end_part;
    for (const Frame& frame : frames) {
      Frame step = T_end_world * frame;
      Frame estimated = rotation_frame(twist * rotation_vector(step));
      estimated.origin = stretch * step.origin;
      T_end_part.push_back(estimated);
    }
    float last_time = -1.0F;
    Frame at_shot;
    for (LidarReturn& r : returns) {
      if (r.time != last_time) at_shot = interpolate(T_end_part, r.time);
      last_time = r.time;
      r.point = at_shot(r.point);
    }
  }

  const SimulationConfig& config_;
  const DriveObserver& observer_;
  StepQueue steps_;
  LidarModel model_;
  RunWriter writer_;  // before the scene: an unwritable folder is reported at once
  std::unique_ptr<Scene> scene_;
  StaticScene standing_;
  std::uint64_t key_;
  SwayingBody sway_;
  Frame T_body_sensor_;
  Frame T_points_sensor_;
  ContinuousOdometry odometry_;
  std::atomic<std::uint32_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex progress_mutex_;
  std::uint32_t done_ = 0;
};

}  // namespace

std::optional<DriftPreset> parse_drift(std::string_view name) {
  if (name == "none") return DriftPreset::kNone;
  if (name == "lio") return DriftPreset::kLio;
  if (name == "icp") return DriftPreset::kIcp;
  if (name == "bad") return DriftPreset::kBad;
  return std::nullopt;
}

std::optional<OdometryStart> parse_odometry_start(std::string_view name) {
  if (name == "level") return OdometryStart::kLevel;
  if (name == "identity") return OdometryStart::kIdentity;
  return std::nullopt;
}

std::optional<PointFrame> parse_point_frame(std::string_view name) {
  if (name == "sensor") return PointFrame::kSensor;
  if (name == "body") return PointFrame::kBody;
  return std::nullopt;
}

void simulate(const SimulationConfig& config, const std::filesystem::path& out,
              const Progress& progress, const DriveObserver& observer) {
  check(config);
  const std::uint32_t day = config.day.value_or(static_cast<std::uint32_t>(config.route - 'A'));
  Run run(config, day, out, observer);
  run.write_trajectory(day);
  const unsigned available = std::max(1U, std::thread::hardware_concurrency());
  const unsigned count =
      std::min({config.threads == 0 ? available : config.threads, config.scans, 256U});
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto body = [&] {
    try {
      run.work(progress);
    } catch (...) {
      run.stop();
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> workers;
    for (unsigned i = 1; i < count; ++i) workers.emplace_back(body);
    body();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace unimapper::simulator
