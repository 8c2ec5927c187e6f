// Groups of persons, cyclists and vans on the campus and their paths.
#include <algorithm>
#include <iterator>

#include "crowd.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

class Strollers {
 public:
  Strollers(const Plan& plan, const RobotWalk& robot, std::size_t ticks, Random& random,
            ActorSet& crowd)
      : plan_(plan),
        strolling_([&robot](double time_s) { return robot.at(time_s); }, ticks, random, crowd),
        random_(random),
        crowd_(crowd) {}

  void add_on_plaza(int groups);
  void add_on_paths(int groups);
  void add_cyclists(int count);
  void add_vans();
  void run() { strolling_.run(); }

 private:
  [[nodiscard]] Stroller group_on(const Path& path);
  [[nodiscard]] bool make_plaza_loop();

  const Plan& plan_;
  Strolling strolling_;
  Random& random_;
  ActorSet& crowd_;
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
    strolling_.add(group_on(crowd_.paths.back()));
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
    strolling_.add(std::move(s));
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
    strolling_.add(std::move(s));
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
    strolling_.add(std::move(s));
  };
  add(walks.back(), random_.uniform(0.0, walks.back().length()));
  const Path& past_plaza = walks[Plan::kPastPlaza];
  add(past_plaza, past_plaza.nearest(plan_.bridge().centre()));
}

}  // namespace

void add_strollers(const Plan& plan, const RobotWalk& robot, std::size_t ticks, Random& random,
                   ActorSet& crowd) {
  Strollers strollers(plan, robot, ticks, random, crowd);
  strollers.add_on_plaza(32);
  strollers.add_on_paths(90);
  strollers.add_cyclists(9);
  strollers.add_vans();
  strollers.run();
}

}  // namespace unimapper::simulator::campus
