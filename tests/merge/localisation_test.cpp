// Localisation of a robot in a finished map: never wrong rather than early.
#include "unimapper/merge/localisation.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "tests/merge/known_map.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Drive;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::friday;
using unimapper::merge::testing::KnownMap;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::map_of_town;
using unimapper::merge::testing::record;

namespace {

double error_m(const MapPose& at, const Pose& truth) {
  return (at.T_map_keyframe.translation - truth.translation).norm();
}

std::size_t count_localised(const std::vector<MapPose>& answers) {
  std::size_t count = 0;
  for (const MapPose& at : answers) count += at.state == LocalisationState::kLocalised ? 1 : 0;
  return count;
}

std::vector<MapPose> follow(Localiser& localiser, const std::vector<KeyframeRecord>& keyframes) {
  std::vector<MapPose> answers;
  for (const KeyframeRecord& k : keyframes) answers.push_back(localiser.add(k));
  return answers;
}

const std::vector<MapPose>& answers_of_friday() {
  static const std::vector<MapPose> shared = [] {
    Localiser localiser = map_of_town().localiser();
    return follow(localiser, friday().session.keyframes);
  }();
  return shared;
}

/// The next keyframe of a robot that sees nothing, so much farther on.
KeyframeRecord unseeing_after(const KeyframeRecord& last, double step_m) {
  KeyframeRecord next;
  next.session = last.session;
  next.sequence = last.sequence + 1;
  next.T_odometry_keyframe = last.T_odometry_keyframe;
  next.T_odometry_keyframe.translation.x() += step_m;
  next.scans = last.scans;
  for (auto& scan : next.scans) scan.stamp_ns += 10'000'000'000;
  next.reference_scan = last.reference_scan;
  return next;
}

double sigma_m(const MapPose& at) { return std::sqrt(at.covariance.topLeftCorner<3, 3>().trace()); }

}  // namespace

TEST_CASE("A robot in mapped streets is localised after some way, within what is claimed",
          "[localisation]") {
  const std::vector<MapPose>& answers = answers_of_friday();
  CHECK(answers.front().state == LocalisationState::kNotYet);
  CHECK_FALSE(answers.front().reason.empty());
  CHECK(answers.back().state == LocalisationState::kLocalised);
  CHECK(count_localised(answers) >= 10);
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (answers[k].state != LocalisationState::kLocalised) continue;
    CHECK(answers[k].path_m >= 20.0);
    CHECK(answers[k].loops >= 3);
    CHECK(answers[k].reason.empty());
    CHECK(error_m(answers[k], friday().truth[k]) < 0.6);
    CHECK(error_m(answers[k], friday().truth[k]) < 4.0 * sigma_m(answers[k]));
    const Pose composed =
        answers[k].T_map_odometry * friday().session.keyframes[k].T_odometry_keyframe;
    CHECK((composed.translation - answers[k].T_map_keyframe.translation).norm() < 1e-6);
  }
}

TEST_CASE("Walls and neighbours that fit localise a robot before its loops span enough path",
          "[localisation]") {
  MergeConfig config;
  // 150 m where keyframes see least far.
  config.acceptance.min_span_m = 150.0 / AcceptanceConfig::kSmallestScale;
  Localiser localiser({map_of_town().drive.session}, map_of_town().result, config);
  const std::vector<MapPose> answers = follow(localiser, friday().session.keyframes);
  const auto first = std::find_if(answers.begin(), answers.end(), [](const MapPose& at) {
    return at.state == LocalisationState::kLocalised;
  });
  REQUIRE(first != answers.end());
  CHECK(first->loops >= 3);
  const std::size_t k = first - answers.begin();
  CHECK(error_m(*first, friday().truth[k]) < 0.6);
  CHECK(first->path_m < 150.0);
  CHECK(count_localised(answers) == count_localised(answers_of_friday()));
}

TEST_CASE("An answer rests on earlier keyframes only", "[localisation]") {
  const std::vector<MapPose>& whole = answers_of_friday();
  std::vector<KeyframeRecord> part = friday().session.keyframes;
  part.resize(2 * part.size() / 3);
  Localiser localiser = map_of_town().localiser();
  const std::vector<MapPose> some = follow(localiser, part);
  REQUIRE(count_localised(some) > 0);
  for (std::size_t k = 0; k < some.size(); ++k) {
    CHECK(some[k].state == whole[k].state);
    CHECK(some[k].T_map_keyframe.translation == whole[k].T_map_keyframe.translation);
  }
}

TEST_CASE("A robot in another town is never localised", "[localisation]") {
  for (const std::uint64_t town : {98U, 99U}) {
    const Drive elsewhere =
        record(make_town(town, 2), drive_roads({{0, 0}, {1, 0}, {1, 1}}), "elsewhere", 13);
    Localiser localiser = map_of_town().localiser();
    CHECK(count_localised(follow(localiser, elsewhere.session.keyframes)) == 0);
  }
}

