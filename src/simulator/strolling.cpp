#include "strolling.hpp"

#include <algorithm>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

constexpr std::size_t kRobot = static_cast<std::size_t>(-1);
constexpr std::size_t kOthers = static_cast<std::size_t>(-2);

/// Smallest allowed distance (m) between an actor and the robot's centre.
double least_distance(ActorKind kind) {
  if (kind == ActorKind::kVan || kind == ActorKind::kCar) return 3.0;
  return kind == ActorKind::kCyclist ? 0.9 : 0.6;
}

}  // namespace

/// A disc that others walk around.
struct Strolling::Body {
  Vec2 at;
  double radius;
  std::size_t owner;
};

struct Strolling::Steering {
  double push = 0.0;  ///< to the left
  double pace = 1.0;  ///< share of the wished speed
};

std::vector<Strolling::Body> Strolling::bodies_at(std::size_t tick) const {
  std::vector<Body> bodies{{robot_at_(Actors::time_of(tick)), 0.45, kRobot}};
  for (const Actor& actor : crowd_.actors) {
    bodies.push_back({position(actor, tick), kPersonRadius, kOthers});
  }
  for (std::size_t i = 0; i < strollers_.size(); ++i) {
    const Stroller& s = strollers_[i];
    const Vec2 heading = s.path->heading(s.at, 0.6);
    const Vec2 at = s.path->at(s.at) + (s.home + s.side) * left_of(heading);
    if (s.half_length < 1.0) {
      bodies.push_back({at, s.radius, i});
      continue;
    }
    for (const double offset : {-0.6, 0.0, 0.6}) {
      bodies.push_back({at + (offset * s.half_length) * heading, s.radius, i});
    }
  }
  return bodies;
}

/// Steers away from bodies ahead, to the right of oncoming ones, and slows down near them.
Strolling::Steering Strolling::steer(std::size_t self, const std::vector<Body>& bodies) const {
  constexpr double kComfort = 0.25;
  constexpr double kSeesRobotBehind = 2.5;
  const Stroller& s = strollers_[self];
  const Vec2 heading = s.path->heading(s.at, 0.6);
  const Vec2 here = s.path->at(s.at) + (s.home + s.side) * left_of(heading);
  const double look = s.half_length + 1.2 + 1.5 * s.cruise;
  Steering result;
  for (const Body& body : bodies) {
    const Vec2 offset = body.at - here;
    if (body.owner == self || dot(offset, offset) > look * look) continue;
    const double width = s.radius + body.radius;
    const double ahead = dot(offset, heading);
    const double across = cross(heading, offset);
    const double behind = body.owner == kRobot ? kSeesRobotBehind : width;
    const double overlap = width + kComfort - std::abs(across);
    if (ahead < -behind || overlap <= 0.0) continue;
    const double nearness = 1.0 - std::clamp((std::abs(ahead) - width) / look, 0.0, 1.0);
    result.push += (across > -0.05 ? -1.0 : 1.0) * overlap * nearness;
    const double gap = ahead - width - s.half_length;
    if (ahead > 0.0 && std::abs(across) < 0.85 * width) {
      result.pace = std::min(result.pace, std::clamp(gap / (0.7 * s.cruise), 0.0, 1.0));
    }
  }
  return result;
}

void Strolling::step(Stroller& s, const Steering& steering, double time_s) {
  constexpr double kPatience = 3.0;
  constexpr double kSqueeze = 1.5;  // seconds of squeezing through a jam
  constexpr double kAcceleration = 1.5;
  s.travelled.push_back(static_cast<float>(s.at));
  s.sidestep.push_back(static_cast<float>(s.side));
  if (s.pauses_per_s > 0.0 && time_s > s.pause_until_s &&
      random_.chance(Actors::kTick * s.pauses_per_s)) {
    s.pause_until_s = time_s + random_.uniform(4.0, 15.0);
  }
  const bool rests = time_s < s.departs_s || time_s < s.pause_until_s;
  double pace = steering.pace;
  s.blocked_s = !rests && pace < 0.2 ? s.blocked_s + Actors::kTick : 0.0;
  if (s.kind == ActorKind::kPerson && s.blocked_s > kPatience) pace = 0.4;
  if (s.blocked_s > kPatience + kSqueeze) s.blocked_s = 0.0;
  const double wish = rests ? 0.0 : pace * s.cruise;
  s.speed += std::clamp(wish - s.speed, -2.0 * kAcceleration * Actors::kTick,
                        kAcceleration * Actors::kTick);
  s.at += s.speed * Actors::kTick;
  if (rests) return;  // standing groups are obstacles to the others
  const double drift = std::clamp(1.5 * steering.push - 0.5 * s.side, -0.6, 0.6);
  s.side = std::clamp(s.side + drift * Actors::kTick, -s.room, s.room);
}

void Strolling::run() {
  std::vector<Steering> steering(strollers_.size());
  for (std::size_t tick = 0; tick < ticks_; ++tick) {
    const std::vector<Body> bodies = bodies_at(tick);
    for (std::size_t i = 0; i < strollers_.size(); ++i) steering[i] = steer(i, bodies);
    for (std::size_t i = 0; i < strollers_.size(); ++i) {
      step(strollers_[i], steering[i], Actors::time_of(tick));
    }
  }
  make_actors();
}

/// Every member of a group becomes an actor.
void Strolling::make_actors() {
  for (Stroller& s : strollers_) {
    for (std::uint32_t member = 0; member < s.size; ++member) {
      Actor actor = make_person(*s.path, random_);
      actor.kind = s.kind;
      if (s.kind != ActorKind::kPerson) actor.scale = 1.0;
      const std::uint32_t abreast = std::min(s.size, 3U);
      const std::uint32_t column = member % 3;
      actor.lateral = s.home + kAbreast * (column - 0.5 * (abreast - 1));
      actor.travelled = s.travelled;
      actor.sidestep = s.sidestep;
      const bool is_alone = s.size == 1;
      const auto behind =
          static_cast<float>(is_alone ? 0.0 : 0.85 * (member / 3) + random_.uniform(0.0, 0.25));
      for (float& value : actor.travelled) value -= behind;
      crowd_.actors.push_back(std::move(actor));
    }
  }
}

Actor make_person(const Path& path, Random& random) {
  Actor actor;
  actor.kind = ActorKind::kPerson;
  actor.variant = random.index(12);
  actor.scale = random.chance(0.06) ? random.uniform(0.62, 0.8) : random.uniform(0.93, 1.07);
  actor.path = &path;
  return actor;
}

Vec2 position(const Actor& actor, std::size_t tick) {
  const double s = actor.travelled[tick];
  const double left = actor.lateral + (actor.sidestep.empty() ? 0.0F : actor.sidestep[tick]);
  return actor.path->at(s) + left * left_of(actor.path->heading(s, 0.6));
}

void remove_colliding_actors(const std::function<Vec2(double)>& robot_at, std::size_t ticks,
                             ActorSet& crowd) {
  constexpr std::size_t kEvery = 2;
  std::vector<Vec2> way;
  for (std::size_t tick = 0; tick < ticks; tick += kEvery) {
    way.push_back(robot_at(Actors::time_of(tick)));
  }
  const auto is_hit = [&](const Actor& actor) {
    const double least = least_distance(actor.kind);
    for (std::size_t i = 0; i < way.size(); ++i) {
      if (norm(position(actor, i * kEvery) - way[i]) < least) return true;
    }
    return false;
  };
  std::erase_if(crowd.actors, is_hit);
}

}  // namespace unimapper::simulator
