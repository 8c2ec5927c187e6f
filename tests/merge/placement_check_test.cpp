// Checks of a placement: repetition, storeys, and keyframes that see different structure
#include "src/merge/placements/placement_check.hpp"

#include "src/merge/loops/link_check.hpp"
#include "src/merge/placements/roofed_share.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

constexpr double kStepM = 3.0;
constexpr std::size_t kKeyframes = 16;

/// Points 15 cm apart on walls, floors and ceilings; z is up from the sensor.
class Place {
 public:
  void add_wall(double x0, double y0, double x1, double y1, double z0 = -1.5, double z1 = 1.5) {
    const int steps = static_cast<int>(std::hypot(x1 - x0, y1 - y0) / 0.15) + 1;
    for (int i = 0; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      for (double z = z0; z < z1; z += 0.15) {
        cells_.push_back({{x0 + s * (x1 - x0), y0 + s * (y1 - y0), z}, 0});
      }
    }
  }
  void add_box(double x, double y, double length, double width, double z1 = 0.0) {
    add_wall(x, y, x + length, y, -1.5, z1);
    add_wall(x + length, y, x + length, y + width, -1.5, z1);
    add_wall(x + length, y + width, x, y + width, -1.5, z1);
    add_wall(x, y + width, x, y, -1.5, z1);
  }
  void add_level(double z, bool is_ground) {
    for (double x = -30.0; x < 80.0; x += 0.4) {
      for (double y = -8.0; y < 8.0; y += 0.4) cells_.push_back({{x, y, z}, is_ground ? 1 : 0});
    }
  }

  /// A drive along x, one keyframe every `kStepM`, by a LiDAR that sees what lies that far from
  /// straight ahead, to either side.
  [[nodiscard]] SessionData drive(std::uint64_t seed, double from_deg = 0.0,
                                  double to_deg = 180.0) const {
    Random random(seed);
    SessionData session;
    for (std::size_t k = 0; k < kKeyframes; ++k) {
      KeyframeRecord keyframe;
      const Eigen::Vector3d at(kStepM * static_cast<double>(k), 0.0, 0.0);
      keyframe.T_odometry_keyframe.translation = at;
      for (const Cell& cell : cells_) {
        const Eigen::Vector3d p = cell.position - at;
        if (p.head<2>().norm() > 25.0) continue;
        const double azimuth_deg = std::abs(std::atan2(p.y(), p.x())) * kDegreesPerRadian;
        if (azimuth_deg < from_deg || azimuth_deg > to_deg) continue;
        keyframe.static_cells.push_back({(p + random.normal3(0.01)).cast<float>(), 3,
                                         static_cast<std::uint8_t>(cell.ground), 0});
      }
      session.keyframes.push_back(std::move(keyframe));
    }
    return session;
  }

 private:
  struct Cell {
    Eigen::Vector3d position;
    int ground;
  };
  std::vector<Cell> cells_;
};

/// A corridor whose piers stand at the given distance, or at random.
Place corridor(double period_m) {
  Random random(5);
  Place place;
  place.add_level(-1.5, true);
  place.add_wall(-30.0, 5.0, 80.0, 5.0);
  place.add_wall(-30.0, -5.0, 80.0, -5.0);
  for (double x = -30.0; x<80.0; x += period_m> 0.0 ? period_m : random.uniform(2.0, 9.0)) {
    const double depth = period_m > 0.0 ? 1.5 : random.uniform(0.5, 3.0);
    place.add_box(x, 5.0 - depth, 1.0, depth, 1.5);
    if (period_m > 0.0 || random.uniform() < 0.5) place.add_box(x + 1.5, -5.0, 0.6, depth, 1.5);
  }
  return place;
}

/// Walls across the way.
Place rooms_across() {
  Place place;
  place.add_level(-1.5, true);
  for (double x = -28.0; x < 75.0; x += 9.0) place.add_wall(x, -8.0, x + 5.0, 8.0);
  return place;
}

