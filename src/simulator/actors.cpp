#include "actors.hpp"

#include <algorithm>

#include "person_shape.hpp"

namespace unimapper::simulator {
namespace {

constexpr double kPersonReach = 120.0;
constexpr double kVehicleReach = 260.0;
constexpr double kMovingSpeed = 0.2;
constexpr double kMovingWindow = 3.0;

std::uint16_t base_label(ActorKind kind) {
  switch (kind) {
    case ActorKind::kCar:
      return label::kCar;
    case ActorKind::kVan:
      return label::kTruck;
    case ActorKind::kBus:
      return label::kBus;
    case ActorKind::kCyclist:
      return label::kBicyclist;
    case ActorKind::kPerson:
      return label::kPerson;
  }
  return label::kCar;
}

PrototypeRange range_of(const Prototypes& prototypes, ActorKind kind) {
  switch (kind) {
    case ActorKind::kCar:
      return prototypes.cars;
    case ActorKind::kVan:
      return prototypes.vans;
    case ActorKind::kBus:
      return prototypes.buses;
    case ActorKind::kCyclist:
      return prototypes.cyclists;
    case ActorKind::kPerson:
      return prototypes.torsos;
  }
  return prototypes.cars;
}

/// Speed (m/s) up to a tick, sidesteps included.
double speed_at(const Actor& actor, std::size_t tick) {
  const double forward = (actor.travelled[tick] - actor.travelled[tick - 1]) / Actors::kTick;
  if (actor.sidestep.empty()) return forward;
  return std::hypot(forward, (actor.sidestep[tick] - actor.sidestep[tick - 1]) / Actors::kTick);
}

/// Linear interpolation between the values of two ticks.
double at_time(const std::vector<float>& values, double time_s) {
  const double tick = std::max(0.0, (time_s + Actors::kWarmUp) / Actors::kTick);
  const auto low = std::min(static_cast<std::size_t>(tick), values.size() - 2);
  const double w = std::min(1.0, tick - static_cast<double>(low));
  const double from = values[low];
  return from + w * (values[low + 1] - from);
}

/// Marks every tick that has motion within the window around it.
void mark_moved(Actor& actor) {
  const auto count = static_cast<std::ptrdiff_t>(actor.travelled.size());
  const auto window = static_cast<std::ptrdiff_t>(kMovingWindow / Actors::kTick);
  actor.moved.assign(actor.travelled.size(), false);
  std::ptrdiff_t last_motion = -1 - 2 * window;
  for (std::ptrdiff_t i = 1; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (speed_at(actor, at) > kMovingSpeed) {
      const std::ptrdiff_t from = std::max(i - window, last_motion);
      for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(from, 0); k < i; ++k) {
        actor.moved[static_cast<std::size_t>(k)] = true;
      }
      last_motion = i;
    }
    if (i - last_motion <= window) actor.moved[at] = true;
  }
}

}  // namespace

Actors::Actors(const Prototypes& prototypes, const Terrain& terrain, ActorSet set)
    : prototypes_(prototypes), terrain_(terrain), set_(std::move(set)) {
  constexpr std::uint16_t kFirstObject = 20000;  // parked objects are numbered from 1
  for (std::size_t i = 0; i < set_.actors.size(); ++i) {
    set_.actors[i].object = static_cast<std::uint16_t>(kFirstObject + i);
    mark_moved(set_.actors[i]);
  }
}

std::vector<ObjectMotion> Actors::motions(const std::vector<double>& stamps_s) const {
  constexpr auto kScanTicks = static_cast<std::size_t>(0.1 / kTick + 0.5);
  std::vector<ObjectMotion> result;
  for (const Actor& actor : set_.actors) {
    bool was_moving = false;
    for (std::size_t scan = 0; scan < stamps_s.size(); ++scan) {
      const auto last = std::min(static_cast<std::size_t>((stamps_s[scan] + kWarmUp) / kTick + 0.5),
                                 actor.travelled.size() - 1);
      bool moves = false;
      for (std::size_t tick = last + 1 - kScanTicks; tick <= last; ++tick) {
        moves = moves || speed_at(actor, tick) > kMovingSpeed;
      }
      const auto number = static_cast<std::uint32_t>(scan);
      if (moves && !was_moving) result.push_back({actor.object, number, number});
      if (moves) result.back().last_scan = number;
      was_moving = moves;
    }
  }
  return result;
}

