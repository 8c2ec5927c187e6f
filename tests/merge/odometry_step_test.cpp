// Sessions whose odometry steps as no robot moves
#include "src/merge/odometry_step.hpp"

#include <catch2/catch.hpp>

#include "tests/merge/synthetic_town.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using Catch::Matchers::Contains;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;

namespace {

constexpr std::int64_t kScanNs = 100'000'000;
constexpr std::uint32_t kScans = 10;

/// A robot that drives at `speed_mps`, in keyframes of ten scans.
SessionData driven(double speed_mps, std::uint32_t keyframes = 6) {
  SessionData session;
  session.info.name = "driven";
  for (std::uint32_t k = 0; k < keyframes; ++k) {
    KeyframeRecord& keyframe = session.keyframes.emplace_back();
    keyframe.sequence = k;
    for (std::uint32_t i = 0; i < kScans; ++i) {
      const std::uint32_t scan = k * kScans + i;
      Pose pose;
      pose.translation.x() = 0.1 * speed_mps * scan;
      keyframe.scans.push_back({scan, scan * kScanNs, pose});
    }
    keyframe.T_odometry_keyframe = keyframe.scans[0].T_odometry_sensor;
  }
  return session;
}

void move(SessionData& session, std::size_t from, double by_m, std::int64_t later_ns = 0) {
  for (std::size_t k = from; k < session.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = session.keyframes[k];
    keyframe.T_odometry_keyframe.translation.y() += by_m;
    for (KeyframeScan& scan : keyframe.scans) {
      scan.T_odometry_sensor.translation.y() += by_m;
      scan.stamp_ns += later_ns;
    }
  }
}

/// Two scans to each keyframe of a recorded drive, so that they tell a speed.
SessionData with_scans(SessionData session) {
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = session.keyframes[k];
    const auto stamp_ns = static_cast<std::int64_t>(k + 1) * 1'000'000'000;
    const auto scan = static_cast<std::uint32_t>(2 * k);
    keyframe.scans = {{scan, stamp_ns, keyframe.T_odometry_keyframe},
                      {scan + 1, stamp_ns + kScanNs, keyframe.T_odometry_keyframe}};
    keyframe.scans[1].T_odometry_sensor.translation.x() += 0.1;
    keyframe.reference_scan = 0;
  }
  return session;
}

}  // namespace

TEST_CASE("A step is impossible beyond 3 m and half again the way at the fastest speed") {
  const double speed_mps = GENERATE(0.01, 1.0, 12.0);
  INFO(speed_mps << " m/s");
  const double way_m = 0.1 * 1.5 * std::max(speed_mps, 3.0);
  const double along_m = 0.1 * speed_mps;
  SessionData session = driven(speed_mps);
  CHECK_FALSE(find_impossible_step(session));
  const double across_m = std::sqrt(std::pow(3.0 + way_m, 2) - along_m * along_m);
  SessionData below = session;
  move(below, 4, across_m - 0.01);
  CHECK_FALSE(find_impossible_step(below));
  move(session, 4, across_m + 0.01);
  const auto step = find_impossible_step(session);
  REQUIRE(step);
  CHECK(step->keyframe == 4);
  CHECK(step->length_m == Approx(3.0 + way_m).margin(0.02));
  CHECK(step->duration_s == Approx(0.1));
  CHECK_THAT(reason_against_odometry(session), Contains("before keyframe 4"));
}

TEST_CASE("Keyframes that were lost are no step: the robot went on meanwhile") {
  SessionData session = driven(1.5);
  move(session, 3, 80.0, 20 * 1'000'000'000LL);
  CHECK_FALSE(find_impossible_step(session));
}

TEST_CASE(
    "Nothing is concluded from keyframes of one scan or pose, or stamps that do not increase") {
  SessionData session = driven(1.0);
  move(session, 3, 80.0);
  REQUIRE(find_impossible_step(session));
  SessionData single = session;
  for (KeyframeRecord& keyframe : single.keyframes) keyframe.scans.resize(1);
  CHECK_FALSE(find_impossible_step(single));
  SessionData held = session;
  for (KeyframeRecord& keyframe : held.keyframes) {
    for (KeyframeScan& scan : keyframe.scans) scan.T_odometry_sensor = keyframe.T_odometry_keyframe;
  }
  CHECK_FALSE(find_impossible_step(held));
  for (KeyframeRecord& keyframe : session.keyframes) {
    for (KeyframeScan& scan : keyframe.scans) scan.stamp_ns = 7;
  }
  CHECK_FALSE(find_impossible_step(session));
  CHECK_FALSE(find_impossible_step({}));
}

TEST_CASE("A session whose odometry started anew is no part of the map, and says why", "[merger]") {
  const auto town = make_town(5, 1);
  const auto first = with_scans(record(town, drive_roads({{0, 0}, {1, 0}}), "first", 3).session);
  const auto right = with_scans(record(town, drive_roads({{1, 0}, {0, 0}}), "second", 4).session);
  SessionData wrong = right;
  move(wrong, wrong.keyframes.size() / 2, 40.0);
  const MergeResult together = merge_sessions({first, right}, MergeConfig{});
  REQUIRE(is_in_map(together.sessions[1].status));
  CHECK(together.sessions[1].reason.empty());
  const MergeResult apart = merge_sessions({first, wrong}, MergeConfig{});
  CHECK(apart.sessions[0].status == SessionStatus::kCentral);
  CHECK(apart.sessions[0].reason.empty());
  CHECK(apart.sessions[1].status == SessionStatus::kUnconnected);
  CHECK_THAT(apart.sessions[1].reason, Contains("its odometry steps by"));
  // Alone it is mapped, with that word.
  const MergeResult alone = merge_sessions({wrong}, MergeConfig{});
  CHECK(alone.sessions[0].status == SessionStatus::kCentral);
  CHECK_THAT(alone.sessions[0].reason, Contains("a new session must begin"));
}
