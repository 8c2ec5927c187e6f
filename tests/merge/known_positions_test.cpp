// Tests of alignment with known positions of keyframes.
#include "src/merge/graph/site_origin.hpp"
#include "tests/merge/ambiguous_scene.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/user_statements.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

const Pose kSite = yaw_pose(1.0, {2000.0, -300.0, 45.0});

/// A scene whose keyframes have positions.
struct Site : Scene {
  Random random;

  explicit Site(std::uint64_t seed) : random(seed) {}
  /// Two maps with true loops.
  Site(std::uint64_t seed, std::size_t true_loops) : random(seed) {
    static_cast<Scene&>(*this) = two_maps(random);
    add_true_loops(*this, true_loops, random);
  }

  [[nodiscard]] Eigen::Vector3d in_site(KeyframeId k) const {
    return kSite * truth[k.session][k.keyframe].translation;
  }
  /// A position as satellites give it, `off` beside the truth.
  void add_position(KeyframeId k, double sigma_m,
                    const Eigen::Vector3d& off = Eigen::Vector3d::Zero()) {
    KnownPosition& position = sessions[k.session].positions.emplace_back();
    position.keyframe = k;
    position.position = in_site(k) + off + random.normal3(sigma_m);
    position.sigma_xy_m = position.sigma_z_m = sigma_m;
  }
  void add_positions(std::size_t session, std::size_t step, double sigma_m) {
    for (std::size_t k = 0; k < truth[session].size(); k += step) {
      add_position({session, k}, sigma_m);
    }
  }
  void add_height(KeyframeId k, double sigma_m) {
    KnownPosition& position = sessions[k.session].positions.emplace_back();
    position.keyframe = k;
    position.position = {0.0, 0.0, in_site(k).z()};
    position.sigma_z_m = sigma_m;
  }
  /// Largest distance of a keyframe of the session from where it is in the site.
  [[nodiscard]] double error_m(const Alignment& alignment, std::size_t session) const {
    double error = 0.0;
    for (std::size_t k = 0; k < truth[session].size(); ++k) {
      error = std::max(error, (found(alignment, {session, k}) - in_site({session, k})).norm());
    }
    return error;
  }
  [[nodiscard]] static Eigen::Vector3d found(const Alignment& alignment, KeyframeId k) {
    return alignment.T_map_site->inverse() * alignment.T_map_keyframe(k).translation;
  }
};

std::size_t used(const Alignment& alignment) {
  return static_cast<std::size_t>(
      std::count_if(alignment.positions.begin(), alignment.positions.end(),
                    [](const PositionOutcome& position) { return position.used; }));
}

/// Two sessions on decks 3 m above each other, or on one; loops say that they are on one.
Site decks(double height_m, std::uint64_t seed) {
  Site site(seed);
  static_cast<Scene&>(site) = beside_each_other({60, 60});
  site.truth = {straight(60), straight(60)};
  for (Pose& pose : site.truth[1]) pose.translation.z() += height_m;
  for (std::size_t k = 0; k < 60; k += 2) loop(site, {1, k}, {0, k}, Pose{}, site.random);
  return site;
}

/// The sensor data cannot tell storeys apart; what positions exclude is no alternative.
PlacementEvidence may_be_another_storey(const Placement& placement) {
  const bool is_excluded = placement.beyond.excludes({0.0, 0.0, 2.5});
  return {5, 0, is_excluded ? "" : "below a ceiling it may be another storey"};
}

}  // namespace

TEST_CASE("Positions place the map and straighten it", "[positions]") {
  Site site(5, 10);
  site.add_positions(0, 10, 0.3);
  site.add_positions(1, 10, 0.3);
  const Alignment alignment = align(site);
  REQUIRE(alignment.connected[1]);
  REQUIRE(alignment.T_map_site);
  CHECK(used(alignment) >= alignment.positions.size() - 1);
  CHECK(site.error_m(alignment, 0) < 1.0);
  CHECK(site.error_m(alignment, 1) < 1.0);
  CHECK(trajectory_error_m(site.truth[0], site.sessions[0].T_odometry_keyframe) > 1.5);
  CHECK(alignment.heading_information > 1e6);
  // Refinement starts from where the alignment ended, and keeps it.
  const Alignment refined = refine_alignment(alignment, site.sessions, site.loops, MergeConfig{});
  REQUIRE(refined.T_map_site);
  CHECK(used(refined) == used(alignment));
  CHECK(site.error_m(refined, 1) < 1.0);
}

