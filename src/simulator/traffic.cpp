#include "traffic.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kStopLine = 11.0;    // metres before the middle of a crossing
constexpr double kCrossingEnd = 9.0;  // metres behind it
constexpr double kLookAhead = 30.0;

double half_length(ActorKind kind) {
  switch (kind) {
    case ActorKind::kBus:
      return 5.8;
    case ActorKind::kVan:
      return 2.8;
    case ActorKind::kCyclist:
      return 0.9;
    default:
      return 2.3;
  }
}

double half_width(ActorKind kind) {
  switch (kind) {
    case ActorKind::kBus:
      return 1.3;
    case ActorKind::kVan:
      return 1.2;
    case ActorKind::kCyclist:
      return 0.35;
    default:
      return 1.0;
  }
}

}  // namespace

/// A crossing on a vehicle's closed path.
struct CrossingPass {
  double at;  ///< arc length of its middle
  std::size_t crossing;
};

struct Traffic::Vehicle {
  Actor actor;
  std::vector<double> speed_limit;  // every half metre
  std::vector<CrossingPass> crossings;
  double at = 0.0, speed = 0.0;
  double stopped_until = -kNever;
  int holds = -1;  // crossing it may drive over
  double releases_at = 0.0;
};

/// Obstacle for a driver: a point on the road.
struct Traffic::Obstacle {
  Vec2 position, velocity;
  std::size_t owner;  // index of the vehicle it belongs to, or a huge number
};

namespace {

/// In stop-and-go traffic cars close up to a few metres while they stand.
Convoy convoy_of(const RobotMotion& robot, std::uint32_t day) {
  const double phase = 1.0 + 1.3 * day;
  if (robot.stops_and_goes()) return {robot, 1.3, 1.4, phase, 7.0};
  return {robot, 2.6 + 0.2 * (day % 3), 2.9 - 0.2 * (day % 3), phase};
}

}  // namespace

Traffic::Traffic(const TownPlan& plan, const RobotMotion& robot, std::uint64_t seed,
                 std::uint32_t day, double duration_s)
    : plan_(plan),
      ticks_(static_cast<std::size_t>((duration_s + 2.0 * Actors::kWarmUp) / Actors::kTick) + 2),
      convoy_(convoy_of(robot, day)),
      crossing_holder_(static_cast<std::size_t>(TownPlan::kLines * TownPlan::kLines), -1) {
  Random random(seed, Stream::kTraffic, day);
  add_convoy(random);
  add_persons(seed, day);
  remove_colliding_persons();
  add_vehicles(random);
}

/// The vehicles ahead of and behind the robot pass through exactly the space that it drives
/// through: the hardest case for free-space reasoning.
void Traffic::add_convoy(Random& random) {
  for (const int vehicle : {1, 2}) {
    Actor actor;
    actor.kind = ActorKind::kCar;
    actor.variant = random.index(9);
    actor.path = &convoy_.path();
    for (std::size_t tick = 0; tick < ticks_; ++tick) {
      actor.travelled.push_back(
          static_cast<float>(convoy_.travelled(vehicle, Actors::time_of(tick))));
    }
    actors_.push_back(std::move(actor));
  }
}

Traffic::Vehicle Traffic::random_vehicle(ActorKind kind, Random& random) {
  // Around a rectangle of one to three blocks either way.
  const int lines = TownPlan::kLines;
  const int du = 1 + static_cast<int>(random.index(3));
  const int dv = 1 + static_cast<int>(random.index(3));
  const int i0 = static_cast<int>(random.index(static_cast<std::uint32_t>(lines - du)));
  const int j0 = static_cast<int>(random.index(static_cast<std::uint32_t>(lines - dv)));
  std::vector<Node> nodes;
  for (int i = i0; i < i0 + du; ++i) nodes.push_back({i, j0});
  for (int j = j0; j < j0 + dv; ++j) nodes.push_back({i0 + du, j});
  for (int i = i0 + du; i > i0; --i) nodes.push_back({i, j0 + dv});
  for (int j = j0 + dv; j > j0; --j) nodes.push_back({i0, j});
  if (random.chance(0.5)) std::reverse(nodes.begin(), nodes.end());
  const bool is_cyclist = kind == ActorKind::kCyclist;
  paths_.push_back(
      lane_path(plan_, nodes, true, is_cyclist ? street::kCyclePath : street::kLaneCentre));
  Vehicle vehicle;
  vehicle.actor.kind = kind;
  vehicle.actor.variant = random.index(18);
  vehicle.actor.path = &paths_.back();
  const Path& path = paths_.back();
  for (const Node node : nodes) {
    vehicle.crossings.push_back(
        {path.nearest(plan_.warp({plan_.line_u(node.i), plan_.line_v(node.j)})),
         static_cast<std::size_t>(node.i * lines + node.j)});
  }
  const double cruise = is_cyclist ? random.uniform(3.8, 5.5) : random.uniform(6.5, 9.5);
  vehicle.speed_limit = drivable_speed(
      path, std::vector<double>(static_cast<std::size_t>(path.length() / Path::kStep), cruise));
  vehicle.at = random.uniform(0.0, path.length());
  vehicle.speed = 0.5 * cruise;
  return vehicle;
}

