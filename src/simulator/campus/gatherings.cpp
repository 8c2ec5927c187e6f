// Pedestrians at given positions: companions of the robot, a queue, standing groups.
#include <algorithm>
#include <iterator>

#include "crowd.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kNotAtCounter = -1e9;

/// A person who queues on a closed path and joins the end again after waiting at the counter.
struct Queuer {
  double at, next_stop;
  double leaves_counter_s = kNotAtCounter;
};

/// Speed (m/s) towards the position behind the person `gap` ahead, or towards the counter.
double queue_speed(double gap, double to_counter) {
  constexpr double kSpacing = 0.8;
  const double behind = std::clamp((gap - kSpacing) / 0.5, 0.0, 1.0);
  return 1.2 * std::min(behind, std::clamp(to_counter / 0.4, 0.0, 1.0));
}

/// A ring of people around `centre` who look at each other.
void add_circle(Vec2 centre, std::uint32_t size, std::size_t ticks, Random& random,
                ActorSet& crowd) {
  const double radius = 0.35 + 0.12 * size;
  const double turn = random.uniform(0.0, 2.0 * kPi);
  for (std::uint32_t i = 0; i < size; ++i) {
    const double angle = turn + 2.0 * kPi * (i + random.uniform(-0.15, 0.15)) / size;
    const Vec2 outward{std::cos(angle), std::sin(angle)};
    crowd.paths.emplace_back(
        std::vector<Vec2>{centre + radius * outward, centre + (radius - 2.0) * outward}, false);
    Actor actor = make_person(crowd.paths.back(), random);
    actor.travelled.assign(ticks, 0.0F);
    crowd.actors.push_back(std::move(actor));
  }
}

}  // namespace

/// Companions beside and behind the robot occlude the same part of its view all the time; the guide
/// passes over the ground that the robot covers next, as the vehicle ahead does in the town.
void add_companions(const RobotWalk& robot, std::size_t ticks, Random& random, ActorSet& crowd) {
  struct Post {
    double ahead, left;
  };
  constexpr Post kPosts[] = {{-1.2, 1.35}, {-1.75, -0.75}, {5.0, 0.25}};
  static_assert(std::size(kPosts) == kCompanions + 1);
  for (const Post& post : kPosts) {
    Actor actor = make_person(robot.path(), random);
    actor.scale = random.uniform(0.93, 1.07);
    actor.lateral = post.left;
    const double phase = random.uniform(0.0, 2.0 * kPi);
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      const double t = Actors::time_of(tick);
      const double drift = 0.18 * std::sin(0.4 * t + phase);
      actor.travelled.push_back(static_cast<float>(robot.travelled(t) + post.ahead + drift));
      actor.sidestep.push_back(static_cast<float>(0.1 * std::sin(0.27 * t + 2.0 * phase)));
    }
    crowd.actors.push_back(std::move(actor));
  }
}

void add_queue(const Plan& plan, std::size_t ticks, Random& random, ActorSet& crowd) {
  constexpr std::size_t kQueuers = 11;
  const Area& area = plan.queue();
  crowd.paths.push_back(rounded_loop({{area.low.x + 0.3, area.high.y - 0.3},
                                      {area.high.x - 0.1, area.high.y - 0.3},
                                      {area.high.x - 0.1, area.low.y + 0.2},
                                      {area.low.x + 0.3, area.low.y + 0.2}}));
  const Path& path = crowd.paths.back();
  const double counter = path.nearest({area.high.x - 1.0, area.high.y - 0.3});
  std::vector<Queuer> queuers;
  const std::size_t first = crowd.actors.size();
  for (std::size_t i = 0; i < kQueuers; ++i) {
    queuers.push_back({counter - 0.85 * static_cast<double>(i), counter});
    crowd.actors.push_back(make_person(path, random));
  }
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double t = Actors::time_of(tick);
    for (std::size_t i = 0; i < kQueuers; ++i) {
      Queuer& c = queuers[i];
      crowd.actors[first + i].travelled.push_back(static_cast<float>(c.at));
      const bool leads = i == 0;  // follows the last one, one lap ahead
      const double ahead = leads ? queuers.back().at + path.length() : queuers[i - 1].at;
      if (c.next_stop - c.at < 0.05) {
        if (c.leaves_counter_s == kNotAtCounter) c.leaves_counter_s = t + random.uniform(5.0, 14.0);
        if (t > c.leaves_counter_s) {
          c.next_stop += path.length();
          c.leaves_counter_s = kNotAtCounter;
        }
      }
      c.at += Actors::kTick * queue_speed(ahead - c.at, c.next_stop - c.at);
    }
  }
}

void add_gatherings(const Plan& plan, std::size_t ticks, Random& random, ActorSet& crowd) {
  constexpr int kOnPlaza = 9;
  constexpr int kOnLawns = 8;
  constexpr double kRoom = 1.2;
  constexpr double kFromTours = 2.9;
  int circles = 0;
  for (int tries = 0; tries < 400 && circles < kOnPlaza + kOnLawns; ++tries) {
    const bool on_plaza = circles < kOnPlaza;
    const Area area = on_plaza ? plan.plaza() : Area{{-60, -95}, {60, 20}};
    const Vec2 at{random.uniform(area.low.x, area.high.x), random.uniform(area.low.y, area.high.y)};
    const std::uint32_t size = 2 + random.index(4);
    const bool is_clear = on_plaza ? is_clear_on_plaza(plan, at, kRoom) : plan.is_free(at, kRoom);
    if (!is_clear || plan.to_tours(at) < kFromTours) continue;
    add_circle(at, size, ticks, random, crowd);
    ++circles;
  }
}

}  // namespace unimapper::simulator::campus
