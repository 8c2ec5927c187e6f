// Localisation of a robot in a finished map: never wrong rather than early.
#include "unimapper/merge/localisation.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>

#include "tests/merge/synthetic_town.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Drive;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;
using unimapper::merge::testing::Town;

namespace {

/// A map of one session whose poses are the truth: the world is its frame.
struct KnownMap {
  Drive drive;
  MergeResult result;

  explicit KnownMap(const Town& town)
      : drive(record(town, drive_roads({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {0.5, 0}}),
                     "monday", 11)) {
    MergedSession& merged = result.sessions.emplace_back();
    merged.status = SessionStatus::kCentral;
    merged.T_map_keyframe = drive.truth;
  }
  [[nodiscard]] Localiser localiser() const { return {{drive.session}, result}; }
};

const KnownMap& map_of_town() {
  static const KnownMap shared(make_town(1, 2));
  return shared;
}

double error_m(const MapPose& at, const Pose& truth) {
  return (at.T_map_keyframe.translation - truth.translation).norm();
}

std::size_t count_localised(const std::vector<MapPose>& answers) {
  std::size_t count = 0;
  for (const MapPose& at : answers) count += at.state == LocalisationState::kLocalised ? 1 : 0;
  return count;
}

std::vector<MapPose> follow(Localiser& localiser, const Drive& drive) {
  std::vector<MapPose> answers;
  for (const KeyframeRecord& k : drive.session.keyframes) answers.push_back(localiser.add(k));
  return answers;
}

}  // namespace

TEST_CASE("A robot in mapped streets is localised after some way, within what is claimed",
          "[localisation]") {
  const Drive friday = record(make_town(1, 2), drive_roads({{2, 1}, {0, 1}, {0, 0}}), "friday", 12);
  Localiser localiser = map_of_town().localiser();
  const std::vector<MapPose> answers = follow(localiser, friday);
  CHECK(answers.front().state == LocalisationState::kNotYet);
  CHECK_FALSE(answers.front().reason.empty());
  CHECK(answers.back().state == LocalisationState::kLocalised);
  CHECK(count_localised(answers) >= 10);
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (answers[k].state != LocalisationState::kLocalised) continue;
    CHECK(answers[k].path_m >= 20.0);
    CHECK(answers[k].loops >= 3);
    CHECK(answers[k].reason.empty());
    CHECK(error_m(answers[k], friday.truth[k]) < 0.6);
    const double sigma = std::sqrt(answers[k].covariance.topLeftCorner<3, 3>().trace());
    CHECK(error_m(answers[k], friday.truth[k]) < 4.0 * sigma);
    const Pose composed =
        answers[k].T_map_odometry * friday.session.keyframes[k].T_odometry_keyframe;
    CHECK((composed.translation - answers[k].T_map_keyframe.translation).norm() < 1e-6);
  }
}

TEST_CASE("An answer rests on earlier keyframes only", "[localisation]") {
  const Drive friday = record(make_town(1, 2), drive_roads({{2, 1}, {0, 1}, {0, 0}}), "friday", 12);
  Localiser all = map_of_town().localiser();
  Localiser some = map_of_town().localiser();
  const std::vector<MapPose> whole = follow(all, friday);
  Drive part = friday;
  part.session.keyframes.resize(friday.session.keyframes.size() / 2);
  const std::vector<MapPose> half = follow(some, part);
  for (std::size_t k = 0; k < half.size(); ++k) {
    CHECK(half[k].state == whole[k].state);
    CHECK(half[k].T_map_keyframe.translation == whole[k].T_map_keyframe.translation);
  }
}

TEST_CASE("A robot in another town is never localised", "[localisation]") {
  for (const std::uint64_t town : {98U, 99U}) {
    const Drive elsewhere =
        record(make_town(town, 2), drive_roads({{0, 0}, {1, 0}, {1, 1}}), "elsewhere", 13);
    Localiser localiser = map_of_town().localiser();
    CHECK(count_localised(follow(localiser, elsewhere)) == 0);
  }
}

TEST_CASE("A robot whose odometry jumps starts anew, and the loss is counted", "[localisation]") {
  Drive friday = record(make_town(1, 2), drive_roads({{2, 1}, {0, 1}, {0, 0}}), "friday", 12);
  auto& keyframes = friday.session.keyframes;
  const std::size_t jump = keyframes.size() - 3;
  for (std::size_t k = jump; k < keyframes.size(); ++k) {
    keyframes[k].T_odometry_keyframe.translation.x() += 500.0;
  }
  Localiser localiser = map_of_town().localiser();
  const std::vector<MapPose> answers = follow(localiser, friday);
  REQUIRE(answers[jump - 1].state == LocalisationState::kLocalised);
  CHECK(answers[jump].state == LocalisationState::kNotYet);
  CHECK(answers[jump].times_lost == 1);
}

TEST_CASE("What cannot be localised is refused in words", "[localisation]") {
  const KnownMap& map = map_of_town();
  MergeResult apart = map.result;
  apart.sessions[0].status = SessionStatus::kUnconnected;
  CHECK_THROWS_AS(Localiser({map.drive.session}, apart), std::invalid_argument);
  CHECK_THROWS_AS(Localiser({}, map.result), std::invalid_argument);
  Localiser localiser = map.localiser();
  KeyframeRecord keyframe = map.drive.session.keyframes[3];
  (void)localiser.add(keyframe);
  CHECK_THROWS_AS(localiser.add(keyframe), std::invalid_argument);
  keyframe.sequence = 9;
  keyframe.T_odometry_keyframe.translation.x() = std::nan("");
  CHECK_THROWS_AS(localiser.add(keyframe), std::invalid_argument);
}
