// Tests of alignment with known positions of keyframes.
#include <algorithm>
#include <catch2/catch.hpp>

#include "src/merge/site_origin.hpp"
#include "tests/merge/alignment_scene.hpp"
#include "tests/merge/ambiguous_scene.hpp"
#include "unimapper/merge/known_position.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

const Pose kSite = yaw_pose(1.0, {2000.0, -300.0, 45.0});

Eigen::Vector3d in_site(const Scene& scene, KeyframeId k) {
  return kSite * scene.truth[k.session][k.keyframe].translation;
}

/// A position as satellites give it, `off` beside the truth.
void add_position(Scene& scene, KeyframeId k, double sigma_m, Random& random,
                  const Eigen::Vector3d& off = Eigen::Vector3d::Zero()) {
  KnownPosition position;
  position.keyframe = k;
  position.position = in_site(scene, k) + off + random.normal3(sigma_m);
  position.sigma_xy_m = position.sigma_z_m = sigma_m;
  scene.sessions[k.session].positions.push_back(position);
}

void add_positions(Scene& scene, std::uint32_t session, std::size_t step, double sigma_m,
                   Random& random) {
  for (std::size_t k = 0; k < scene.truth[session].size(); k += step) {
    add_position(scene, {session, k}, sigma_m, random);
  }
}

void add_height(Scene& scene, KeyframeId k, double sigma_m) {
  KnownPosition position;
  position.keyframe = k;
  position.position = {0.0, 0.0, in_site(scene, k).z()};
  position.sigma_z_m = sigma_m;
  scene.sessions[k.session].positions.push_back(position);
}

Alignment aligned(const Scene& scene, const PlacementCheck& check = {}) {
  return align_sessions(scene.sessions, scene.loops, MergeConfig{}, check);
}

/// Largest distance of a keyframe of the session from where it is in the site.
double site_error_m(const Scene& scene, const Alignment& alignment, std::uint32_t session) {
  double error = 0.0;
  for (std::size_t k = 0; k < scene.truth[session].size(); ++k) {
    const Eigen::Vector3d found =
        alignment.T_map_site->inverse() * alignment.T_map_keyframe({session, k}).translation;
    error = std::max(error, (found - in_site(scene, {session, k})).norm());
  }
  return error;
}

std::size_t used(const Alignment& alignment) {
  return static_cast<std::size_t>(
      std::count_if(alignment.positions.begin(), alignment.positions.end(),
                    [](const PositionOutcome& position) { return position.used; }));
}

/// Two sessions on decks 3 m above each other, or on one; loops say that they are on one.
Scene decks(double height_m, Random& random) {
  Scene scene;
  std::vector<Pose> second = straight(60);
  for (Pose& pose : second) pose.translation.z() += height_m;
  scene.truth = {straight(60), second};
  scene.sessions = {{straight(60), 1.0}, {straight(60), 0.5}};
  for (std::size_t k = 0; k < 60; k += 2) loop(scene, {1, k}, {0, k}, Pose{}, random);
  return scene;
}

/// The sensor data cannot tell storeys apart; what positions exclude is no alternative.
PlacementEvidence may_be_another_storey(const Placement& placement) {
  const bool is_excluded = placement.beyond.excludes({0.0, 0.0, 2.5});
  return {5, 0, is_excluded ? "" : "below a ceiling it may be another storey"};
}

}  // namespace