TEST_CASE("A robot whose odometry jumps starts anew, and the loss is counted", "[localisation]") {
  std::vector<KeyframeRecord> keyframes = friday().session.keyframes;
  const std::size_t jump = keyframes.size() - 3;
  for (std::size_t k = jump; k < keyframes.size(); ++k) {
    keyframes[k].T_odometry_keyframe.translation.x() += 500.0;
  }
  Localiser localiser = map_of_town().localiser();
  const std::vector<MapPose> answers = follow(localiser, keyframes);
  REQUIRE(answers[jump - 1].state == LocalisationState::kLocalised);
  CHECK(answers[jump].state == LocalisationState::kNotYet);
  CHECK(answers[jump].times_lost == 1);
}

TEST_CASE("A robot that is carried to another street is lost there, and found again",
          "[localisation][slow]") {
  const Drive there = record(make_town(1, 2), drive_roads({{0, 0}, {1, 0}, {1, 1}}), "carried", 14);
  std::vector<KeyframeRecord> keyframes = friday().session.keyframes;
  const std::size_t carried = keyframes.size();
  const Pose T_friday_there = keyframes.back().T_odometry_keyframe *
                              there.session.keyframes.front().T_odometry_keyframe.inverse();
  for (KeyframeRecord keyframe : there.session.keyframes) {
    keyframe.sequence += static_cast<std::uint32_t>(carried);
    keyframe.T_odometry_keyframe = T_friday_there * keyframe.T_odometry_keyframe;
    keyframes.push_back(keyframe);
  }
  Localiser localiser = map_of_town().localiser();
  const std::vector<MapPose> answers = follow(localiser, keyframes);
  REQUIRE(answers[carried - 1].state == LocalisationState::kLocalised);
  CHECK(answers.back().times_lost == 1);
  REQUIRE(answers.back().state == LocalisationState::kLocalised);
  CHECK(error_m(answers.back(), there.truth.back()) < 0.6);
  bool is_lost = false;
  std::size_t wrong = 0;
  for (std::size_t k = carried; k < answers.size(); ++k) {
    is_lost = is_lost || answers[k].times_lost > 0;
    if (answers[k].state != LocalisationState::kLocalised) continue;
    if (is_lost) CHECK(error_m(answers[k], there.truth[k - carried]) < 0.6);
    if (!is_lost) ++wrong;
  }
  // Two loops that contradict it are needed.
  CHECK(wrong <= 4);
}

TEST_CASE("By odometry alone a position gets less sure, and beyond five metres it is lost",
          "[localisation]") {
  Localiser localiser = map_of_town().localiser();
  const MapPose before = follow(localiser, friday().session.keyframes).back();
  REQUIRE(before.state == LocalisationState::kLocalised);
  KeyframeRecord keyframe = friday().session.keyframes.back();
  double sigma = sigma_m(before);
  for (int step = 0; step < 200; ++step) {
    keyframe = unseeing_after(keyframe, 20.0);
    const MapPose at = localiser.add(keyframe);
    if (at.state != LocalisationState::kLocalised) {
      CHECK(step > 5);
      CHECK(at.reason == "too far by odometry alone");
      CHECK(at.times_lost == 1);
      return;
    }
    CHECK(sigma_m(at) > sigma);
    CHECK(at.since_loop_m > 20.0 * step + 19.0);
    CHECK(before.loops == at.loops);
    sigma = sigma_m(at);
  }
  FAIL("it was never lost");
}

TEST_CASE("A robot that waits for long keeps its position with bounded memory", "[localisation]") {
  std::vector<KeyframeRecord> keyframes = friday().session.keyframes;
  const std::size_t later = keyframes.size() - 5;
  Localiser localiser = map_of_town().localiser();
  const std::vector<KeyframeRecord> first(keyframes.begin(), keyframes.begin() + later);
  const MapPose before = follow(localiser, first).back();
  REQUIRE(before.state == LocalisationState::kLocalised);
  KeyframeRecord waiting = first.back();
  for (int i = 0; i < 900; ++i) {
    waiting = unseeing_after(waiting, 0.0);
    const MapPose at = localiser.add(waiting);
    REQUIRE(at.state == LocalisationState::kLocalised);
    REQUIRE((at.T_map_keyframe.translation - before.T_map_keyframe.translation).norm() < 1e-9);
  }
  for (std::size_t k = later; k < keyframes.size(); ++k) {
    keyframes[k].sequence += 900;
    const MapPose at = localiser.add(keyframes[k]);
    CHECK(at.state == LocalisationState::kLocalised);
    CHECK(error_m(at, friday().truth[k]) < 0.6);
    if (k + 1 == keyframes.size()) CHECK(before.loops < at.loops);
  }
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
