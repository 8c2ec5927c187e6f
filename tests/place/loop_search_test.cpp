// Loop search on hand-made places: duplicates, ambiguity, bounds.
#include "described.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/core/voxel_key.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Keypoints with random positions and columns, and upright planes, within 30 m.
Description random_place(std::uint64_t seed, int keypoints, int planes = 80) {
  Random random(seed);
  Description place;
  const auto position = [&](double z) {
    return Eigen::Vector3f(static_cast<float>(random.uniform(-30, 30)),
                           static_cast<float>(random.uniform(-30, 30)), static_cast<float>(z));
  };
  for (int i = 0; i < keypoints; ++i) {
    const std::uint64_t column = mix_bits(seed * 1000 + static_cast<std::uint64_t>(i));
    place.keypoints.push_back({position(0), Eigen::Vector3f::UnitX(), column, 100});
  }
  for (int i = 0; i < planes; ++i) {
    const double bearing = random.uniform(0, 6.28);
    place.planes.push_back(
        {position(random.uniform(0, 6)),
         {static_cast<float>(std::cos(bearing)), static_cast<float>(std::sin(bearing)), 0.0F}});
  }
  return place;
}

/// Confidence of the answer from `session`; -1 if there is none.
double confidence_of(const std::vector<LoopCandidate>& found, std::uint32_t session) {
  for (const LoopCandidate& candidate : found) {
    if (candidate.match.session == session) return static_cast<double>(candidate.confidence);
  }
  return -1.0;
}

}  // namespace

TEST_CASE("a target keypoint is paired with one query keypoint only") {
  const Description target = random_place(1, 30);
  Description query = target;
  for (const Keypoint& keypoint : target.keypoints) {
    Keypoint beside = keypoint;
    beside.position.x() += 0.3F;
    query.keypoints.push_back(beside);
  }
  Owned<PlaceDatabase> database(small_search());
  database->insert(target.view(), {1, 0}, kOrigin);
  const auto found = search(*database, query);
  REQUIRE(found.size() == 1);
  CHECK(found[0].inliers > 25);
  CHECK(found[0].inliers <= 30);
}

TEST_CASE("of three sessions none lowers another's confidence, wherever its map lies") {
  const Description place = random_place(2, 40);
  const auto confidence = [&](const std::vector<std::pair<KeyframeId, Pose>>& stored) {
    Owned<PlaceDatabase> database(small_search());
    for (const auto& [id, pose] : stored) database->insert(place.view(), id, pose);
    return confidence_of(search(*database, place), 1);
  };
  const std::pair<KeyframeId, Pose> first{{1, 0}, kOrigin};
  const double alone = confidence({first});
  REQUIRE(alone > 0.95);
  CHECK(confidence({first, {{2, 0}, standing_at(300, 0, 0, 1)}}) == alone);
  CHECK(confidence(
            {first, {{2, 0}, standing_at(300, 0, 0, 1)}, {{3, 0}, standing_at(-80, 40, 0, 2)}}) ==
        alone);
  // The same place twice in one session, farther apart than odometry drifts: one must be wrong.
  CHECK(confidence({first, {{1, 100}, standing_at(300, 0, 0, 1)}}) < 0.5);
  CHECK(confidence({first, {{1, 100}, standing_at(10, 0, 0, 0)}}) == alone);
}

TEST_CASE("a place that is ambiguous in one session leaves another session's confidence") {
  const Description distinct = random_place(3, 40);
  LoopSearchConfig config = small_search();
  config.max_per_session = 1;  // so that the competing pose is found by the check alone
  const float away_m = 6.0F;
  for (const auto& [x, y] :
       {std::pair{1.0F, 0.0F}, {-1.0F, 0.0F}, {0.0F, 1.0F}, {0.0F, -1.0F}, {1.0F, 1.0F}}) {
    const Eigen::Vector3f shift = away_m * Eigen::Vector3f(x, y, 0);
    INFO("shifted by " << shift.transpose());
    Description repeated = distinct;  // most of the structure once more
    for (std::size_t i = 0; i < 37; ++i) {
      repeated.keypoints.push_back(distinct.keypoints[i]);
      repeated.keypoints.back().position += shift;
    }
    const auto confidences = [&](bool first, bool second) {
      Owned<PlaceDatabase> database(config);
      // Both put the query at the same coordinates, each in a frame of its own.
      if (first) database->insert(repeated.view(), {1, 0}, kOrigin);
      if (second) database->insert(distinct.view(), {2, 0}, kOrigin);
      const auto found = search(*database, distinct);
      return std::pair(confidence_of(found, 1), confidence_of(found, 2));
    };
    const double ambiguous = confidences(true, false).first;
    const double unambiguous = confidences(false, true).second;
    REQUIRE(ambiguous >= 0.0);
    REQUIRE(ambiguous < unambiguous - 0.05);
    CHECK(confidences(true, true) == std::pair(ambiguous, unambiguous));
  }
}