TEST_CASE("Positions of one session place the other one, too", "[positions]") {
  Site site(6, 10);
  site.add_positions(1, 10, 0.3);
  const Alignment alignment = align(site);
  REQUIRE(alignment.connected[1]);
  REQUIRE(alignment.T_map_site);
  CHECK(site.error_m(alignment, 1) < 1.0);
}

TEST_CASE("A wrong position is rejected with the distance and deforms nothing", "[positions]") {
  const double off_m = GENERATE(5.0, 30.0, 3000.0);
  Site site(7, 10);
  site.add_positions(0, 20, 0.3);
  const Alignment without = align(site);
  site.add_position({0, 150}, 0.01, {0.0, off_m, 0.0});
  const Alignment with = align(site);
  const auto wrong = std::find_if(with.positions.begin(), with.positions.end(), [](const auto& p) {
    return p.given.keyframe == KeyframeId{0, 150};
  });
  REQUIRE(wrong != with.positions.end());
  CHECK_FALSE(wrong->used);
  CHECK_THAT(wrong->reason, Contains("m off the others"));
  CHECK(used(with) == used(without));
  CHECK(site.error_m(with, 0) == Approx(site.error_m(without, 0)).margin(0.01));
}

TEST_CASE("Positions of which no majority agrees are not used", "[positions]") {
  Site site(8, 10);
  site.add_position({0, 100}, 0.1);
  site.add_position({0, 110}, 0.1, {0.0, 0.0, 8.0});
  const Alignment alignment = align(site);
  CHECK(alignment.connected[1]);
  CHECK_FALSE(alignment.T_map_site);
  for (const PositionOutcome& position : alignment.positions) {
    CHECK(position.reason == "the positions of the session contradict each other");
  }
}

TEST_CASE("Of two positions that contradict each other neither is used, others are",
          "[positions]") {
  Site site(8, 10);
  site.add_position({0, 100}, 0.1);
  site.add_position({0, 110}, 0.1, {0.0, 40.0, 0.0});
  site.add_height({0, 105}, 0.1);
  const Alignment alignment = align(site);
  REQUIRE(alignment.T_map_site);
  CHECK(used(alignment) == 1);
  CHECK(alignment.positions[2].used);
  CHECK(alignment.positions[0].reason ==
        "contradicts another one, and nothing tells which is wrong");
}

TEST_CASE("One position places the map and leaves its heading to odometry", "[positions]") {
  Site site(9, 10);
  site.add_position({0, 100}, 0.1);
  const Alignment alignment = align(site);
  REQUIRE(alignment.T_map_site);
  CHECK(alignment.heading_information < 1e-6);
  CHECK((Site::found(alignment, {0, 100}) - site.in_site({0, 100})).norm() < 0.5);
  CHECK(rotation_angle(alignment.T_map_site->rotation) < 1e-3);
}

TEST_CASE("Positions on a straight line determine all but the tilt about it", "[positions]") {
  Site site(10);
  static_cast<Scene&>(site) = tunnel(site.random);
  for (std::size_t k = 0; k < 36; k += 3) {
    loop(site, {1, k}, {0, k}, site.truth[0][k].inverse() * site.truth[1][k], site.random);
  }
  site.add_positions(0, 5, 0.05);
  const Alignment alignment = align(site, {}, may_be_another_storey);
  REQUIRE(alignment.T_map_site);
  CHECK(site.error_m(alignment, 0) < 0.5);
  const Pose T_site_first = alignment.T_map_site->inverse() * alignment.T_map_keyframe({0, 0});
  CHECK(T_site_first.rotation.col(2).z() > std::cos(0.02));
}

