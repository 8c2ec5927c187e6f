#include "actors.hpp"

#include <algorithm>

#include "person_shape.hpp"
#include "random.hpp"
#include "traffic.hpp"

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

/// Marks every tick that has motion within the window around it.
void mark_moved(Actor& actor) {
  const auto count = static_cast<std::ptrdiff_t>(actor.travelled.size());
  const auto window = static_cast<std::ptrdiff_t>(kMovingWindow / Actors::kTick);
  actor.moved.assign(actor.travelled.size(), false);
  std::ptrdiff_t last_motion = -1 - 2 * window;
  for (std::ptrdiff_t i = 1; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double speed = (actor.travelled[at] - actor.travelled[at - 1]) / Actors::kTick;
    if (speed > kMovingSpeed) {
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

Actors::Actors(const World& world, const RobotMotion& robot, std::uint64_t seed, std::uint32_t day,
               double duration_s)
    : world_(world), traffic_(std::make_unique<Traffic>(world.plan, robot, seed, day, duration_s)) {
  actors_ = traffic_->take_actors();
  constexpr std::uint16_t kFirstObject = 20000;  // parked cars are numbered from 1
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    actors_[i].object = static_cast<std::uint16_t>(kFirstObject + i);
    mark_moved(actors_[i]);
  }
}

Actors::~Actors() = default;

double Actors::travelled(const Actor& actor, double time_s) const {
  const double tick = std::max(0.0, (time_s + kWarmUp) / kTick);
  const auto low = std::min(static_cast<std::size_t>(tick), actor.travelled.size() - 2);
  const double w = std::min(1.0, tick - static_cast<double>(low));
  const double from = actor.travelled[low];
  return from + w * (actor.travelled[low + 1] - from);
}

Frame Actors::frame_of(const Actor& actor, double time_s) const {
  const double s = travelled(actor, time_s);
  const bool is_person = actor.kind == ActorKind::kPerson;
  const Vec2 heading = actor.path->heading(s, is_person ? 0.6 : 2.6);
  const Vec2 at = actor.path->at(s) + actor.lateral * left_of(heading);
  const double lift = is_person ? world_.plan.sidewalk_lift(at) : 0.0;
  const Vec3 ground{at.x, at.y, world_.plan.height(at) + lift};
  if (is_person) return upright_frame(ground, heading);
  return sloped_frame(ground, heading, world_.plan.up(at));
}

void Actors::add_person_parts(const Actor& actor, double begin_s, double end_s, std::uint16_t label,
                              std::vector<MovingInstance>& instances) const {
  const Frame begin = frame_of(actor, begin_s);
  const Frame end = frame_of(actor, end_s);
  const Prototypes& prototypes = world_.prototypes;
  const auto add = [&](PrototypeRange range, const Frame& at_begin, const Frame& at_end) {
    instances.push_back({range.first + actor.variant % range.count, at_begin, at_end, actor.scale,
                         label, actor.object});
  };
  add(prototypes.torsos, begin, end);
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
    add(prototypes.legs,
        begin * limb(person::kHipHalfWidth, person::kHipHeight, side * swing_begin),
        end * limb(person::kHipHalfWidth, person::kHipHeight, side * swing_end));
    add(prototypes.arms,
        begin * limb(person::kShoulderHalfWidth, person::kShoulderHeight, -side * swing_begin),
        end * limb(person::kShoulderHalfWidth, person::kShoulderHeight, -side * swing_end));
  }
}

std::vector<MovingInstance> Actors::during(double begin_s, double end_s, Vec2 around) const {
  std::vector<MovingInstance> instances;
  for (const Actor& actor : actors_) {
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
    const PrototypeRange range = range_of(world_.prototypes, actor.kind);
    instances.push_back({range.first + actor.variant % range.count, frame_of(actor, begin_s),
                         frame_of(actor, end_s), actor.scale, id, actor.object});
  }
  return instances;
}

}  // namespace unimapper::simulator