void Traffic::add_vehicles(Random& random) {
  struct Fleet {
    ActorKind kind;
    int count;
  };
  static constexpr std::array kFleets{Fleet{ActorKind::kCar, 90}, Fleet{ActorKind::kVan, 9},
                                      Fleet{ActorKind::kBus, 5}, Fleet{ActorKind::kCyclist, 24}};
  std::vector<Vehicle> vehicles;
  for (const Fleet& fleet : kFleets) {
    for (int i = 0; i < fleet.count; ++i) {
      Vehicle vehicle = random_vehicle(fleet.kind, random);
      const Vec2 here = vehicle.actor.path->at(vehicle.at);
      const bool is_free = std::all_of(vehicles.begin(), vehicles.end(), [&](const Vehicle& v) {
        return norm(v.actor.path->at(v.at) - here) > 12.0;
      });
      // No vehicle starts on a crossing.
      const bool is_clear = std::all_of(
          vehicle.crossings.begin(), vehicle.crossings.end(), [&](const CrossingPass& pass) {
            return norm(vehicle.actor.path->at(pass.at) - here) > kStopLine + 2.0;
          });
      if (is_free && is_clear) vehicles.push_back(std::move(vehicle));
    }
  }
  drive(vehicles, random);
}

std::vector<Traffic::Obstacle> Traffic::obstacles_at(const std::vector<Vehicle>& vehicles,
                                                     std::size_t tick) const {
  constexpr auto kNobody = std::numeric_limits<std::size_t>::max();
  std::vector<Obstacle> obstacles;
  const double t = Actors::time_of(tick);
  const auto add_body = [&](Vec2 at, Vec2 heading, double speed, double half, std::size_t owner) {
    for (const double offset : {-half, 0.0, half}) {
      obstacles.push_back({at + offset * heading, speed * heading, owner});
    }
  };
  for (int i = 0; i < Convoy::kVehicles; ++i) {
    const double speed = (convoy_.travelled(i, t + 0.1) - convoy_.travelled(i, t)) / 0.1;
    add_body(convoy_.position(i, t), convoy_.heading(i, t), speed, 2.4, kNobody);
  }
  for (std::size_t i = 0; i < vehicles.size(); ++i) {
    const Vehicle& v = vehicles[i];
    add_body(v.actor.path->at(v.at), v.actor.path->heading(v.at), v.speed,
             half_length(v.actor.kind), i);
  }
  for (const Actor& actor : actors_) {
    if (actor.kind != ActorKind::kPerson || !actor.crosses_streets) continue;
    const double s = actor.travelled[tick];
    obstacles.push_back({actor.path->at(s), {0, 0}, kNobody});
  }
  return obstacles;
}

void Traffic::drive(std::vector<Vehicle>& vehicles, Random& random) {
  std::vector<bool> crashed(vehicles.size(), false);
  for (std::size_t tick = 0; tick < ticks_; ++tick) {
    const double t = Actors::time_of(tick);
    const std::vector<Obstacle> obstacles = obstacles_at(vehicles, tick);
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      Vehicle& v = vehicles[i];
      v.actor.travelled.push_back(static_cast<float>(v.at));
      if (crashed[i]) continue;
      const double half = half_length(v.actor.kind);
      const double width = half_width(v.actor.kind);
      const Vec2 here = v.actor.path->at(v.at);
      const Vec2 heading = v.actor.path->heading(v.at);
      for (const double offset : {-half, -0.5 * half, 0.0, 0.5 * half, half}) {
        crashed[i] = crashed[i] || convoy_.touches(here + offset * heading, width, t);
      }
      for (const Obstacle& o : obstacles) {
        if (o.owner >= i || crashed[o.owner]) continue;
        const Vec2 d = o.position - here;
        if (std::abs(dot(d, heading)) < half && std::abs(cross(d, heading)) < width + 0.3) {
          crashed[i] = true;
        }
      }
      // A vehicle that collided releases its crossing.
      if (crashed[i] && v.holds >= 0) crossing_holder_[static_cast<std::size_t>(v.holds)] = -1;
    }
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      if (!crashed[i]) step(vehicles, i, t, obstacles, random);
    }
  }
  for (std::size_t i = 0; i < vehicles.size(); ++i) {
    if (!crashed[i]) actors_.push_back(std::move(vehicles[i].actor));
  }
}

