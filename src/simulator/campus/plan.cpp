#include "plan.hpp"

#include <algorithm>
#include <iterator>

#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kTerraceHeight = 1.2;
constexpr double kRampHalfWidth = 2.1;

// Nodes of the network. 0..3 are the corners of the robot's first round, on the plaza.
constexpr Vec2 kNodes[] = {
    {-10, -8},   {10, -8},   {10, 8},      {-10, 8},                  // 0: plaza
    {27, -8},    {27, 8},    {36, 14.5},                              // 4: east side
    {38, 22.3},  {21, 22.3}, {0, 26.3},    {-21, 22.3}, {-38, 22.3},  // 7: ramps, terrace
    {-33, 14.5}, {-31.5, 7}, {-31.5, -10}, {-31, -26},  {-32, -45},   // 12: west side
    {-2, -21},   {-2, -45},  {27.5, -24},  {27.5, -45},               // 17: passage, alley
    {0, 15},     {0, 22},                                             // 21: stairs
    {-2, -62},   {-30, -66}, {26, -68},    {0, -94},                  // 23: park
    {-58, 18},   {-60, -8},  {-58, -44},   {56, 18},    {58, -14},   {56, -46},  // 27: outer way
    {-30, 54},   {30, 54}};

struct Link {
  int from, to;
  double half_width;
  double bow;  ///< metres that the way's middle lies left of the straight line, at most
};
constexpr Link kLinks[] = {
    {0, 1, 0, 0},      {1, 2, 0, 0},     {2, 3, 0, 0},      {3, 0, 0, 0},      {0, 14, 1.5, 0},
    {3, 13, 1.5, 0},   {0, 17, 1.5, 0},  {1, 17, 1.5, 0},   {1, 4, 1.5, 0},    {2, 5, 1.5, 0},
    {3, 21, 0, 0},     {21, 22, 0, 0},   {22, 9, 0, 0},     {4, 5, 2.0, 0},    {5, 6, 1.6, 1},
    {6, 7, 1.6, 0},    {7, 8, 1.8, 0},   {8, 9, 0, 0},      {9, 10, 0, 0},     {10, 11, 1.8, 0},
    {11, 12, 1.6, 0},  {12, 13, 1.6, 1}, {13, 14, 1.8, 0},  {14, 15, 1.4, 0},  {15, 16, 1.4, 0},
    {17, 18, 2.0, 0},  {4, 19, 1.8, 0},  {19, 20, 1.8, 0},  {16, 18, 1.6, 0},  {18, 20, 1.6, 0},
    {18, 23, 1.5, 1},  {23, 24, 1.2, 5}, {23, 25, 1.2, -5}, {16, 24, 1.0, -3}, {20, 25, 1.0, 3},
    {24, 26, 1.2, -5}, {25, 26, 1.2, 5}, {23, 26, 1.0, 6},  {11, 27, 1.5, 0},  {27, 28, 2.0, 1},
    {28, 29, 2.0, 1},  {29, 16, 2.0, 0}, {7, 30, 1.5, 0},   {30, 31, 2.0, 1},  {31, 32, 2.0, 1},
    {32, 20, 2.0, 0},  {29, 24, 1.0, 3}, {32, 25, 1.0, -3}, {27, 33, 2.0, 3},  {33, 34, 2.0, 0},
    {34, 30, 2.0, 3}};