/// A level with pillars, below a ceiling or not.
Place storey(bool has_ceiling) {
  Place place;
  place.add_level(-1.5, true);
  if (has_ceiling) place.add_level(1.5, false);
  Random pillars(9);
  for (double x = -28.0; x < 75.0; x += pillars.uniform(4.0, 9.0)) {
    place.add_box(x, pillars.uniform(-7.0, 5.0), 0.6, pillars.uniform(0.6, 2.5), 1.5);
  }
  return place;
}

/// What one keyframe in three of the query says: that it is at this keyframe of the match.
std::vector<LoopConstraint> loops_to(const std::function<std::size_t(std::size_t)>& match,
                                     std::size_t keyframes = kKeyframes) {
  std::vector<LoopConstraint> loops;
  for (std::size_t k = 0; k < keyframes; k += 3) {
    LoopConstraint& loop = loops.emplace_back();
    loop.match = {0, match(k)};
    loop.query = {1, k};
    loop.overlap = 1.0;
  }
  return loops;
}

std::vector<Pose> poses_of(const SessionData& session) {
  std::vector<Pose> poses;
  for (const auto& keyframe : session.keyframes) poses.push_back(keyframe.T_odometry_keyframe);
  return poses;
}

PlacementEvidence evaluated(const std::vector<SessionData>& sessions,
                            const std::vector<LoopConstraint>& loops,
                            const MergeConfig& config = {}, const ExcludedBeyond& beyond = {},
                            std::span<const CompetingPlacement> competing = {}) {
  const std::vector<Pose> match = poses_of(sessions[0]);
  const std::vector<Pose> query = poses_of(sessions[1]);
  KeyframeClouds clouds(sessions, config.registration, 2);
  return PlacementEvaluator(sessions, clouds, config)
      .evaluate({loops, query, match, Pose{}, beyond, competing});
}

const std::vector<LoopConstraint>& loops_all_along() {
  static const auto shared = loops_to([](std::size_t k) { return k; });
  return shared;
}

/// What two drives through two places are found to be, placed on each other.
PlacementEvidence evaluated(const Place& match, const Place& query,
                            const ExcludedBeyond& beyond = {}) {
  return evaluated({match.drive(1), query.drive(2)}, loops_all_along(), {}, beyond);
}

}  // namespace

TEST_CASE("A corridor that repeats itself is found to, one that does not is not", "[placement]") {
  const Place periodic = corridor(12.0);
  CHECK_THAT(evaluated(periodic, periodic).aliasing, Contains("loops fit as well 12 m away"));
  const PlacementEvidence distinct = evaluated(corridor(0.0), corridor(0.0));
  CHECK(distinct.aliasing.empty());
  // Radius search takes every second one, 6 m apart.
  CHECK(distinct.supporting == kKeyframes / 2);
  CHECK(distinct.contradicting == 0);
  // Known positions leave nothing but this place, or one period more.
  const PlacementEvidence placed = evaluated(periodic, periodic, {11.0, 11.0});
  CHECK(placed.aliasing.empty());
  CHECK(placed.supporting == kKeyframes / 2);
  CHECK_FALSE(evaluated(periodic, periodic, {13.0, 11.0}).aliasing.empty());
}

TEST_CASE("One thing that stands once tells a place from those that repeat it", "[placement]") {
  const auto with_kiosk = [](double x) {
    Place place = corridor(12.0);
    place.add_box(x, 1.0, 2.5, 2.0, 1.5);
    return place;
  };
  const PlacementEvidence told = evaluated(with_kiosk(22.0), with_kiosk(22.0));
  CHECK(told.aliasing.empty());
  CHECK(told.supporting == kKeyframes / 2);

  // Loops that say so put the query a period farther on.
  const CompetingPlacement competing[] = {
      {loops_to([](std::size_t k) { return k + 4; }, kKeyframes - 4), shifted(12.0)}};
  const auto against_competing = [&](const Place& match, const Place& query) {
    return evaluated({match.drive(1), query.drive(2)}, loops_all_along(), {}, {}, competing);
  };
  const PlacementEvidence excluded = against_competing(with_kiosk(22.0), with_kiosk(22.0));
  CHECK(excluded.competing_excluded == 1);
  CHECK(excluded.aliasing.empty());
  const PlacementEvidence equal = against_competing(corridor(12.0), corridor(12.0));
  CHECK(equal.competing_excluded == 0);
  CHECK_THAT(equal.aliasing, Contains("do not exclude the other placement, 12 m off"));
  // It stands a period farther on: then that one is right.
  CHECK(against_competing(with_kiosk(34.0), with_kiosk(22.0)).competing_excluded == 0);
}

