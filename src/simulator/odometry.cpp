#include "odometry.hpp"

#include "random.hpp"

namespace unimapper::simulator {
namespace {

/// One sigma of every error source.
struct DriftFigures {
  double scale;     ///< slowly varying share of the distance
  double turn;      ///< slowly varying rotation, radians per metre and axis
  double walk_m;    ///< random walk, metres per root metre
  double walk_rad;  ///< random walk, radians per root metre
  double climb;     ///< slowly varying vertical share of the distance
  double jitter_m, jitter_rad;
  double gravity_pull;  ///< share of the tilt error that the accelerometer removes per scan
};

DriftFigures figures_of(DriftPreset preset) {
  switch (preset) {
    case DriftPreset::kLio:
      return {0.0015, 1.5e-5, 0.004, 5e-5, 0.0003, 0.006, 4e-4, 0.05};
    case DriftPreset::kIcp:
      return {0.004, 3.2e-5, 0.008, 8e-5, 0.001, 0.008, 5e-4, 0.0};
    case DriftPreset::kBad:
      return {0.012, 1.5e-4, 0.015, 2.5e-4, 0.006, 0.015, 1e-3, 0.01};
    case DriftPreset::kNone:
      break;
  }
  return {};
}

/// A mean-reverting random process over distance, stationary standard deviation one.
class Wander {
 public:
  explicit Wander(Random& random) : value_(random.gauss()) {}
  double advance(double distance, Random& random) {
    constexpr double kCorrelation = 120.0;  // metres
    const double keep = std::exp(-distance / kCorrelation);
    value_ = keep * value_ + std::sqrt(1.0 - keep * keep) * random.gauss();
    return value_;
  }

 private:
  double value_;
};

/// Rotates `pose` so that its estimate of the vertical approaches the true one.
void pull_to_gravity(Frame& pose, const Frame& truth, double share) {
  const Vec3 estimated{pose.x.z, pose.y.z, pose.z.z};  // up, seen from the sensor
  const Vec3 actual{truth.x.z, truth.y.z, truth.z.z};
  const Vec3 origin = pose.origin;
  pose = pose * rotation_frame(share * cross(actual, estimated));
  pose.origin = origin;
}

Frame levelled_start(const Frame& first) {
  Frame start = upright_frame(first.origin, {first.x.x, first.x.y});
  return start;
}

}  // namespace

std::vector<Frame> drifting_odometry(const std::vector<Frame>& T_town_sensor, DriftPreset preset,
                                     std::uint64_t key) {
  const DriftFigures figures = figures_of(preset);
  Random random(key);
  Wander scale(random);
  Wander climb(random);
  Wander turn[3] = {Wander(random), Wander(random), Wander(random)};
  std::vector<Frame> poses;
  if (T_town_sensor.empty()) return poses;
  poses.reserve(T_town_sensor.size());
  const Frame T_odometry_town = levelled_start(T_town_sensor.front()).inverse();
  Frame estimate = T_odometry_town * T_town_sensor.front();
  poses.push_back(estimate);
  for (std::size_t i = 1; i < T_town_sensor.size(); ++i) {
    const Frame truth = T_odometry_town * T_town_sensor[i];
    if (preset == DriftPreset::kNone) {
      poses.push_back(truth);
      continue;
    }
    Frame step = T_town_sensor[i - 1].inverse() * T_town_sensor[i];
    const double distance = norm(step.origin);
    const double root = std::sqrt(distance);
    const double stretch = 1.0 + figures.scale * scale.advance(distance, random);
    const auto noise = [&](double sigma) { return sigma * root * random.gauss(); };
    Vec3 rotation;
    rotation.x = figures.turn * distance * turn[0].advance(distance, random);
    rotation.y = figures.turn * distance * turn[1].advance(distance, random);
    rotation.z = figures.turn * distance * turn[2].advance(distance, random);
    rotation.x += noise(figures.walk_rad);
    rotation.y += noise(figures.walk_rad);
    rotation.z += noise(figures.walk_rad);
    Vec3 moved = stretch * step.origin;
    moved.x += noise(figures.walk_m);
    moved.y += noise(figures.walk_m);
    moved.z += noise(figures.walk_m) + figures.climb * distance * climb.advance(distance, random);
    step = step * rotation_frame(rotation);
    step.origin = moved;
    estimate = orthonormalized(estimate * step);
    pull_to_gravity(estimate, truth, figures.gravity_pull);
    Frame jitter =
        rotation_frame({figures.jitter_rad * random.gauss(), figures.jitter_rad * random.gauss(),
                        figures.jitter_rad * random.gauss()});
    jitter.origin = {figures.jitter_m * random.gauss(), figures.jitter_m * random.gauss(),
                     figures.jitter_m * random.gauss()};
    poses.push_back(orthonormalized(estimate * jitter));
  }
  return poses;
}

void start_at_identity(std::vector<Frame>& poses) {
  if (poses.empty()) return;
  const Frame T_first_odometry = poses.front().inverse();
  for (Frame& pose : poses) pose = orthonormalized(T_first_odometry * pose);
}

}  // namespace unimapper::simulator
