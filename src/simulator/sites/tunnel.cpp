// Road tunnel: a vault that looks alike everywhere, traffic in both lanes; and twin tubes that look
// exactly alike, bare or with fixtures at one distance.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"

namespace unimapper::simulator::sites::tunnel {
namespace {

constexpr double kLane = 1.9;        // metres from the centre line to the middle of a lane
constexpr double kHalfRoad = 3.9;    // to the kerb
constexpr double kHalfTunnel = 4.9;  // to the wall
constexpr double kKerb = 0.18;
constexpr double kSpringing = 3.0;  // height at which the vault begins
constexpr double kStep = 2.0;       // metres between cross-sections

/// Ring with one lane outside and one inside its centre line; bent more here than there.
Path ring(double radius, double bend, double offset) {
  std::vector<Vec2> points;
  constexpr int kParts = 720;
  for (int i = 0; i < kParts; ++i) {
    const double angle = 2.0 * kPi * i / kParts;
    const double r = radius * (1.0 + bend * std::cos(2.0 * angle)) + offset;
    points.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return {std::move(points), true};
}

struct Shape {
  double radius, bend, height;
  int bays = 0;       ///< sections of a tube that are exactly alike; 0: it differs along itself
  bool bare = false;  ///< without fittings
};

/// What `make_plan` and the rest are made for.
enum class Kind : std::uint8_t { kTunnel, kBore, kFixtures };

/// Metres between fixtures: 25 if the seed is odd, else 15 to 35.
double period_of(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 10);
  return seed % 2 == 1 ? 25.0 : 15.0 + 2.5 * random.index(9);
}

Shape shape_of(std::uint64_t seed, Kind kind) {
  Random random(seed, Stream::kPlan, 6);
  Shape shape{random.uniform(100.0, 150.0), random.uniform(0.02, 0.08), random.uniform(4.8, 6.2)};
  if (kind == Kind::kTunnel) return shape;
  // A circle of whole periods: turned by one, it is the same.
  const double period = period_of(seed);
  shape.bays = static_cast<int>(std::lround(2.0 * kPi * shape.radius / period));
  shape.radius = shape.bays * period / (2.0 * kPi);
  shape.bend = 0.0;
  shape.bare = kind == Kind::kBore;
  return shape;
}

void make_plan(const Shape& shape, Plan& plan) {
  // Counter-clockwise, right-hand traffic: the robot's lane is the outer one.
  Path lane = ring(shape.radius, shape.bend, kLane);
  const double length = lane.length();
  plan.lanes.push_back(lane);
  plan.lanes.push_back(ring(shape.radius, shape.bend, -kLane).reversed());
  plan.set_tours(std::move(lane), 10.0, 60.0, length - 100.0);
  // Route C is the other direction, in the other lane.
  plan.tours[2] = plan.lanes[1];
  plan.robot = {12.0, 1.5, 1.9, 0.2, 1.5, 0.0};
}

/// Cross-section from the left kerb over the vault to the right one: offset and height.
std::vector<Vec2> profile(double height) {
  std::vector<Vec2> points{{-kHalfRoad, 0.0}, {-kHalfRoad, kKerb}, {-kHalfTunnel, kKerb}};
  constexpr int kParts = 12;
  for (int i = 0; i <= kParts; ++i) {
    const double angle = kPi * (1.0 - static_cast<double>(i) / kParts);
    points.push_back(
        {kHalfTunnel * std::cos(angle), kSpringing + (height - kSpringing) * std::sin(angle)});
  }
  points.insert(points.end(),
                {{kHalfTunnel, kKerb}, {kHalfRoad, kKerb}, {kHalfRoad, 0.0}, {-kHalfRoad, 0.0}});
  return points;
}

void add_tube(const Path& centre, const Shape& shape, Site& site) {
  const std::vector<Vec2> section = profile(shape.height);
  const int bays = std::max(shape.bays, 1);
  const int parts = bays * static_cast<int>(centre.length() / kStep / bays);
  const auto at = [&](int part, Vec2 p) {
    const double s = centre.length() * part / parts;
    const Vec2 xy = centre.at(s) - p.x * left_of(centre.heading(s));
    return Vec3{xy.x, xy.y, p.y};
  };
  for (int part = 0; part < parts; ++part) {
    for (std::size_t k = 0; k + 1 < section.size(); ++k) {
      Surface surface = Surface::kConcrete;
      if (k + 2 == section.size()) surface = Surface::kRoad;
      if (k < 2 || (k + 4 >= section.size() && k + 2 < section.size())) surface = Surface::kKerb;
      site.mesh.quad(at(part, section[k]), at(part + 1, section[k]), at(part + 1, section[k + 1]),
                     at(part, section[k + 1]), surface);
    }
  }
}

/// Lamps, fans, cable ducts and emergency cabinets; where the tube has bays, one of each a bay.
void add_fittings(const Path& centre, const Shape& shape, Random& random, Site& site) {
  const double height = shape.height;
  const double period = shape.bays == 0 ? 0.0 : centre.length() / shape.bays;
  const auto distance = [&](double low, double high) {
    return shape.bays == 0 ? random.uniform(low, high) : period;
  };
  const auto first = [&](double s) { return shape.bays == 0 ? s : std::fmod(s, period); };
  const auto frame_at = [&](double s) {
    const Vec2 at = centre.at(s);
    return upright_frame({at.x, at.y, 0.0}, centre.heading(s));
  };
  for (double s = first(0.0); s < centre.length(); s += shape.bays == 0 ? 10.0 : period) {
    const Frame frame = frame_at(s);
    for (const double y : {-2.0, 2.0}) {
      site.mesh.box(frame, {-0.6, y - 0.12, height - 0.75}, {0.6, y + 0.12, height - 0.6},
                    Surface::kCabinet);
    }
  }
  for (double s = first(20.0); s < centre.length(); s += distance(70.0, 120.0)) {
    const Frame frame = frame_at(s);
    site.mesh.tube(frame({-1.2, 0, height - 0.55}), frame({1.2, 0, height - 0.55}), 0.35, 0.35, 12,
                   Surface::kCabinet);
  }
  for (double s = first(5.0); s < centre.length(); s += distance(35.0, 60.0)) {
    const Frame frame = frame_at(s);
    const double side = random.chance(0.5) || shape.bays > 0 ? 1.0 : -1.0;
    const double wall = side * (kHalfTunnel - 0.2);
    site.mesh.box(frame, {-0.4, wall - 0.2, kKerb}, {0.4, wall + 0.2, 1.6}, Surface::kCabinet);
    site.mesh.box(frame, {-0.25, wall - 0.15, 2.3}, {-0.21, wall + 0.15, 2.7}, Surface::kSign);
  }
}

Site build(std::uint64_t seed, Kind kind) {
  Site site;
  build_prototypes(seed, site.prototypes);
  const Shape shape = shape_of(seed, kind);
  make_plan(shape, site.plan);
  const Path centre = ring(shape.radius, shape.bend, 0.0);
  add_tube(centre, shape, site);
  Random random(seed, Stream::kFurniture, 6);
  if (!shape.bare) add_fittings(centre, shape, random, site);
  return site;
}

void add_vehicle(const Path& lane, double s, double speed, std::size_t ticks, Random& random,
                 ActorSet& set) {
  Actor actor;
  const double kind = random.uniform();
  actor.kind = kind < 0.7 ? ActorKind::kCar : (kind < 0.9 ? ActorKind::kVan : ActorKind::kBus);
  actor.variant = random.index(9);
  actor.path = &lane;
  const double phase = random.uniform(0.0, 2.0 * kPi);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double t = Actors::time_of(tick);
    actor.travelled.push_back(static_cast<float>(s + speed * t + 0.8 * std::sin(0.3 * t + phase)));
  }
  set.actors.push_back(std::move(actor));
}

ActorSet simulate_tunnel(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kTraffic, visit.day, 6);
  const std::size_t ticks = tick_count(visit.duration_s);
  const std::size_t own = visit.route == 'C' ? 1 : 0;
  const double speed = robot.speed(0.0);
  const Path& lane = plan.lanes[own];
  const double here = robot.travelled(0.0);
  for (double s = here + random.uniform(18.0, 35.0); s < here + lane.length() - 40.0;
       s += random.uniform(25.0, 80.0)) {
    add_vehicle(lane, s, speed, ticks, random, set);
  }
  const Path& opposite = plan.lanes[1 - own];
  const double fast = speed * random.uniform(0.8, 1.2);
  for (double s = 0.0; s < opposite.length() - 20.0; s += random.uniform(25.0, 90.0)) {
    add_vehicle(opposite, s, fast, ticks, random, set);
  }
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::tunnel

namespace unimapper::simulator {

namespace {

std::unique_ptr<Scene> make_tube(const Visit& visit, sites::tunnel::Kind kind) {
  const auto build = [kind](std::uint64_t seed, std::uint32_t /*day*/) {
    return sites::tunnel::build(seed, kind);
  };
  return sites::make_site_scene(visit, build, sites::tunnel::simulate_tunnel);
}

std::unique_ptr<Scene> make_twin_tubes(const Visit& visit, sites::tunnel::Kind kind) {
  Frame beside;
  beside.origin.x = 400.0;
  return make_original_or_copy(visit, beside,
                               [kind](const Visit& place) { return make_tube(place, kind); });
}

}  // namespace

std::unique_ptr<Scene> make_tunnel_scene(const Visit& visit) {
  return make_tube(visit, sites::tunnel::Kind::kTunnel);
}

std::unique_ptr<Scene> make_bore_scene(const Visit& visit) {
  return make_twin_tubes(visit, sites::tunnel::Kind::kBore);
}

std::unique_ptr<Scene> make_fixtures_scene(const Visit& visit) {
  return make_twin_tubes(visit, sites::tunnel::Kind::kFixtures);
}

}  // namespace unimapper::simulator