TEST_CASE("What a narrow LiDAR cannot see is no contradiction", "[placement]") {
  const Place place = corridor(0.0);
  MergeConfig config;  // no pair passes as a loop
  config.loops.min_overlap = 0.95;
  const auto narrow = [&](const Place& query) {
    return evaluated({place.drive(1), query.drive(2, 0.0, 35.0)}, loops_all_along(), config);
  };
  const PlacementEvidence same = narrow(place);
  CHECK(same.supporting == kKeyframes / 2);
  CHECK(same.contradicting == 0);
  const PlacementEvidence differs = narrow(rooms_across());
  CHECK(differs.supporting == 0);
  CHECK(differs.contradicting > kKeyframes / 4);
}

TEST_CASE("Keyframes that see nothing in common do not vote", "[placement]") {
  const Place place = corridor(0.0);
  const PlacementEvidence evidence =
      evaluated({place.drive(1, 0.0, 35.0), place.drive(2, 145.0, 180.0)}, loops_all_along());
  CHECK(evidence.supporting == 0);
  CHECK(evidence.contradicting == 0);
}

TEST_CASE("A link that the scans contradict is told from one of which they know nothing",
          "[placement]") {
  const Place place = corridor(0.0);
  const auto check = [&](const Place& query, const std::optional<Pose>& pose) {
    return check_link({place.drive(1), query.drive(2)}, {{1, 6}, {0, 6}, pose}, {});
  };
  CHECK(check(place, Pose{}).is_confirmed);
  CHECK(check(place, std::nullopt).is_confirmed);
  const LinkEvidence wrong = check(rooms_across(), Pose{});
  CHECK_FALSE(wrong.is_confirmed);
  CHECK(wrong.is_contradicted);
  CHECK(wrong.seen_through > 0.5);
  CHECK_FALSE(check(rooms_across(), std::nullopt).is_confirmed);
  const LinkEvidence unknown = check_link({place.drive(1, 0.0, 35.0), place.drive(2, 145.0, 180.0)},
                                          {{1, 6}, {0, 6}, Pose{}}, {});
  CHECK_FALSE(unknown.is_confirmed);
  CHECK_FALSE(unknown.is_contradicted);
}

TEST_CASE("Keyframes are compared only as far from a loop as odometry is sure", "[placement]") {
  const Place place = corridor(0.0);
  const std::vector<SessionData> sessions{place.drive(1), place.drive(2)};
  const auto supporting = [&](const MergeConfig& config) {
    return evaluated(sessions, {loops_all_along()[0]}, config).supporting;
  };
  MergeConfig config;
  CHECK(supporting(config) == kKeyframes / 2);
  // Both sessions together: 1 m after 3.5 m of path.
  config.odometry.translation_m_per_sqrt_m = std::sqrt(0.5 / 3.5);
  CHECK(supporting(config) == 1);
  config.odometry.translation_m_per_sqrt_m = std::sqrt(0.5 / 6.5);
  CHECK(supporting(config) == 2);
}

TEST_CASE("Below a ceiling a place whose contents differ may be another storey", "[placement]") {
  const auto with_cars = [](bool has_ceiling, std::uint64_t cars) {
    Place place = storey(has_ceiling);
    Random random(cars);
    for (double x = -28.0; x < 75.0; x += random.uniform(5.0, 9.0)) {
      for (const double y : {-3.5, 1.7}) {
        if (random.uniform() < 0.5) place.add_box(x, y, 4.2, 1.8, 0.3);
      }
    }
    return place;
  };
  CHECK_THAT(evaluated(with_cars(true, 3), with_cars(true, 4)).aliasing,
             Contains("below a ceiling it may be another storey"));
  CHECK(evaluated(with_cars(true, 3), with_cars(true, 3)).aliasing.empty());
  CHECK(evaluated(with_cars(false, 3), with_cars(false, 4)).aliasing.empty());
}

