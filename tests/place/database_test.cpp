// Tests of loop search: retrieval, acceptance and forgetting.
#include "unimapper/place/database.hpp"

#include "described.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;

Description describe(const std::vector<Surface>& surfaces, const Pose& pose,
                     std::uint64_t noise = 1) {
  View view;
  view.noise_seed = noise;
  return test::describe(observe(surfaces, pose, view));
}

Description describe(std::uint64_t scene, const Pose& pose, std::uint64_t noise = 1) {
  return describe(make_scene(scene), pose, noise);
}

LoopSearchConfig small(std::uint32_t places = 20) { return small_search(places); }

}  // namespace

TEST_CASE("a place is found again from another direction, with the pose between") {
  Owned<PlaceDatabase> database(small());
  REQUIRE(database.ok());
  const Pose here = standing_at(0, 0, 1.9, 0.2);
  for (std::uint32_t i = 0; i < 8; ++i) {
    database->insert(describe(20 + i, here).view(), {1, i}, kOrigin);
  }
  for (const Pose& there : {standing_at(5, -4, 1.9, 3.1), standing_at(-3, 6, 0.4, -1.4)}) {
    const Description query = describe(23, there, 77);
    const auto found = search(*database, query);
    REQUIRE_FALSE(found.empty());
    CHECK(found[0].match.session == 1);
    CHECK(found[0].match.keyframe == 3);
    CHECK(found[0].accepted);
    CHECK(found[0].inliers > 15);
    CHECK(found[0].plane_overlap > 0.5F);
    CHECK(found[0].T_match_query.is_rigid(1e-6));
    const Pose truth = level_frame(here).inverse() * level_frame(there);
    CHECK((found[0].T_match_query.translation - truth.translation).norm() < 0.15);
    CHECK(rotation_angle(truth.rotation.transpose() * found[0].T_match_query.rotation) < 0.01);
    // Nothing else is accepted, and the order follows the confidence.
    for (std::size_t i = 1; i < found.size(); ++i) {
      CHECK_FALSE(found[i].accepted);
      CHECK(found[i].confidence <= found[i - 1].confidence);
      CHECK(found[i].confidence >= 0.0F);
    }
    CHECK(found[0].confidence <= 1.0F);
  }
}

TEST_CASE("places that were never seen are not accepted") {
  Owned<PlaceDatabase> database(small());
  for (std::uint32_t i = 0; i < 10; ++i) {
    database->insert(describe(40 + i, standing_at(0, 0, 1.9, 0.1 * i)).view(), {1, i}, kOrigin);
  }
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Description query = describe(60 + i, standing_at(1, 2, 1.9, i));
    for (const LoopCandidate& found : search(*database, query)) {
      CHECK_FALSE(found.accepted);
    }
  }
}

TEST_CASE("a mirrored scene is another place") {
  const std::vector<Surface> scene = make_scene(31);
  const Pose here = standing_at(0, 0, 1.9, 0);
  Owned<PlaceDatabase> database(small());
  database->insert(describe(scene, here).view(), {1, 0}, kOrigin);
  REQUIRE(search(*database, describe(scene, here, 5))[0].accepted);
  const Description query = describe(mirrored(scene), here, 5);
  for (const LoopCandidate& found : search(*database, query)) {
    CHECK_FALSE(found.accepted);
  }
}

TEST_CASE("the scope decides which places may answer") {
  Owned<PlaceDatabase> database(small());
  const Pose here = standing_at(0, 0, 1.9, 0);
  const Description place = describe(31, here);
  database->insert(place.view(), {1, 10}, kOrigin);
  database->insert(place.view(), {2, 30}, kOrigin);
  const Description query = describe(31, here, 5);
  const auto accepted_sessions = [&](KeyframeId id, const SearchScope& scope) {
    std::vector<std::uint32_t> sessions;
    for (const LoopCandidate& found : search(*database, query, id, scope)) {
      if (found.accepted) sessions.push_back(found.match.session);
    }
    std::sort(sessions.begin(), sessions.end());
    return sessions;
  };
  using Sessions = SearchScope::Sessions;
  const std::vector<std::uint32_t> none, first = {1}, second = {2}, both = {1, 2};
  CHECK(accepted_sessions({1, 30}, {Sessions::kAll, 0}) == both);
  CHECK(accepted_sessions({1, 30}, {Sessions::kOnlySame, 0}) == first);
  CHECK(accepted_sessions({1, 30}, {Sessions::kOnlyOther, 0}) == second);
  CHECK(accepted_sessions({3, 30}, {Sessions::kOnlySame, 0}) == none);
  // The gap holds within the own session only, in both directions.
  CHECK(accepted_sessions({1, 30}, {Sessions::kAll, 20}) == both);
  CHECK(accepted_sessions({1, 30}, {Sessions::kAll, 21}) == second);
  CHECK(accepted_sessions({2, 15}, {Sessions::kOnlySame, 15}) == second);
  CHECK(accepted_sessions({2, 15}, {Sessions::kOnlySame, 16}) == none);
}

