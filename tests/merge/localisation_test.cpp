// Localisation of a robot in a finished map: never wrong rather than early.
#include "unimapper/merge/localisation.hpp"

#include "tests/merge/known_map.hpp"
#include "tests/merge/poses.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

double error_m(const MapPose& at, const Pose& truth) { return apart_m(at.T_map_keyframe, truth); }

bool is_localised(const MapPose& at) { return at.state == LocalisationState::kLocalised; }

std::size_t count_localised(const std::vector<MapPose>& answers) {
  return static_cast<std::size_t>(std::count_if(answers.begin(), answers.end(), is_localised));
}

std::vector<MapPose> follow(Localiser& localiser, const std::vector<KeyframeRecord>& keyframes) {
  std::vector<MapPose> answers;
  for (const KeyframeRecord& k : keyframes) answers.push_back(localiser.add(k));
  return answers;
}

/// Those of a robot that knows the map.
std::vector<MapPose> follow(const std::vector<KeyframeRecord>& keyframes) {
  Localiser localiser = map_of_town().localiser();
  return follow(localiser, keyframes);
}

const std::vector<MapPose>& answers_of_friday() {
  static const std::vector<MapPose> shared = follow(friday().session.keyframes);
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
  CHECK(is_localised(answers.back()));
  CHECK(count_localised(answers) >= 10);
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (!is_localised(answers[k])) continue;
    CHECK(answers[k].path_m >= 20.0);
    CHECK(answers[k].loops >= 3);
    CHECK(answers[k].reason.empty());
    CHECK(error_m(answers[k], friday().truth[k]) < 0.6);
    CHECK(error_m(answers[k], friday().truth[k]) < 4.0 * sigma_m(answers[k]));
    const Pose composed =
        answers[k].T_map_odometry * friday().session.keyframes[k].T_odometry_keyframe;
    CHECK(error_m(answers[k], composed) < 1e-6);
  }
}

TEST_CASE("Walls and neighbours that fit localise a robot before its loops span enough path",
          "[localisation]") {
  MergeConfig config;
  // 150 m where keyframes see least far.
  config.acceptance.min_span_m = 150.0 / AcceptanceConfig::kSmallestScale;
  Localiser localiser({map_of_town().drive.session}, map_of_town().result, config);
  const std::vector<MapPose> answers = follow(localiser, friday().session.keyframes);
  const auto first = std::find_if(answers.begin(), answers.end(), is_localised);
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
  const std::vector<MapPose> some = follow(part);
  REQUIRE(count_localised(some) > 0);
  for (std::size_t k = 0; k < some.size(); ++k) {
    CHECK(some[k].state == whole[k].state);
    CHECK(some[k].T_map_keyframe.translation == whole[k].T_map_keyframe.translation);
  }
}

TEST_CASE("A robot in another town is never localised", "[localisation]") {
  const std::uint64_t town = GENERATE(98, 99);
  CHECK(count_localised(follow(elsewhere(town).session.keyframes)) == 0);
}

TEST_CASE("A robot whose odometry jumps starts anew, and the loss is counted", "[localisation]") {
  std::vector<KeyframeRecord> keyframes = friday().session.keyframes;
  const std::size_t jump = keyframes.size() - 3;
  for (std::size_t k = jump; k < keyframes.size(); ++k) {
    keyframes[k].T_odometry_keyframe.translation.x() += 500.0;
  }
  const std::vector<MapPose> answers = follow(keyframes);
  REQUIRE(is_localised(answers[jump - 1]));
  CHECK(answers[jump].state == LocalisationState::kNotYet);
  CHECK(answers[jump].times_lost == 1);
}

TEST_CASE("A robot that is carried to another street is lost there, and found again",
          "[localisation][slow]") {
  const Drive there = record(known_town(), drive_roads({{0, 0}, {1, 0}, {1, 1}}), "carried", 14);
  std::vector<KeyframeRecord> keyframes = friday().session.keyframes;
  const std::size_t carried = keyframes.size();
  const Pose T_friday_there = keyframes.back().T_odometry_keyframe *
                              there.session.keyframes.front().T_odometry_keyframe.inverse();
  for (KeyframeRecord keyframe : there.session.keyframes) {
    keyframe.sequence += static_cast<std::uint32_t>(carried);
    keyframe.T_odometry_keyframe = T_friday_there * keyframe.T_odometry_keyframe;
    keyframes.push_back(keyframe);
  }
  const std::vector<MapPose> answers = follow(keyframes);
  REQUIRE(is_localised(answers[carried - 1]));
  CHECK(answers.back().times_lost == 1);
  REQUIRE(is_localised(answers.back()));
  CHECK(error_m(answers.back(), there.truth.back()) < 0.6);
  bool is_lost = false;
  std::size_t wrong = 0;
  for (std::size_t k = carried; k < answers.size(); ++k) {
    is_lost = is_lost || answers[k].times_lost > 0;
    if (!is_localised(answers[k])) continue;
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
  REQUIRE(is_localised(before));
  KeyframeRecord keyframe = friday().session.keyframes.back();
  double sigma = sigma_m(before);
  for (int step = 0; step < 200; ++step) {
    keyframe = unseeing_after(keyframe, 20.0);
    const MapPose at = localiser.add(keyframe);
    if (!is_localised(at)) {
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
  REQUIRE(is_localised(before));
  KeyframeRecord waiting = first.back();
  for (int i = 0; i < 900; ++i) {
    waiting = unseeing_after(waiting, 0.0);
    const MapPose at = localiser.add(waiting);
    REQUIRE(is_localised(at));
    REQUIRE(error_m(at, before.T_map_keyframe) < 1e-9);
  }
  for (std::size_t k = later; k < keyframes.size(); ++k) {
    keyframes[k].sequence += 900;
    const MapPose at = localiser.add(keyframes[k]);
    CHECK(is_localised(at));
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
