// LiDAR simulator: procedural scenes, moving actors, seven LiDARs, drifting odometry.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "drive.hpp"
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

/// Pose of the first scan in the odometry frame.
enum class OdometryStart : std::uint8_t {
  kLevel,     ///< z against gravity, origin and yaw of the first scan: LiDAR-inertial odometry
  kIdentity,  ///< the first scan's frame, however it is tilted: LiDAR-only odometry
};

/// Frame of points and poses.
enum class PointFrame : std::uint8_t {
  kSensor,
  kBody,  ///< level on a level body, origin at the sensor: a tilted sensor's points are rotated
};

/// Parses "none", "lio", "icp" or "bad".
std::optional<DriftPreset> parse_drift(std::string_view name);
/// Parses "level" or "identity".
std::optional<OdometryStart> parse_odometry_start(std::string_view name);
/// Parses "sensor" or "body".
std::optional<PointFrame> parse_point_frame(std::string_view name);

/// Rotation of the sensor on the body (degrees): roll about its own x, then pitch about the body's
/// y, down positive.
struct Mount {
  double roll_deg = 0.0, pitch_deg = 0.0;
  [[nodiscard]] bool is_level() const { return roll_deg == 0.0 && pitch_deg == 0.0; }
};

/// Noise of roll and pitch in the odometry's poses, one sigma per axis; the first pose has none.
struct AttitudeNoise {
  double sigma_deg = 0.0;
  double correlated_s = 0.0;  ///< time over which it is correlated; 0: independent per scan
};

/// Rolling and pitching of the body, which the odometry follows.
struct Sway {
  double amplitude_deg = 0.0;
  double frequency_hz = 0.0;
};

struct SimulationConfig {
  /// "town": streets with traffic, seen from a car. "campus": halls, paths and a plaza full of
  /// pedestrians, some of whom walk with the robot; its sensor is 1 m above the ground.
  /// "deck": a parking deck with a ceiling of 2.5 to 3.5 m. "square": a dense crowd. "convoy": the
  /// town in stop-and-go traffic. "street": walkers beside walls that are first seen with them.
  /// "tunnel", "hall": closed all around. Two places that look alike, A and B in one of them, C in
  /// the other: "bore", "fixtures" (tunnels), "decks", "streets", "corridor", "courtyard",
  /// "quad", "orchard".
  std::string scene = "town";
  SensorKind sensor = SensorKind::kOs2_128;
  /// 'A', 'B' or 'C': tours through the same scene. A and B run the same way round, C against
  /// them; all three share their first round and return to it. Where two places look alike, C runs
  /// through the other one.
  char route = 'A';
  std::uint32_t scans = 300;  ///< at 10 Hz; 1..100000
  /// Seed of the scene and of everything derived from it: another seed is another town or campus.
  std::uint64_t seed = 1;
  /// Parked cars, actors and some furniture change from day to day; default: A 0, B 1, C 2.
  std::optional<std::uint32_t> day;
  DriftPreset drift = DriftPreset::kLio;
  Mount mount;  ///< angles within 45 degrees
  OdometryStart odometry_start = OdometryStart::kLevel;
  PointFrame points = PointFrame::kSensor;
  AttitudeNoise attitude_noise;  ///< up to 10 degrees, 60 s
  Sway sway;                     ///< up to 20 degrees, 5 Hz
  bool is_distorted = false;     ///< leaves the points in the sensor's frames of their own times
  Sampling sampling;             ///< spinning LiDARs only: 256..2048 columns, 8..128 rings
  std::uint32_t thin = 1;        ///< keeps every n-th column (spinning) or shot; 1..64
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; the output does not depend on it
};

/// Called after every finished scan, from one thread at a time.
using Progress = std::function<void(std::uint32_t done, std::uint32_t total)>;

/// Simulates a run into the folder `out` (made if missing):
/// - scans/NNNNNN.bin: float32 x y z intensity (0..1), in the frame that `points` names,
///   motion-compensated (unless `is_distorted`) to the scan's stamp, the end of its sweep;
/// - labels/NNNNNN.label: uint32, SemanticKITTI id in the lower half, object id in the upper;
///   moving ids (252...) for what moved faster than 0.2 m/s within three seconds; 1 for false
///   returns;
/// - poses.txt: drifting odometry of the points' frame, KITTI 3x4; it starts as `odometry_start`
///   says;
/// - gt_poses.txt: T_world_points, in the same world for all routes and days of a seed;
/// - motion.txt: object, first and last scan of every stretch of scans during which an object is
///   faster than 0.2 m/s;
/// - objects.txt: what stands in the scene, a line for each: label, centre of its box x y z
/// (metres,
///   in the world of gt_poses.txt), yaw (radians), length, width and height (metres);
/// - times.txt: stamps in seconds; dataset.json: the configuration.
/// Deterministic: the same configuration writes the same bytes, whatever `threads`.
/// `observer` gets, scan by scan, what the robot's drivers would publish: the points before the
/// motion was compensated, and the odometry at 100 Hz. What it throws ends the simulation.
/// Throws SimulationError; files written until then stay.
void simulate(const SimulationConfig& config, const std::filesystem::path& out,
              const Progress& progress = {}, const DriveObserver& observer = {});

}  // namespace unimapper::simulator
