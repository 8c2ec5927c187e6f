#include "robot_motion.hpp"

#include <algorithm>
#include <span>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

constexpr double kTick = 0.05;
constexpr double kMountHeight = 1.9;

/// Closed tours of crossings. A and B drive around the same central block in the same direction,
/// C the other way round; each comes back to its first street after one block and then goes on
/// through the neighbouring ones.
constexpr Node kTourA[] = {{3, 3}, {4, 3}, {4, 4}, {3, 4}, {3, 3}, {4, 3}, {5, 3},
                           {5, 4}, {4, 4}, {4, 3}, {4, 2}, {3, 2}, {3, 3}, {3, 4},
                           {3, 5}, {4, 5}, {4, 4}, {3, 4}, {2, 4}, {2, 3}};
constexpr Node kTourB[] = {{4, 2}, {4, 3}, {4, 4}, {3, 4}, {3, 3}, {4, 3}, {4, 4},
                           {5, 4}, {5, 3}, {4, 3}, {3, 3}, {3, 4}, {4, 4}, {4, 5},
                           {3, 5}, {2, 5}, {2, 4}, {2, 3}, {2, 2}, {3, 2}};
constexpr Node kTourC[] = {{3, 4}, {4, 4}, {4, 3}, {3, 3}, {3, 4}, {4, 4}, {5, 4}, {5, 3},
                           {5, 2}, {4, 2}, {4, 3}, {4, 4}, {3, 4}, {3, 3}, {2, 3}, {2, 4}};

struct Tour {
  std::span<const Node> nodes;
  double start_fraction;  ///< of the first street
};

Tour tour_of(char route) {
  if (route == 'A') return {kTourA, 0.2};
  if (route == 'B') return {kTourB, 0.55};
  return {kTourC, 0.3};
}

/// Cruise speed of about 7.7 m/s with slow variations.
std::vector<double> cruise_profile(const Path& path, Random& random) {
  const double phase = random.uniform(0.0, 2.0 * kPi);
  std::vector<double> wish(static_cast<std::size_t>(path.length() / Path::kStep));
  for (std::size_t i = 0; i < wish.size(); ++i) {
    wish[i] = 7.7 + 0.9 * std::sin(Path::kStep * static_cast<double>(i) / 37.0 + phase);
  }
  return wish;
}

/// Speed in traffic that stops for 3 to 20 s after every 5 to 15 s of driving.
class StopAndGo {
 public:
  StopAndGo(std::uint64_t seed, char route)
      : random_(seed, Stream::kMotion, static_cast<std::uint64_t>(route), 1),
        brakes_at_(random_.uniform(0.0, 3.0)) {}

  /// To be called once a tick with the speed that the road allows.
  double speed(double time_s, double allowed) {
    constexpr double kAcceleration = 1.5;
    constexpr double kBraking = 2.2;
    const bool brakes = time_s > brakes_at_;
    const double wish = brakes ? 0.0 : allowed;
    speed_ += std::clamp(wish - speed_, -kBraking * kTick, kAcceleration * kTick);
    speed_ = std::min(speed_, allowed);
    if (brakes && speed_ <= 0.0) {
      if (goes_at_ < brakes_at_) {
        // The first stop is short: a recording of ten seconds shall hold what follows it.
        goes_at_ = time_s + random_.uniform(3.0, is_first_ ? 5.0 : 20.0);
        is_first_ = false;
      } else if (time_s > goes_at_) {
        brakes_at_ = time_s + random_.uniform(5.0, 15.0);
      }
    }
    return speed_;
  }

 private:
  Random random_;
  double brakes_at_;
  double goes_at_ = -1e9;
  double speed_ = 0.0;
  bool is_first_ = true;
};

}  // namespace

RobotMotion::RobotMotion(const TownPlan& plan, char route, std::uint64_t seed, double duration_s,
                         bool stops_and_goes)
    : plan_(plan),
      path_(lane_path(plan, tour_of(route).nodes, true, street::kLaneCentre)),
      stops_and_goes_(stops_and_goes) {
  Random random(seed, Stream::kMotion, static_cast<std::uint64_t>(route));
  for (double& phase : phases_) phase = random.uniform(0.0, 2.0 * kPi);
  const std::vector<double> profile = drivable_speed(path_, cruise_profile(path_, random));
  const auto speed_at = [&](double s) {
    const double wrapped = s - path_.length() * std::floor(s / path_.length());
    return profile[std::min(static_cast<std::size_t>(wrapped / Path::kStep), profile.size() - 1)];
  };
  const Tour tour = tour_of(route);
  const Vec2 a = plan.warp({plan.line_u(tour.nodes[0].i), plan.line_v(tour.nodes[0].j)});
  const Vec2 b = plan.warp({plan.line_u(tour.nodes[1].i), plan.line_v(tour.nodes[1].j)});
  // The path starts just past the first crossing.
  double s = tour.start_fraction * norm(b - a) - 10.0;
  for (double t = 0.0; t < kLead; t += kTick) s -= kTick * speed_at(s);
  StopAndGo traffic(seed, route);
  const auto ticks = static_cast<std::size_t>((duration_s + 2.0 * kLead) / kTick) + 2;
  travelled_.reserve(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    travelled_.push_back(s);
    const double t = kTick * static_cast<double>(i) - kLead;
    s += kTick * (stops_and_goes ? traffic.speed(t, speed_at(s)) : speed_at(s));
  }
}

double RobotMotion::travelled(double time_s) const {
  return interpolate(travelled_, (time_s + kLead) / kTick);
}

double RobotMotion::speed(double time_s) const {
  return (travelled(time_s + kTick) - travelled(time_s - kTick)) / (2.0 * kTick);
}

Frame RobotMotion::sensor_frame(double time_s) const {
  const double s = travelled(time_s);
  const Vec2 at = path_.at(s);
  const Frame road = sloped_frame({at.x, at.y, plan_.height(at)}, path_.heading(s), plan_.up(at));
  // Body vibration: fractions of a degree and a centimetre at 1.3 to 3.1 Hz, more when faster.
  const double strength = std::min(1.0, speed(time_s) / 6.0);
  const auto swing = [&](int i, double hertz) {
    return std::sin(2.0 * kPi * hertz * time_s + phases_[i]);
  };
  const double roll = 0.25 * kDegree * (0.6 * swing(0, 1.3) + 0.4 * swing(1, 2.3));
  const double pitch = 0.25 * kDegree * (0.6 * swing(2, 1.7) + 0.4 * swing(3, 3.1));
  const double heave = 0.008 * (0.7 * swing(4, 1.5) + 0.3 * swing(5, 2.7));
  Frame body = rotation_frame({strength * roll, strength * pitch, 0.0});
  body.origin = {0, 0, kMountHeight + strength * heave};
  return road * body;
}

}  // namespace unimapper::simulator