TEST_CASE("a competing pose with more evidence replaces the one that triangles voted for") {
  // A third of the query is where it was and votes; the rest is 6 m further and, by its noise, has
  // no sides in common.
  Description stored = random_place(5, 45);
  constexpr std::size_t kThird = 18;
  constexpr float kMovedM = 6.0F;
  Random random(6);
  Description query = stored;
  for (std::size_t i = kThird; i < query.keypoints.size(); ++i) {
    query.keypoints[i].position +=
        Eigen::Vector3f(kMovedM + static_cast<float>(random.uniform(-0.3, 0.3)),
                        static_cast<float>(random.uniform(-0.3, 0.3)), 0);
  }
  for (const PlanePatch& patch : query.planes) {  // for both poses alike
    stored.planes.push_back(patch);
    stored.planes.back().center.x() -= kMovedM;
  }
  LoopSearchConfig config = small_search();
  // So that the competing pose is found by the check alone.
  config.side_tolerance_m = 0.05F;
  config.max_candidates = config.max_verified = config.max_results = config.max_per_session = 1;
  Owned<PlaceDatabase> database(config);
  database->insert(stored.view(), {1, 7}, kOrigin);
  const auto found = search(*database, query);
  REQUIRE(found.size() == 1);
  CHECK(std::abs(found[0].T_match_query.translation.x() + static_cast<double>(kMovedM)) < 0.5);
  CHECK(found[0].query == kQuery);
  CHECK(found[0].match == KeyframeId{1, 7});
}

TEST_CASE("keypoints and planes that are not finite are left out one by one, and counted") {
  const Description good = random_place(4, 40);
  Description bad = good;
  for (int axis = 0; axis < 3; ++axis) {
    PlanePatch patch = good.planes[0];
    patch.center(axis) = kNan;
    bad.planes.insert(bad.planes.begin(), patch);
    patch = good.planes[0];
    patch.normal(axis) = std::numeric_limits<float>::infinity();
    bad.planes.push_back(patch);
    Keypoint keypoint = good.keypoints[0];
    keypoint.position(axis) = kNan;
    bad.keypoints.insert(bad.keypoints.begin() + 5, keypoint);
  }
  Owned<PlaceDatabase> clean(small_search());
  Owned<PlaceDatabase> hostile(small_search());
  clean->insert(good.view(), {1, 0}, kOrigin);
  hostile->insert(bad.view(), {1, 0}, kOrigin);
  CHECK(clean->dropped() == 0);
  CHECK(hostile->dropped() == 9);
  const auto expected = search(*clean, good);
  const auto found = search(*hostile, good);
  REQUIRE(expected.size() == 1);
  REQUIRE(found.size() == 1);
  CHECK(found[0].confidence == expected[0].confidence);
  CHECK(found[0].plane_overlap == expected[0].plane_overlap);
}

TEST_CASE("a search compares no more triangles than allowed") {
  constexpr std::uint32_t kPlaces = 30;
  const Description place = random_place(5, 60);
  const auto most_votes = [&](std::uint32_t max_compared) {
    LoopSearchConfig config = small_search();
    config.max_compared = max_compared;
    REQUIRE(config.validate().ok());
    Owned<PlaceDatabase> database(config);
    for (std::uint32_t i = 0; i < kPlaces; ++i) database->insert(place.view(), {i, 0}, kOrigin);
    std::uint32_t votes = 0;
    for (const LoopCandidate& candidate : search(*database, place, {kPlaces, 0})) {
      votes = std::max(votes, candidate.votes);
    }
    return votes;
  };
  // Every triangle compared votes once, with a weight of at most 4.
  CHECK(most_votes(1000) > 0);
  CHECK(most_votes(1000) * kPlaces <= 4 * 1000);
  CHECK(most_votes(220000) * kPlaces > 2 * 4 * 1000);
}

TEST_CASE("a pose that fewer than five keypoints agree on is no hypothesis") {
  // Every two are 4 to 40 m apart, and no three are nearly in line: all triangles count.
  Description place = random_place(6, 5);
  constexpr float kCorners[5][2] = {{0, 0}, {13, 2}, {17, 14}, {5, 22}, {-9, 11}};
  for (std::size_t i = 0; i < 5; ++i) {
    place.keypoints[i].position = {kCorners[i][0], kCorners[i][1], 0.0F};
  }
  const auto answers = [&] {
    Owned<PlaceDatabase> database(small_search());
    database->insert(place.view(), {1, 0}, kOrigin);
    return search(*database, place).size();
  };
  CHECK(answers() == 1);
  place.keypoints.pop_back();
  CHECK(answers() == 0);
}