TEST_CASE("a full database evicts its most redundant places, and keeps working") {
  Owned<PlaceDatabase> database(small(3));
  const Pose here = standing_at(0, 0, 1.9, 0);
  const auto knows = [&](std::uint64_t scene) {
    const auto found = search(*database, describe(scene, here, 5));
    return !found.empty() && found[0].accepted;
  };
  // One place far off, recorded first; then two side by side, and a street.
  database->insert(describe(50, here).view(), {1, 0}, standing_at(-500, 0, 0, 0));
  database->insert(describe(51, here).view(), {1, 1}, standing_at(0, 0, 0, 0));
  database->insert(describe(52, here).view(), {1, 2}, standing_at(2, 0, 0, 0));
  CHECK(database->evicted() == 0);
  database->insert(describe(53, here).view(), {1, 3}, standing_at(60, 0, 0, 0));
  CHECK(database->size() == 3);
  CHECK(database->evicted() == 1);
  CHECK(knows(50));  // the oldest, but the only one there
  CHECK_FALSE(knows(51));
  CHECK(knows(52));
  CHECK(knows(53));
  // Forgetting leaves nothing behind in the table, however long it goes on.
  for (std::uint32_t i = 0; i < 12; ++i) {
    database->insert(describe(54 + i % 3, here).view(), {1, 4 + i}, standing_at(60, 0, 0, 0));
  }
  CHECK(database->evicted() == 13);
  CHECK(knows(50));
  CHECK(knows(56));
  CHECK(database->dropped() == 0);
}

TEST_CASE("the same calls give the same bytes") {
  const auto run = [] {
    Owned<PlaceDatabase> database(small());
    for (std::uint32_t i = 0; i < 6; ++i) {
      database->insert(describe(20 + i, standing_at(i, 0, 1.9, i)).view(), {1, i}, kOrigin);
    }
    return search(*database, describe(24, standing_at(2, 2, 1.9, 1), 9));
  };
  const std::vector<LoopCandidate> first = run();
  const std::vector<LoopCandidate> second = run();
  REQUIRE_FALSE(first.empty());
  REQUIRE(first.size() == second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    CHECK(first[i].match.keyframe == second[i].match.keyframe);
    CHECK(first[i].confidence == second[i].confidence);
    CHECK(first[i].T_match_query.rotation == second[i].T_match_query.rotation);
    CHECK(first[i].T_match_query.translation == second[i].T_match_query.translation);
  }
}

TEST_CASE("of equal places the one with the smaller id comes first") {
  Owned<PlaceDatabase> database(small());
  const Description place = describe(31, standing_at(0, 0, 1.9, 0));
  for (const std::uint32_t keyframe : {7U, 3U, 5U})
    database->insert(place.view(), {1, keyframe}, kOrigin);
  const auto found = search(*database, place);
  REQUIRE(found.size() == 3);
  CHECK(found[0].match.keyframe == 3);
  CHECK(found[1].match.keyframe == 5);
  CHECK(found[2].match.keyframe == 7);
}

TEST_CASE("a database knows an empty place, and an empty database answers nothing") {
  Owned<PlaceDatabase> database(small());
  const Description place = describe(31, standing_at(0, 0, 1.9, 0));
  CHECK(search(*database, place).empty());
  database->insert({}, {1, 0}, kOrigin);
  CHECK(database->size() == 1);
  CHECK(search(*database, place).empty());
  database->insert(place.view(), {1, 1}, kOrigin);
  CHECK(search(*database, {}).empty());

  // One, two, and many equal keypoints.
  for (const std::size_t count : {1U, 2U, 50U}) {
    Description few = place;
    few.keypoints.assign(count, place.keypoints[0]);
    database->insert(few.view(), {1, 2}, kOrigin);
    CHECK(search(*database, few).empty());
  }
}

TEST_CASE("a place from a hostile sender does no harm") {
  Owned<PlaceDatabase> database(small());
  const Pose here = standing_at(0, 0, 1.9, 0);
  const Description good = describe(31, here);
  Description bad = good;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < bad.keypoints.size(); i += 3) bad.keypoints[i].position.x() = nan;
  for (std::size_t i = 1; i < bad.keypoints.size(); i += 3) bad.keypoints[i].normal.z() = nan;
  for (std::size_t i = 0; i < bad.planes.size(); i += 2) {
    bad.planes[i].center.y() = std::numeric_limits<float>::infinity();
  }
  for (std::size_t i = 1; i < bad.planes.size(); i += 4) bad.planes[i].center.y() = 1e30F;
  for (std::size_t i = 3; i < bad.planes.size(); i += 4) bad.planes[i].normal.setZero();
  database->insert(bad.view(), {1, 0}, kOrigin);
  CHECK(database->dropped() > 0);
  for (const Description& query : {good, bad}) {
    for (const LoopCandidate& found : search(*database, query)) {
      CHECK(std::isfinite(found.confidence));
      CHECK(found.T_match_query.is_rigid(1e-6));
    }
  }
  // And the database still finds what it should.
  database->insert(good.view(), {1, 1}, kOrigin);
  const auto found = search(*database, describe(31, here, 5));
  REQUIRE_FALSE(found.empty());
  CHECK(found[0].match.keyframe == 1);
  CHECK(found[0].accepted);
}

TEST_CASE("places larger than configured are cut and counted, results are limited") {
  LoopSearchConfig config = small();
  config.max_results = 2;
  REQUIRE(config.validate().code == ErrorCode::kOk);
  Owned<PlaceDatabase> database(config, PlaceShape{.max_keypoints = 20, .max_planes = 50});
  const Description place = describe(31, standing_at(0, 0, 1.9, 0));
  REQUIRE(place.keypoints.size() > 20);
  for (std::uint32_t i = 0; i < 5; ++i) database->insert(place.view(), {1, i}, kOrigin);
  CHECK(database->dropped() > 0);
  CHECK(search(*database, place).size() == 2);
}

TEST_CASE("a database laid out on too small a block answers nothing instead of failing") {
  alignas(64) static std::byte block[4096];
  Arena arena(block, sizeof block);
  PlaceDatabase database;
  database.allocate(arena, small());
  REQUIRE(arena.exhausted());
  const Description place = describe(31, standing_at(0, 0, 1.9, 0));
  database.insert(place.view(), {1, 0}, kOrigin);
  CHECK(database.size() == 0);
  CHECK(search(database, place).empty());
}