double Actors::travelled(const Actor& actor, double time_s) const {
  return at_time(actor.travelled, time_s);
}

Frame Actors::frame_of(const Actor& actor, double time_s) const {
  const double s = travelled(actor, time_s);
  const bool is_person = actor.kind == ActorKind::kPerson;
  const Vec2 heading = actor.path->heading(s, is_person ? 0.6 : 2.6);
  const double sidestep = actor.sidestep.empty() ? 0.0 : at_time(actor.sidestep, time_s);
  const Vec2 at = actor.path->at(s) + (actor.lateral + sidestep) * left_of(heading);
  if (is_person) return upright_frame({at.x, at.y, terrain_.walking_height(at)}, heading);
  return sloped_frame({at.x, at.y, terrain_.height(at)}, heading, terrain_.up(at));
}

void Actors::add_person_parts(const Actor& actor, double begin_s, double end_s, std::uint16_t label,
                              std::vector<MovingInstance>& instances) const {
  const Frame begin = frame_of(actor, begin_s);
  const Frame end = frame_of(actor, end_s);
  const auto add = [&](PrototypeRange range, const Frame& at_begin, const Frame& at_end) {
    instances.push_back({range.first + actor.variant % range.count, at_begin, at_end, actor.scale,
                         label, actor.object});
  };
  add(prototypes_.torsos, begin, end);
  const auto swing_at = [&](double time_s) {
    const double stride = person::kStride * actor.scale;
    const double walking = std::clamp(
        (travelled(actor, time_s + 0.1) - travelled(actor, time_s - 0.1)) / 0.2, 0.0, 1.0);
    return walking * person::kSwing *
           std::sin(2.0 * kPi * travelled(actor, time_s) / stride + 1.7 * actor.variant);
  };
  const double swing_begin = swing_at(begin_s);
  const double swing_end = swing_at(end_s);
  for (const double side : {-1.0, 1.0}) {
    const auto limb = [&](double half_width, double height, double angle) {
      Frame joint = rotation_frame({0, angle, 0});
      joint.origin = actor.scale * Vec3{0, side * half_width, height};
      return joint;
    };
    add(prototypes_.legs,
        begin * limb(person::kHipHalfWidth, person::kHipHeight, side * swing_begin),
        end * limb(person::kHipHalfWidth, person::kHipHeight, side * swing_end));
    add(prototypes_.arms,
        begin * limb(person::kShoulderHalfWidth, person::kShoulderHeight, -side * swing_begin),
        end * limb(person::kShoulderHalfWidth, person::kShoulderHeight, -side * swing_end));
  }
}

std::vector<MovingInstance> Actors::during(double begin_s, double end_s, Vec2 around) const {
  std::vector<MovingInstance> instances;
  for (const Actor& actor : set_.actors) {
    const bool is_person = actor.kind == ActorKind::kPerson;
    const Vec2 at = actor.path->at(travelled(actor, end_s));
    if (norm(at - around) > (is_person ? kPersonReach : kVehicleReach)) continue;
    const auto tick = static_cast<std::size_t>(std::max(0.0, (end_s + kWarmUp) / kTick));
    const bool moved = actor.moved[std::min(tick, actor.moved.size() - 1)];
    const std::uint16_t base = base_label(actor.kind);
    const std::uint16_t id = moved ? label::moving(base) : base;
    if (is_person) {
      add_person_parts(actor, begin_s, end_s, id, instances);
      continue;
    }
    const PrototypeRange range = range_of(prototypes_, actor.kind);
    instances.push_back({range.first + actor.variant % range.count, frame_of(actor, begin_s),
                         frame_of(actor, end_s), actor.scale, id, actor.object});
  }
  return instances;
}

}  // namespace unimapper::simulator