TEST_CASE("triangles that find no room in their bucket are counted") {
  LoopSearchConfig config = small_search();
  config.max_bucket = 5;
  Owned<PlaceDatabase> database(config);
  const Description place = random_place(7, 30);
  for (std::uint32_t i = 0; i < 5; ++i) database->insert(place.view(), {1, i}, kOrigin);
  const std::uint64_t before = database->dropped();
  database->insert(place.view(), {1, 5}, kOrigin);
  const std::uint64_t sixth = database->dropped() - before;
  CHECK(sixth > 50);
  database->insert(place.view(), {1, 6}, kOrigin);
  CHECK(database->dropped() - before == 2 * sixth);
}

TEST_CASE("matches that find no room among the votes are counted") {
  const Description place = random_place(8, 30);
  const auto dropped = [&](std::uint32_t max_matches) {
    LoopSearchConfig config = small_search();
    config.max_matches = max_matches;
    REQUIRE(config.validate().ok());
    Owned<PlaceDatabase> database(config);
    for (std::uint32_t i = 0; i < 5; ++i) database->insert(place.view(), {1, i}, kOrigin);
    REQUIRE(database->dropped() == 0);
    (void)search(*database, place);
    const std::uint64_t once = database->dropped();
    (void)search(*database, place);
    CHECK(database->dropped() == 2 * once);
    return once;
  };
  CHECK(dropped(1U << 16U) == 0);
  CHECK(dropped(64) > 100);
  CHECK(dropped(64) == dropped(100) + 36);
}

namespace {

/// The place in a frame that leans by so much, with up known to `sigma_deg`; 0: unknown.
Description leaning(Description place, double deg, double sigma_deg) {
  const Eigen::Vector3d axis(0.6, -0.8, 0.0);
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisd(deg / kDegreesPerRadian, axis).toRotationMatrix().cast<float>();
  for (Keypoint& keypoint : place.keypoints) keypoint.position = (turn * keypoint.position).eval();
  for (PlanePatch& patch : place.planes) {
    patch.center = (turn * patch.center).eval();
    patch.normal = (turn * patch.normal).eval();
  }
  const double variance = sigma_deg * sigma_deg / (kDegreesPerRadian * kDegreesPerRadian);
  if (variance > 0.0) {
    place.up = {true, static_cast<float>(variance), 0.0F, static_cast<float>(variance)};
  }
  return place;
}

/// What is found of a place that leans by so much against the stored one, both with up known to
/// `sigma_deg`.
std::vector<LoopCandidate> find_leaning(double deg, double sigma_deg) {
  const Description place = random_place(8, 40);
  Owned<PlaceDatabase> database(small_search());
  const Description stored = leaning(place, 0.0, sigma_deg);
  const Description query = leaning(place, deg, sigma_deg);
  database->insert(stored.view(), {1, 0}, kOrigin);
  return search(*database, query);
}

double tilt_deg(const LoopCandidate& loop) {
  return std::asin(tilt_of(loop.T_match_query).norm()) * kDegreesPerRadian;
}

}  // namespace

TEST_CASE("a place may lean as far as both frames are uncertain of up") {
  // Four sigma of 0.6 degrees in both frames and of the keypoints' heights, 1.3 degrees: 6.2.
  REQUIRE(find_leaning(0.0, 0.6).size() == 1);
  CHECK(find_leaning(0.0, 0.6)[0].accepted);
  REQUIRE(find_leaning(5.0, 0.6).size() == 1);
  CHECK(find_leaning(7.0, 0.6).empty());
  // The same tilt is nothing where up is less certain.
  REQUIRE(find_leaning(7.0, 1.5).size() == 1);
  CHECK(find_leaning(7.0, 1.5)[0].accepted);
}

TEST_CASE("where up is hardly known the pose leans as heights and planes say") {
  for (const double deg : {1.0, 3.0, 5.0}) {
    const auto found = find_leaning(deg, 4.0);
    REQUIRE(found.size() == 1);
    CHECK(found[0].accepted);
    CHECK(tilt_deg(found[0]) == Approx(deg).margin(0.1 * deg + 0.1));
    // Unknown up is less uncertain, and counts for more.
    const auto held = find_leaning(deg, 0.0);
    REQUIRE(held.size() == 1);
    CHECK(tilt_deg(held[0]) < tilt_deg(found[0]));
    CHECK(tilt_deg(held[0]) > 0.6 * deg);
  }
}

TEST_CASE("heights that contradict what is known of up do not tilt the pose") {
  Description place = random_place(9, 40);
  place.planes.clear();
  place = leaning(place, 0.0, 0.1);
  Description query = place;
  // Ground that is seen to slope, as by a sensor that hardly sees it.
  for (Keypoint& keypoint : query.keypoints) keypoint.position.z() += 0.02F * keypoint.position.x();
  Owned<PlaceDatabase> database(small_search());
  database->insert(place.view(), {1, 0}, kOrigin);
  const auto found = search(*database, query);
  REQUIRE(found.size() == 1);
  CHECK(tilt_deg(found[0]) < 0.15);
}
