// LiDAR simulator: procedural scenes, moving actors, seven LiDARs, drifting odometry.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "lidar.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::simulator {

/// The run cannot be simulated or written; the message says why.
class SimulationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How much the odometry drifts over 100 m (translation, rotation).
enum class DriftPreset : std::uint8_t {
  kNone,  ///< perfect poses
  kLio,   ///< 0.2-0.3 %, 0.1 deg: LiDAR-inertial odometry, roll and pitch held by gravity
  kIcp,   ///< 0.5-0.6 %, 0.2-0.3 deg: scan matching alone
  kBad,   ///< 1.5 %, 1 deg, and a wrong climb
};

/// Parses "none", "lio", "icp" or "bad".
std::optional<DriftPreset> parse_drift(std::string_view name);

struct SimulationConfig {
  /// "town": streets with traffic, seen from a car. "campus": halls, paths and a plaza full of
  /// pedestrians, some of whom walk with the robot; its sensor is 1 m above the ground.
  std::string scene = "town";
  SensorKind sensor = SensorKind::kOs2_128;
  /// 'A', 'B' or 'C': tours through the same scene. A and B run the same way round, C against
  /// them; all three share their first round and return to it.
  char route = 'A';
  std::uint32_t scans = 300;  ///< at 10 Hz; 1..100000
  /// Seed of the scene and of everything derived from it: another seed is another town or campus.
  std::uint64_t seed = 1;
  /// Parked cars, actors and some furniture change from day to day; default: A 0, B 1, C 2.
  std::optional<std::uint32_t> day;
  DriftPreset drift = DriftPreset::kLio;
  Sampling sampling;          ///< spinning LiDARs only: 256..2048 columns, 8..128 rings
  std::uint32_t thin = 1;     ///< keeps every n-th column (spinning) or shot; 1..64
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; the output does not depend on it
};

/// Called after every finished scan, from one thread at a time.
using Progress = std::function<void(std::uint32_t done, std::uint32_t total)>;

/// Simulates a run into the folder `out` (made if missing):
/// - scans/NNNNNN.bin: float32 x y z intensity (0..1), sensor frame, motion-compensated to the
///   scan's stamp, which is the end of its sweep;
/// - labels/NNNNNN.label: uint32, SemanticKITTI id in the lower half, object id in the upper;
///   moving ids (252...) for what moved faster than 0.2 m/s within three seconds; 1 for false
///   returns;
/// - poses.txt: drifting odometry, T_odometry_sensor, KITTI 3x4; the frame is gravity-aligned, with
///   its origin at the first sensor position and without the first pose's yaw;
/// - gt_poses.txt: T_world_sensor, in the same frame for all routes and days of a seed;
/// - times.txt: stamps in seconds; dataset.json: the configuration.
/// Deterministic: the same configuration writes the same bytes, whatever `threads`.
/// Throws SimulationError; files written until then stay.
void simulate(const SimulationConfig& config, const std::filesystem::path& out,
              const Progress& progress = {});

}  // namespace unimapper::simulator