TEST_CASE("Positions place the map and straighten it", "[positions]") {
  Random random(5);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  add_positions(scene, 0, 10, 0.3, random);
  add_positions(scene, 1, 10, 0.3, random);
  const Alignment alignment = aligned(scene);
  REQUIRE(alignment.connected[1]);
  REQUIRE(alignment.T_map_site);
  CHECK(used(alignment) >= alignment.positions.size() - 1);
  CHECK(site_error_m(scene, alignment, 0) < 1.0);
  CHECK(site_error_m(scene, alignment, 1) < 1.0);
  CHECK(trajectory_error_m(scene.truth[0], scene.sessions[0].T_odometry_keyframe) > 1.5);
  CHECK(alignment.heading_information > 1e6);
  // Refinement starts from where the alignment ended, and keeps it.
  const Alignment refined = refine_alignment(alignment, scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(refined.T_map_site);
  CHECK(used(refined) == used(alignment));
  CHECK(site_error_m(scene, refined, 1) < 1.0);
}

TEST_CASE("Positions of one session place the other one, too", "[positions]") {
  Random random(6);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  add_positions(scene, 1, 10, 0.3, random);
  const Alignment alignment = aligned(scene);
  REQUIRE(alignment.connected[1]);
  REQUIRE(alignment.T_map_site);
  CHECK(site_error_m(scene, alignment, 1) < 1.0);
}

TEST_CASE("A wrong position is rejected with the distance and deforms nothing", "[positions]") {
  for (const double off_m : {5.0, 30.0, 3000.0}) {
    Random random(7);
    Scene scene = two_maps(random);
    add_true_loops(scene, 10, random);
    add_positions(scene, 0, 20, 0.3, random);
    const Alignment without = aligned(scene);
    add_position(scene, {0, 150}, 0.01, random, {0.0, off_m, 0.0});
    const Alignment with = aligned(scene);
    const auto wrong =
        std::find_if(with.positions.begin(), with.positions.end(), [](const PositionOutcome& p) {
          return p.given.keyframe == KeyframeId{0, 150};
        });
    REQUIRE(wrong != with.positions.end());
    CHECK_FALSE(wrong->used);
    CHECK_THAT(wrong->reason, Contains("m off the others"));
    CHECK(used(with) == used(without));
    CHECK(site_error_m(scene, with, 0) == Approx(site_error_m(scene, without, 0)).margin(0.01));
  }
}

TEST_CASE("Positions of which no majority agrees are not used", "[positions]") {
  Random random(8);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  add_position(scene, {0, 100}, 0.1, random);
  add_position(scene, {0, 110}, 0.1, random, {0.0, 0.0, 8.0});
  const Alignment alignment = aligned(scene);
  CHECK(alignment.connected[1]);
  CHECK_FALSE(alignment.T_map_site);
  for (const PositionOutcome& position : alignment.positions) {
    CHECK(position.reason == "the positions of the session contradict each other");
  }
}

TEST_CASE("Of two positions that contradict each other neither is used, others are",
          "[positions]") {
  Random random(8);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  add_position(scene, {0, 100}, 0.1, random);
  add_position(scene, {0, 110}, 0.1, random, {0.0, 40.0, 0.0});
  add_height(scene, {0, 105}, 0.1);
  const Alignment alignment = aligned(scene);
  REQUIRE(alignment.T_map_site);
  CHECK(used(alignment) == 1);
  CHECK(alignment.positions[2].used);
  CHECK(alignment.positions[0].reason ==
        "contradicts another one, and nothing tells which is wrong");
}

TEST_CASE("One position places the map and leaves its heading to odometry", "[positions]") {
  Random random(9);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  add_position(scene, {0, 100}, 0.1, random);
  const Alignment alignment = aligned(scene);
  REQUIRE(alignment.T_map_site);
  CHECK(alignment.heading_information < 1e-6);
  const Eigen::Vector3d found =
      alignment.T_map_site->inverse() * alignment.T_map_keyframe({0, 100}).translation;
  CHECK((found - in_site(scene, {0, 100})).norm() < 0.5);
  CHECK(rotation_angle(alignment.T_map_site->rotation) < 1e-3);
}

TEST_CASE("Positions on a straight line determine all but the tilt about it", "[positions]") {
  Random random(10);
  Scene scene = tunnel(random);
  for (std::size_t k = 0; k < 36; k += 3) {
    loop(scene, {1, k}, {0, k}, scene.truth[0][k].inverse() * scene.truth[1][k], random);
  }
  add_positions(scene, 0, 5, 0.05, random);
  const Alignment alignment = aligned(scene, may_be_another_storey);
  REQUIRE(alignment.T_map_site);
  CHECK(site_error_m(scene, alignment, 0) < 0.5);
  const Pose T_site_map = alignment.T_map_site->inverse();
  const Pose T_site_first = T_site_map * alignment.T_map_keyframe({0, 0});
  CHECK(T_site_first.rotation.col(2).z() > std::cos(0.02));
}

TEST_CASE("Heights tell decks apart that look alike", "[positions]") {
  Random random(11);
  SECTION("without heights the pair waits") {
    const Alignment alignment = aligned(decks(0.0, random), may_be_another_storey);
    CHECK_FALSE(alignment.connected[1]);
    CHECK(alignment.pairs[0].state == PairState::kProvisional);
  }
  SECTION("on one deck it is confirmed") {
    Scene scene = decks(0.0, random);
    add_height(scene, {0, 10}, 0.2);
    add_height(scene, {1, 12}, 0.2);
    const Alignment alignment = aligned(scene, may_be_another_storey);
    CHECK(alignment.connected[1]);
    REQUIRE(alignment.T_map_site);
    const Eigen::Vector3d found =
        alignment.T_map_site->inverse() * alignment.T_map_keyframe({1, 12}).translation;
    CHECK(std::abs(found.z() - 45.0) < 0.5);
  }
  SECTION("on two decks it is refused") {
    Scene scene = decks(3.0, random);
    add_height(scene, {0, 10}, 0.2);
    add_height(scene, {1, 12}, 0.2);
    const Alignment alignment = aligned(scene, may_be_another_storey);
    CHECK_FALSE(alignment.connected[1]);
    CHECK(alignment.pairs[0].state == PairState::kRefused);
    CHECK_THAT(
        alignment.reason[1],
        Contains("30 of 30 loops contradict the known positions of both sessions, by 2") ||
            Contains("30 of 30 loops contradict the known positions of both sessions, by 3"));
    CHECK(alignment.pairs[0].loops == 30);
  }
  SECTION("heights that are not known well enough tell nothing") {
    Scene scene = decks(0.0, random);
    add_height(scene, {0, 10}, 2.0);
    add_height(scene, {1, 12}, 2.0);
    CHECK_FALSE(aligned(scene, may_be_another_storey).connected[1]);
  }
}

TEST_CASE("Streets that look alike stay apart where positions say so", "[positions]") {
  Random random(12);
  Scene scene = two_maps(random);
  add_aliased_loops(scene, 10, random);
  CHECK(aligned(scene).pairs[0].state == PairState::kProvisional);
  add_positions(scene, 0, 20, 1.0, random);
  add_positions(scene, 1, 20, 1.0, random);
  const Alignment alignment = aligned(scene);
  CHECK_FALSE(alignment.connected[1]);
  CHECK(alignment.pairs[0].state == PairState::kRefused);
  CHECK_THAT(alignment.reason[1], Contains("contradict the known positions of both sessions, by"));
}

TEST_CASE("Positions find the true loops among more that look alike", "[positions]") {
  Random random(13);
  Scene scene = two_maps(random);
  add_true_loops(scene, 5, random);
  add_aliased_loops(scene, 12, random);
  CHECK_FALSE(aligned(scene).connected[1]);
  add_positions(scene, 0, 20, 1.0, random);
  add_positions(scene, 1, 20, 1.0, random);
  const Alignment alignment = aligned(scene);
  REQUIRE(alignment.connected[1]);
  CHECK(site_error_m(scene, alignment, 1) < 3.0);
  for (std::size_t i = 0; i < scene.loops.size(); ++i) {
    if (i >= 5) CHECK(alignment.decisions[i].reason == "contradicts the known positions");
  }
}

TEST_CASE("Positions stand for the sensor data where loops lie in one place", "[positions]") {
  Random random(14);
  Scene scene = decks(0.0, random);
  std::erase_if(scene.loops, [](const LoopConstraint& l) { return l.query.keyframe > 10; });
  CHECK(aligned(scene).pairs[0].state == PairState::kProvisional);
  for (const std::uint32_t session : {0U, 1U}) add_positions(scene, session, 4, 0.3, random);
  CHECK(aligned(scene).connected[1]);
}

TEST_CASE("A position of a keyframe that is not there is refused", "[positions]") {
  Random random(15);
  Scene scene = decks(0.0, random);
  add_position(scene, {0, 10}, 0.1, random);
  scene.sessions[0].positions[0].keyframe.keyframe = 60;
  CHECK_THROWS_WITH(aligned(scene), Contains("position of a keyframe that does not exist"));
  scene.sessions[0].positions[0].keyframe = {1, 0};
  CHECK_THROWS_WITH(aligned(scene), Contains("position of a keyframe that does not exist"));
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