TEST_CASE("Below a ceiling a few things that were moved are no other storey", "[placement]") {
  const auto with_moved = [](double moved_share) {
    Place place = storey(true);
    Random random(3);
    Random moved(4);
    for (double x = -28.0; x < 75.0; x += random.uniform(5.0, 9.0)) {
      for (const double y : {-3.5, 1.7}) {
        const bool stood = random.uniform() < 0.5;
        const bool is_moved = moved.uniform() < moved_share;
        if (stood != is_moved) place.add_box(x, y, 2.0, 1.8, 0.3);
      }
    }
    return place;
  };
  // Where two fifths were moved, 12 % of the structure differ and 5 % stand during one visit alone,
  // which is too much already.
  CHECK(evaluated(with_moved(0.0), with_moved(0.3)).aliasing.empty());
  CHECK_THAT(evaluated(with_moved(0.0), with_moved(0.7)).aliasing,
             Contains("may be another storey"));
}

TEST_CASE("Below a ceiling furniture tells where a robot left a lift", "[placement][slow]") {
  const auto furnished = [](std::uint64_t furniture, bool has_ceiling) {
    Place place = corridor(0.0);
    if (has_ceiling) place.add_level(1.5, false);
    Random random(furniture);
    for (double x = -28.0; x < 75.0; x += random.uniform(4.0, 8.0)) {
      place.add_box(x, random.uniform() < 0.5 ? -4.9 : 4.2, 1.0, 0.7, -0.7);
    }
    return place;
  };
  // The second session begins `gap_s` after the first one ended, where its odometry was.
  const auto after_lift = [](const Place& before, const Place& after, double gap_s = 20.0) {
    std::vector<SessionData> sessions = {before.drive(1), after.drive(2)};
    std::reverse(sessions[0].keyframes.begin(), sessions[0].keyframes.end());
    std::int64_t stamp_ns = 0;
    for (SessionData& session : sessions) {
      for (KeyframeRecord& keyframe : session.keyframes) {
        keyframe.scans.push_back({0, stamp_ns += 1'000'000'000, keyframe.T_odometry_keyframe});
      }
      stamp_ns += static_cast<std::int64_t>((gap_s - 1.0) * 1e9);
    }
    return evaluated(sessions, loops_to([](std::size_t k) { return kKeyframes - 1 - k; })).aliasing;
  };
  CHECK_THAT(after_lift(furnished(3, true), furnished(4, true)), Contains("in one session alone"));
  CHECK(after_lift(furnished(3, true), furnished(3, true)).empty());
  CHECK(after_lift(furnished(3, false), furnished(4, false)).empty());
  // On another day anybody may have moved them.
  CHECK(after_lift(furnished(3, true), furnished(4, true), 86'400.0).empty());
}

TEST_CASE("Walls that lie beside those of the other session are of another place", "[placement]") {
  // Rooms along a corridor; in the other place every third one is half a metre deeper.
  const auto rooms = [](double deeper_m) {
    Place place = corridor(0.0);
    int room = 0;
    for (double x = -28.0; x < 75.0; x += 7.0) {
      const double depth = 9.0 + (room++ % 3 == 0 ? deeper_m : 0.0);
      place.add_wall(x, depth, x + 6.0, depth);
      place.add_wall(x, -depth, x + 6.0, -depth);
    }
    return place;
  };
  const PlacementEvidence same = evaluated(rooms(0.0), rooms(0.0));
  CHECK(same.aliasing.empty());
  CHECK(same.supporting > 0);
  CHECK_THAT(evaluated(rooms(0.0), rooms(0.5)).aliasing, Contains("the walls do not fit"));
}

TEST_CASE("The roofed share is that of ground below structure", "[placement]") {
  Place place;
  CHECK(roofed_share(KeyframeRecord{}) == 0.0);
  place.add_level(-1.5, true);
  CHECK(roofed_share(place.drive(1).keyframes[4]) == 0.0);
  place.add_level(1.5, false);
  CHECK(roofed_share(place.drive(1).keyframes[4]) > 0.95);
}
