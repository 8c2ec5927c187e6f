// Pedestrian, cyclist and van motion along closed paths with collision avoidance.
#include <algorithm>
#include <iterator>

#include "crowd.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kPersonRadius = 0.3;
constexpr double kAbreast = 0.62;  // metres between persons side by side

/// A group of persons, a cyclist or a van: one body on a closed path.
struct Stroller {
  ActorKind kind = ActorKind::kPerson;
  const Path* path = nullptr;
  std::uint32_t size = 1;
  double cruise = 1.2;
  double home = 0.0;        ///< metres left of the path
  double room = 0.8;        ///< how far it may step aside
  double departs_s = -1e9;  ///< stands until then
  double pauses_per_s = 0.0;
  double radius = kPersonRadius;
  double half_length = 0.0;
  double at = 0.0, speed = 0.0, side = 0.0;
  double pause_until_s = -1e9;
  double blocked_s = 0.0;  ///< duration of the current obstruction
  std::vector<float> travelled, sidestep;
};

/// A disc that others walk around.
struct Body {
  Vec2 at;
  double radius;
  std::size_t owner;
};
constexpr std::size_t kRobot = static_cast<std::size_t>(-1);
constexpr std::size_t kOthers = static_cast<std::size_t>(-2);

struct Steering {
  double push = 0.0;  ///< to the left
  double pace = 1.0;  ///< share of the wished speed
};

class Strollers {
 public:
  Strollers(const Plan& plan, const RobotWalk& robot, std::size_t ticks, Random& random,
            ActorSet& crowd)
      : plan_(plan), robot_(robot), ticks_(ticks), random_(random), crowd_(crowd) {}

  void add_on_plaza(int groups);
  void add_on_paths(int groups);
  void add_cyclists(int count);
  void add_vans();
  void walk();
  void make_actors();

 private:
  [[nodiscard]] Stroller group_on(const Path& path);
  [[nodiscard]] bool make_plaza_loop();
  [[nodiscard]] std::vector<Body> bodies_at(std::size_t tick) const;
  [[nodiscard]] Steering steer(std::size_t self, const std::vector<Body>& bodies) const;
  void step(Stroller& stroller, const Steering& steering, double time_s);

  const Plan& plan_;
  const RobotWalk& robot_;
  std::size_t ticks_;
  Random& random_;
  ActorSet& crowd_;
  std::vector<Stroller> strollers_;
};

Stroller Strollers::group_on(const Path& path) {
  Stroller s;
  s.path = &path;
  s.size = random_.chance(0.45) ? 1 : 2 + random_.index(3);
  s.cruise = random_.uniform(0.8, 1.5);
  s.radius = kPersonRadius + 0.5 * kAbreast * (std::min(s.size, 3U) - 1);
  s.pauses_per_s = random_.chance(0.35) ? 1.0 / 25.0 : 0.0;
  s.at = random_.uniform(0.0, path.length());
  // Some groups stand first and walk later, but never on the robot's tour.
  const bool stands = random_.chance(0.25);
  if (stands && plan_.to_tours(path.at(s.at)) > 2.9) s.departs_s = random_.uniform(2.0, 60.0);
  return s;
}

/// Draws a loop over the plaza that is clear of fixtures; false if this draw is not.
bool Strollers::make_plaza_loop() {
  const Area& plaza = plan_.plaza();
  const std::uint32_t corners = 4 + random_.index(3);
  std::vector<Vec2> loop;
  Vec2 middle{};
  for (std::uint32_t i = 0; i < corners; ++i) {
    loop.push_back(
        {random_.uniform(plaza.low.x, plaza.high.x), random_.uniform(plaza.low.y, plaza.high.y)});
    middle = middle + (1.0 / corners) * loop.back();
  }
  // Sorted by angle about their centroid, so that the path does not cross itself.
  std::sort(loop.begin(), loop.end(), [&](Vec2 a, Vec2 b) {
    return std::atan2(a.y - middle.y, a.x - middle.x) < std::atan2(b.y - middle.y, b.x - middle.x);
  });
  if (random_.chance(0.5)) std::reverse(loop.begin(), loop.end());
  Path path = rounded_loop(loop);
  if (path.length() < 25.0) return false;
  for (double s = 0.0; s < path.length(); s += 0.5) {
    if (!is_clear_on_plaza(plan_, path.at(s), 1.0)) return false;
  }
  crowd_.paths.push_back(std::move(path));
  return true;
}