double Traffic::gap_to_stop_line(Vehicle& vehicle, std::size_t self, double time_s) {
  const double length = vehicle.actor.path->length();
  if (vehicle.holds >= 0 && vehicle.at > vehicle.releases_at) {
    crossing_holder_[static_cast<std::size_t>(vehicle.holds)] = -1;
    vehicle.holds = -1;
  }
  double nearest = kNever;
  for (const CrossingPass& pass : vehicle.crossings) {
    const double line = pass.at - kStopLine - half_length(vehicle.actor.kind);
    double ahead = std::fmod(line - vehicle.at, length);
    if (ahead < -1.0) ahead += length;
    if (ahead > kLookAhead) continue;
    if (vehicle.holds == static_cast<int>(pass.crossing)) continue;
    int& holder = crossing_holder_[pass.crossing];
    if (vehicle.holds < 0 && holder < 0 && ahead < 15.0) {
      const Vec2 middle = vehicle.actor.path->at(pass.at);
      const Vec2 here = vehicle.actor.path->at(vehicle.at);
      // Drivers ahead of the convoy on its own lane drive on; all others wait for it to pass.
      const bool leads_convoy = convoy_.passes(here, 2.5, time_s, time_s + 12.0);
      if (leads_convoy || !convoy_.passes(middle, 15.0, time_s - 0.5, time_s + 5.0)) {
        holder = static_cast<int>(self);
        vehicle.holds = static_cast<int>(pass.crossing);
        vehicle.releases_at =
            vehicle.at + ahead + kStopLine + kCrossingEnd + 2.0 * half_length(vehicle.actor.kind);
        continue;
      }
    }
    nearest = std::min(nearest, std::max(ahead, 0.1));
  }
  return nearest;
}

void Traffic::step(std::vector<Vehicle>& vehicles, std::size_t self, double time_s,
                   const std::vector<Obstacle>& obstacles, Random& random) {
  constexpr double kAcceleration = 1.6;
  constexpr double kBraking = 1.8;
  constexpr double kHeadway = 1.2;
  constexpr double kStandstill = 2.0;
  constexpr double kCorridor = 1.9;
  Vehicle& v = vehicles[self];
  const Path& path = *v.actor.path;
  const double half = half_length(v.actor.kind);
  const Vec2 here = path.at(v.at);

  double gap = gap_to_stop_line(v, self, time_s);
  double lead_speed = 0.0;
  std::array<Vec2, 15> ahead;
  bool have_samples = false;
  for (const Obstacle& o : obstacles) {
    if (o.owner == self || norm(o.position - here) > kLookAhead) continue;
    if (!have_samples) {
      for (std::size_t k = 0; k < ahead.size(); ++k) {
        ahead[k] = path.at(v.at + half + 2.0 * static_cast<double>(k));
      }
      have_samples = true;
    }
    for (std::size_t k = 0; k < ahead.size(); ++k) {
      if (norm(o.position - ahead[k]) > kCorridor) continue;
      const double distance = std::max(0.1, 2.0 * static_cast<double>(k) - 0.5);
      if (distance < gap) {
        gap = distance;
        lead_speed = std::max(0.0, dot(o.velocity, path.heading(v.at)));
      }
      break;
    }
  }
  if (time_s > v.stopped_until && v.speed > 3.0 && v.holds < 0 &&
      random.chance(Actors::kTick / 70.0) && !convoy_.passes(here, 3.0, time_s, time_s + 25.0)) {
    v.stopped_until = time_s + random.uniform(4.0, 20.0);
  }
  const auto wrapped = static_cast<std::size_t>(v.at / Path::kStep) % v.speed_limit.size();
  const double wish = time_s < v.stopped_until ? 0.01 : v.speed_limit[wrapped];
  const double closing = v.speed - lead_speed;
  const double desired =
      kStandstill +
      std::max(0.0, v.speed * kHeadway +
                        v.speed * closing / (2.0 * std::sqrt(kAcceleration * kBraking)));
  const double free_road = 1.0 - std::pow(v.speed / wish, 4.0);
  double acceleration = kAcceleration * (free_road - (desired / gap) * (desired / gap));
  acceleration = std::clamp(acceleration, -6.0, kAcceleration);
  v.speed = std::max(0.0, v.speed + acceleration * Actors::kTick);
  v.at += v.speed * Actors::kTick;
}

}  // namespace unimapper::simulator