constexpr int kTourA[] = {0, 1, 2, 3, 0, 1, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
constexpr int kTourB[] = {0, 1, 2, 3, 0, 17, 18, 23, 25, 20, 19, 4, 5, 2, 3};
constexpr int kTourC[] = {3, 2, 1, 0, 3, 2, 5, 4, 19, 20, 25, 23, 24, 16, 15, 14, 13};

constexpr int kWalk0[] = {3, 21, 22, 9, 10, 11, 12, 13};
constexpr int kWalk1[] = {3, 21, 22, 9, 8, 7, 6, 5, 2};
constexpr int kWalk2[] = {0, 17, 18, 16, 15, 14};
constexpr int kWalk3[] = {17, 18, 20, 19, 4, 1};
constexpr int kWalk4[] = {18, 23, 24, 16};
constexpr int kWalk5[] = {18, 23, 25, 20};
constexpr int kWalk6[] = {23, 24, 26};
constexpr int kWalk7[] = {23, 26, 25};
constexpr int kWalk8[] = {11, 27, 28, 29, 16, 15, 14, 13, 12};
constexpr int kWalk9[] = {7, 30, 31, 32, 20, 19, 4, 5, 6};
constexpr int kWalk10[] = {29, 24, 16};
constexpr int kWalk11[] = {32, 25, 20};
constexpr int kWalk12[] = {4, 5, 2, 1};
constexpr int kWalk13[] = {13, 14, 0, 3};
constexpr int kWalk14[] = {27, 28, 29, 16, 18, 20, 32, 31, 30, 34, 33};

/// Both ends and a point for every metre between them, along a bow.
std::vector<Vec2> bowed_line(Vec2 from, Vec2 to, double bow) {
  const Vec2 side = left_of(normalized(to - from));
  const int parts = std::max(1, static_cast<int>(norm(to - from)));
  std::vector<Vec2> points;
  for (int i = 0; i <= parts; ++i) {
    const double w = static_cast<double>(i) / parts;
    points.push_back(from + w * (to - from) + (4.0 * bow * w * (1.0 - w)) * side);
  }
  return points;
}

double nearest_point(const std::vector<Vec2>& points, Vec2 at) {
  double square = 1e18;
  for (const Vec2 p : points) square = std::min(square, dot(p - at, p - at));
  return std::sqrt(square);
}

double nearest_point(const Path& path, Vec2 at) { return norm(path.at(path.nearest(at)) - at); }

}  // namespace

Plan::Plan(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 1);
  stretch_ = {random.uniform(0.98, 1.1), random.uniform(0.98, 1.1)};
  const auto wave = [&](double amplitude, double shortest, double longest) {
    const double k = 2.0 * kPi / random.uniform(shortest, longest);
    const double direction = random.uniform(0.0, 2.0 * kPi);
    return Wave{amplitude, k * std::cos(direction), k * std::sin(direction),
                random.uniform(0.0, 2.0 * kPi)};
  };
  hills_ = {wave(1.3, 150.0, 210.0), wave(0.7, 90.0, 130.0), wave(0.12, 30.0, 45.0)};
  plaza_ = scaled(Area{{-22, -18}, {22, 17}});
  terrace_ = scaled(Area{{-21, 20.1}, {21, 34}});
  stairs_ = {{-7.0, terrace_.low.y - 2.4}, {7.0, terrace_.low.y}};
  const double ramp_middle = scaled(Vec2{0, 22.3}).y;
  const double ramp_length = 14.0;
  ramps_ = {Area{{terrace_.low.x - ramp_length, ramp_middle - kRampHalfWidth},
                 {terrace_.low.x, ramp_middle + kRampHalfWidth}},
            Area{{terrace_.high.x, ramp_middle - kRampHalfWidth},
                 {terrace_.high.x + ramp_length, ramp_middle + kRampHalfWidth}}};
  parking_ = scaled(Area{{63, -24}, {81, 10}});
  grounds_ = scaled(Area{{-88, -118}, {90, 74}});
  lay_out_halls(seed);
  lay_out_ways(seed);
  lay_out_fixtures();
}