TEST_CASE("Heights tell decks apart that look alike, if they are known well", "[positions]") {
  struct Decks {
    double height_m, sigma_m;
    PairState state;
  };
  const auto [height_m, sigma_m, state] =
      GENERATE(Decks{0.0, 0.0, PairState::kProvisional}, Decks{0.0, 2.0, PairState::kProvisional},
               Decks{0.0, 0.2, PairState::kConfirmed}, Decks{3.0, 0.2, PairState::kRefused});
  INFO(height_m << " m apart, heights known to " << sigma_m << " m");
  Site site = decks(height_m, 11);
  if (sigma_m > 0.0) {
    site.add_height({0, 10}, sigma_m);
    site.add_height({1, 12}, sigma_m);
  }
  const Alignment alignment = align(site, {}, may_be_another_storey);
  CHECK(alignment.pairs[0].state == state);
  CHECK(alignment.connected[1] == (state == PairState::kConfirmed));
  if (state == PairState::kConfirmed) {
    REQUIRE(alignment.T_map_site);
    CHECK(std::abs(Site::found(alignment, {1, 12}).z() - 45.0) < 0.5);
  } else if (state == PairState::kRefused) {
    const std::string begins =
        "30 of 30 loops contradict the known positions of both sessions, by ";
    CHECK_THAT(alignment.reason[1], Contains(begins + "2") || Contains(begins + "3"));
    CHECK(alignment.pairs[0].loops == 30);
  }
}

TEST_CASE("Streets that look alike stay apart where positions say so", "[positions]") {
  Site site(12, 0);
  add_aliased_loops(site, 10, site.random);
  CHECK(align(site).pairs[0].state == PairState::kProvisional);
  for (const std::size_t session : {0U, 1U}) site.add_positions(session, 20, 1.0);
  const Alignment alignment = align(site);
  CHECK_FALSE(alignment.connected[1]);
  CHECK(alignment.pairs[0].state == PairState::kRefused);
  CHECK_THAT(alignment.reason[1], Contains("contradict the known positions of both sessions, by"));
}

TEST_CASE("Positions find the true loops among more that look alike", "[positions]") {
  Site site(13, 5);
  add_aliased_loops(site, 12, site.random);
  CHECK_FALSE(align(site).connected[1]);
  for (const std::size_t session : {0U, 1U}) site.add_positions(session, 20, 1.0);
  const Alignment alignment = align(site);
  REQUIRE(alignment.connected[1]);
  CHECK(site.error_m(alignment, 1) < 3.0);
  for (std::size_t i = 5; i < site.loops.size(); ++i) {
    CHECK(alignment.decisions[i].reason == "contradicts the known positions");
  }
}

TEST_CASE("Positions stand for the sensor data where loops lie in one place", "[positions]") {
  Site site = decks(0.0, 14);
  std::erase_if(site.loops, [](const LoopConstraint& l) { return l.query.keyframe > 10; });
  CHECK(align(site).pairs[0].state == PairState::kProvisional);
  for (const std::size_t session : {0U, 1U}) site.add_positions(session, 4, 0.3);
  CHECK(align(site).connected[1]);
}

TEST_CASE("A position of a keyframe that is not there is refused", "[positions]") {
  Site site = decks(0.0, 15);
  site.add_position({0, 10}, 0.1);
  for (const KeyframeId missing : {KeyframeId{0, 60}, KeyframeId{1, 0}}) {
    site.sessions[0].positions[0].keyframe = missing;
    CHECK_THROWS_WITH(align(site), Contains("position of a keyframe that does not exist"));
  }
}

TEST_CASE("Large coordinates are counted from an origin of whole kilometres", "[positions]") {
  KnownPosition position;
  position.position = {691234.5, 5335678.9, 512.0};
  position.sigma_xy_m = 1.0;
  KnownPosition height;
  height.position = {3e7, 3e7, 12.0};
  const KnownPosition given[] = {height, position};
  CHECK(site_origin(given) == Eigen::Vector3d(691000.0, 5336000.0, 0.0));
  position.position = {1234.5, -9999.0, 12.0};
  CHECK(site_origin({&position, 1}) == Eigen::Vector3d::Zero());
}