void Strollers::add_on_plaza(int groups) {
  for (int tries = 0; tries < 40 * groups && groups > 0; ++tries) {
    if (!make_plaza_loop()) continue;
    strollers_.push_back(group_on(crowd_.paths.back()));
    --groups;
  }
}

void Strollers::add_on_paths(int groups) {
  const auto walks = plan_.walks();
  double total = 0.0;
  for (const Path& walk : walks) total += walk.length();
  for (int i = 0; i < groups; ++i) {
    // Every metre of path is as busy as any other, the stairs three times as much.
    double draw = random_.uniform(-2.0 * (walks[0].length() + walks[1].length()), total);
    std::size_t w = draw < 0.0 ? random_.index(Plan::kStairWalks) : 0;
    for (; draw > walks[w].length() && w + 1 < walks.size(); ++w) draw -= walks[w].length();
    const bool reversed = random_.chance(0.5);
    if (reversed) {
      crowd_.paths.push_back(walks[w].reversed());
    } else {
      crowd_.paths.push_back(walks[w]);
    }
    Stroller s = group_on(crowd_.paths.back());
    s.home = s.size > 2 ? 0.0 : -0.4;
    s.room = s.size > 2 ? 0.35 : 0.7;
    strollers_.push_back(std::move(s));
  }
}

void Strollers::add_cyclists(int count) {
  static constexpr std::size_t kRides[] = {3, 4, 8, 9, 12, 14};
  for (int i = 0; i < count; ++i) {
    crowd_.paths.push_back(plan_.walks()[kRides[static_cast<std::size_t>(i) % std::size(kRides)]]);
    Stroller s;
    s.kind = ActorKind::kCyclist;
    s.path = &crowd_.paths.back();
    s.cruise = random_.uniform(2.4, 4.0);
    s.home = -0.4;
    s.radius = 0.4;
    s.half_length = 0.9;
    s.at = random_.uniform(0.0, s.path->length());
    strollers_.push_back(std::move(s));
  }
}

/// One van circles the campus, one passes the plaza.
void Strollers::add_vans() {
  const auto walks = plan_.walks();
  const auto add = [&](const Path& path, double at) {
    Stroller s;
    s.kind = ActorKind::kVan;
    s.path = &path;
    s.cruise = random_.uniform(1.6, 2.4);
    s.room = 0.0;
    s.radius = 1.1;
    s.half_length = 2.7;
    s.pauses_per_s = 1.0 / 40.0;
    s.at = at;
    strollers_.push_back(std::move(s));
  };
  add(walks.back(), random_.uniform(0.0, walks.back().length()));
  const Path& past_plaza = walks[Plan::kPastPlaza];
  add(past_plaza, past_plaza.nearest(plan_.bridge().centre()));
}

std::vector<Body> Strollers::bodies_at(std::size_t tick) const {
  std::vector<Body> bodies{{robot_.at(Actors::time_of(tick)), 0.45, kRobot}};
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
Steering Strollers::steer(std::size_t self, const std::vector<Body>& bodies) const {
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

void Strollers::step(Stroller& s, const Steering& steering, double time_s) {
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

void Strollers::walk() {
  std::vector<Steering> steering(strollers_.size());
  for (std::size_t tick = 0; tick < ticks_; ++tick) {
    const std::vector<Body> bodies = bodies_at(tick);
    for (std::size_t i = 0; i < strollers_.size(); ++i) steering[i] = steer(i, bodies);
    for (std::size_t i = 0; i < strollers_.size(); ++i) {
      step(strollers_[i], steering[i], Actors::time_of(tick));
    }
  }
}

/// Every member of a group becomes an actor.
void Strollers::make_actors() {
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

}  // namespace

void add_strollers(const Plan& plan, const RobotWalk& robot, std::size_t ticks, Random& random,
                   ActorSet& crowd) {
  Strollers strollers(plan, robot, ticks, random, crowd);
  strollers.add_on_plaza(32);
  strollers.add_on_paths(90);
  strollers.add_cyclists(9);
  strollers.add_vans();
  strollers.walk();
  strollers.make_actors();
}

}  // namespace unimapper::simulator::campus