void Plan::lay_out_halls(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 2);
  const auto add = [&](Area area, Side front, double recess, bool has_columns) {
    Hall hall;
    hall.area = scaled(area);
    hall.front = front;
    hall.recess = recess;
    hall.has_columns = has_columns;
    hall.storeys = 2 + static_cast<int>(random.index(4));
    hall.turn = random.uniform(-1.0, 1.0) * kDegree;
    halls_.push_back(hall);
  };
  add({{-20, 30}, {20, 48}}, Side::kSouth, 3.0, true);     // library, on the terrace
  add({{32, -42}, {48, 10}}, Side::kWest, 3.0, true);      // east, an arcade
  add({{-28, -40}, {23, -26}}, Side::kNorth, 0.0, false);  // south, a passage
  add({{-50, -22}, {-30, 10}}, Side::kEast, 4.0, false);   // west, overhanging
  add({{-72, -96}, {-46, -56}}, Side::kEast, 0.0, false);  // at the park
  add({{46, -98}, {68, -58}}, Side::kWest, 2.5, true);
  add({{-24, -116}, {22, -102}}, Side::kNorth, 0.0, false);
  add({{-86, -30}, {-68, 26}}, Side::kEast, 0.0, false);
  add({{-78, 36}, {-53, 56}}, Side::kSouth, 0.0, false);
  add({{57, 33}, {82, 53}}, Side::kSouth, 2.5, true);
  add({{-26, 62}, {26, 74}}, Side::kSouth, 0.0, false);
  halls_[0].turn = 0.0;  // square with the terrace
  Hall& south = halls_[2];
  south.turn *= 0.5;
  const double middle = south.area.high.x - node(17).x;
  south.passage_from = middle - 2.5;
  south.passage_to = middle + 2.5;
  bridge_ = {{south.area.high.x - 1.0, halls_[1].area.low.y + 5.0},
             {halls_[1].area.low.x + 1.0, halls_[1].area.low.y + 8.0}};
}

Vec2 Plan::node(int index) const { return scaled(kNodes[static_cast<std::size_t>(index)]); }

void Plan::lay_out_ways(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 3);
  for (const Link& link : kLinks) {
    const double bow = link.bow * random.uniform(0.5, 1.0);
    ways_.push_back({bowed_line(node(link.from), node(link.to), bow), link.half_width});
  }
  for (const std::span<const int> nodes :
       {std::span<const int>(kTourA), std::span<const int>(kTourB), std::span<const int>(kTourC)}) {
    tours_.push_back(through(nodes));
  }
  for (const std::span<const int> nodes :
       {std::span<const int>(kWalk0), std::span<const int>(kWalk1), std::span<const int>(kWalk2),
        std::span<const int>(kWalk3), std::span<const int>(kWalk4), std::span<const int>(kWalk5),
        std::span<const int>(kWalk6), std::span<const int>(kWalk7), std::span<const int>(kWalk8),
        std::span<const int>(kWalk9), std::span<const int>(kWalk10), std::span<const int>(kWalk11),
        std::span<const int>(kWalk12), std::span<const int>(kWalk13),
        std::span<const int>(kWalk14)}) {
    walks_.push_back(through(nodes));
  }
}

void Plan::lay_out_fixtures() {
  fixtures_.push_back({FixtureKind::kFountain, {0, 0}, 0.0, 2.6});
  for (int i = 0; i < 6; ++i) {
    const double angle = 2.0 * kPi * (i + 0.5) / 6;
    // Benches face away from the fountain.
    fixtures_.push_back(
        {FixtureKind::kBench, {4.4 * std::cos(angle), 4.4 * std::sin(angle)}, angle, 0.9});
  }
  for (const Vec2 at :
       {Vec2{-18.5, -14.5}, {-18.5, 13.5}, {18.5, -14.5}, {-18.5, 0.0}, {18.5, 0.0}, {7, -15.5}}) {
    fixtures_.push_back({FixtureKind::kPlanter, scaled(at), 0.0, 1.0});
  }
  const Vec2 kiosk = scaled(Vec2{17.5, 13.2});
  fixtures_.push_back({FixtureKind::kKiosk, kiosk, 0.0, 2.3});
  queue_ = {{kiosk.x - 15.0, kiosk.y - 2.3}, {kiosk.x - 2.0, kiosk.y}};
  for (const Vec2 at : {Vec2{-15.5, -3.2}, {-15.5, 3.2}, {15, -3.4}}) {
    fixtures_.push_back({FixtureKind::kStall, scaled(at), 0.5 * kPi, 1.7});
  }
}

