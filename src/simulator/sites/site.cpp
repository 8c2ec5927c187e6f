#include "site.hpp"

#include <algorithm>

namespace unimapper::simulator::sites {
namespace {

constexpr double kRobotTick = 0.05;

}  // namespace

double Plan::height(Vec2 at) const {
  const double w = std::clamp((at.x - ramp_from) / (ramp_to - ramp_from), 0.0, 1.0);
  return rise_m * w * w * (3.0 - 2.0 * w);
}

Vec3 Plan::up(Vec2 at) const {
  const double w = std::clamp((at.x - ramp_from) / (ramp_to - ramp_from), 0.0, 1.0);
  const double slope = rise_m * 6.0 * w * (1.0 - w) / (ramp_to - ramp_from);
  return normalized(Vec3{-slope, 0.0, 1.0});
}

void Plan::set_tours(const Path& loop, double start_a, double start_b, double start_c) {
  tours = {loop, loop, loop.reversed()};
  starts = {start_a, start_b, start_c};
}

void Site::sheet(Vec2 low, Vec2 high, double lift, Surface surface) {
  constexpr double kStep = 2.0;
  const int parts =
      plan.rise_m == 0.0 ? 1 : std::max(1, static_cast<int>(std::ceil((high.x - low.x) / kStep)));
  for (int i = 0; i < parts; ++i) {
    const double x0 = low.x + (high.x - low.x) * i / parts;
    const double x1 = low.x + (high.x - low.x) * (i + 1) / parts;
    mesh.quad(plan.ground({x0, low.y}, lift), plan.ground({x1, low.y}, lift),
              plan.ground({x1, high.y}, lift), plan.ground({x0, high.y}, lift), surface);
  }
}

void Site::block(Vec2 low, Vec2 high, double low_lift, double high_lift, Surface surface) {
  sheet(low, high, low_lift, surface);
  sheet(low, high, high_lift, surface);
  const auto wall = [&](Vec2 from, Vec2 to) {
    const int parts = plan.rise_m == 0.0 ? 1 : std::max(1, static_cast<int>(norm(to - from) / 2.0));
    for (int i = 0; i < parts; ++i) {
      const Vec2 a = from + (static_cast<double>(i) / parts) * (to - from);
      const Vec2 b = from + (static_cast<double>(i + 1) / parts) * (to - from);
      mesh.quad(plan.ground(a, low_lift), plan.ground(b, low_lift), plan.ground(b, high_lift),
                plan.ground(a, high_lift), surface);
    }
  };
  wall(low, {high.x, low.y});
  wall({low.x, high.y}, high);
  wall(low, {low.x, high.y});
  wall({high.x, low.y}, high);
}

void Site::place(PrototypeRange range, std::uint32_t variant, Vec2 at, double turn,
                 std::uint16_t label, std::uint16_t object, double scale) {
  const Vec2 heading{std::cos(turn), std::sin(turn)};
  instances.push_back({range.first + variant % range.count,
                       sloped_frame(plan.ground(at), heading, plan.up(at)), scale, label, object});
}

Robot::Robot(const Plan& plan, char route, std::uint64_t key, double duration_s)
    : plan_(plan),
      path_(plan.tours[static_cast<std::size_t>(route - 'A')]),
      duration_s_(duration_s) {
  const RobotStyle& style = plan.robot;
  Random random(key, Stream::kMotion, static_cast<std::uint64_t>(route));
  for (double& phase : phases_) phase = random.uniform(0.0, 2.0 * kPi);
  std::vector<double> wish(static_cast<std::size_t>(path_.length() / Path::kStep), style.speed_m_s);
  const std::vector<double> limit = drivable_speed(path_, std::move(wish));
  const auto limit_at = [&](double s) {
    const double wrapped = s - path_.length() * std::floor(s / path_.length());
    return limit[std::min(static_cast<std::size_t>(wrapped / Path::kStep), limit.size() - 1)];
  };
  double s = plan.starts[static_cast<std::size_t>(route - 'A')];
  for (double t = 0.0; t < kLead; t += kRobotTick) s -= kRobotTick * limit_at(s);
  double speed = limit_at(s);
  const double every = style.stop_every_s;
  double stop_at = every > 0.0 ? random.uniform(0.3, 1.5) * every : 1e18;
  double go_at = stop_at + random.uniform(3.0, 8.0);
  const auto ticks = static_cast<std::size_t>((duration_s + 2.0 * kLead) / kRobotTick) + 2;
  travelled_.reserve(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    travelled_.push_back(s);
    const double t = kRobotTick * static_cast<double>(i) - kLead;
    if (t > go_at) {
      stop_at = t + random.uniform(0.5, 1.5) * every;
      go_at = stop_at + random.uniform(3.0, 8.0);
    }
    const double goal = t > stop_at ? 0.0 : limit_at(s);
    const double step = style.acceleration * kRobotTick;
    speed = std::min(speed + std::clamp(goal - speed, -step, step), limit_at(s));
    s += kRobotTick * speed;
  }
}

double Robot::travelled(double time_s) const {
  return interpolate(travelled_, (time_s + kLead) / kRobotTick);
}

double Robot::speed(double time_s) const {
  return (travelled(time_s + kRobotTick) - travelled(time_s - kRobotTick)) / (2.0 * kRobotTick);
}

Frame Robot::sensor_frame(double time_s) const {
  const RobotStyle& style = plan_.robot;
  const double s = travelled(time_s);
  const Vec2 at = path_.at(s);
  const Frame ground = sloped_frame(plan_.ground(at), path_.heading(s), plan_.up(at));
  const double strength = std::clamp(speed(time_s) / style.speed_m_s, 0.0, 1.0);
  const double amplitude = strength * style.wobble_deg * kDegree;
  const double turn = 2.0 * kPi * style.wobble_hz * time_s;
  Frame body = rotation_frame({amplitude * std::sin(turn + phases_[0]),
                               amplitude * std::sin(0.7 * turn + phases_[1]), 0.0});
  body.origin = {0.0, 0.0, style.sensor_height_m};
  return ground * body;
}

double Robot::passes(Vec2 point, double reach) const {
  constexpr double kStep = 0.05;
  double nearest = reach;
  double when = -1.0;
  for (double t = 0.0; t < duration_s_; t += kStep) {
    const double distance = norm(at(t) - point);
    if (distance < nearest) {
      nearest = distance;
      when = t;
    } else if (when >= 0.0 && distance > nearest + 3.0) {
      break;  // the first of several passes
    }
  }
  return when;
}

std::size_t tick_count(double duration_s) {
  return static_cast<std::size_t>((duration_s + 2.0 * Actors::kWarmUp) / Actors::kTick) + 2;
}

}  // namespace unimapper::simulator::sites