Path Plan::through(std::span<const int> nodes) const {
  std::vector<Vec2> points;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const int from = nodes[i];
    const int to = nodes[(i + 1) % nodes.size()];
    const auto* link = std::find_if(std::begin(kLinks), std::end(kLinks), [&](const Link& l) {
      return (l.from == from && l.to == to) || (l.from == to && l.to == from);
    });
    std::vector<Vec2> way = ways_[static_cast<std::size_t>(link - std::begin(kLinks))].points;
    if (link->from != from) std::reverse(way.begin(), way.end());
    points.insert(points.end(), way.begin(), way.end() - 1);
  }
  return rounded_loop(points);
}

const Path& Plan::tour(char route) const { return tours_[static_cast<std::size_t>(route - 'A')]; }

double Plan::hills(Vec2 at) const { return hills_[0].at(at) + hills_[1].at(at) + hills_[2].at(at); }

double Plan::lift(Vec2 at) const {
  constexpr double kSeam = 1e-3;  // raised areas include their edges
  if (terrace_.contains(at, kSeam)) return kTerraceHeight;
  const auto share = [](double from, double to, double x) {
    return std::clamp((x - from) / (to - from), 0.0, 1.0);
  };
  if (ramps_[0].contains(at, kSeam)) {
    return kTerraceHeight * share(ramps_[0].low.x, ramps_[0].high.x, at.x);
  }
  if (ramps_[1].contains(at, kSeam)) {
    return kTerraceHeight * share(ramps_[1].high.x, ramps_[1].low.x, at.x);
  }
  if (stairs_.contains(at, kSeam))
    return kTerraceHeight * share(stairs_.low.y, stairs_.high.y, at.y);
  return 0.0;
}

Vec3 Plan::up(Vec2 at) const {
  constexpr double kStep = 0.4;
  const double dx = height({at.x + kStep, at.y}) - height({at.x - kStep, at.y});
  const double dy = height({at.x, at.y + kStep}) - height({at.x, at.y - kStep});
  return normalized({-dx, -dy, 2.0 * kStep});
}

double Plan::to_tours(Vec2 at) const {
  double nearest = 1e9;
  for (const Path& tour : tours_) nearest = std::min(nearest, nearest_point(tour, at));
  return nearest;
}

double Plan::to_pavement(Vec2 at) const {
  double nearest = 1e9;
  for (const Way& way : ways_) {
    if (way.half_width > 0.0) {
      nearest = std::min(nearest, nearest_point(way.points, at) - way.half_width);
    }
  }
  return nearest;
}

bool Plan::is_pavement_free(Vec2 at, double radius) const {
  constexpr double kRobotSide = 1.85;  // including a companion beside it
  constexpr double kWalkerSide = 1.3;
  if (to_pavement(at) < radius || to_tours(at) < kRobotSide + radius) return false;
  return std::all_of(walks_.begin(), walks_.end(), [&](const Path& walk) {
    return nearest_point(walk, at) > kWalkerSide + radius;
  });
}

bool Plan::is_free(Vec2 at, double radius) const {
  constexpr double kHallMargin = 0.8;  // halls are turned a little
  const auto hits = [&](const Area& area, double margin) {
    return area.contains(at, radius + margin);
  };
  const bool on_hall = std::any_of(halls_.begin(), halls_.end(),
                                   [&](const Hall& hall) { return hits(hall.area, kHallMargin); });
  if (on_hall || hits(terrace_, 0.3) || hits(ramps_[0], 0.3) || hits(ramps_[1], 0.3) ||
      hits(stairs_, 1.0) || hits(parking_, 0.5) || hits(queue_, 0.5)) {
    return false;
  }
  const bool on_fixture = std::any_of(
      fixtures_.begin(), fixtures_.end(),
      [&](const Fixture& fixture) { return norm(fixture.at - at) < fixture.radius + radius; });
  return !on_fixture && is_pavement_free(at, radius);
}

}  // namespace unimapper::simulator::campus
