// Tests of what a publisher keeps of a base's words on the robot's place in its map.
#include "tests/ports/lcm/map_pose.hpp"

#include <catch2/catch.hpp>
#include <mutex>
#include <thread>

#include "ports/lcm/publisher.hpp"
#include "ports/lcm/shared_link.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace std::chrono_literals;
using lcm_test::map_pose_of;

namespace {

const SessionId kAlpha{4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};
const SessionInfo kAlphaInfo{kAlpha, "alpha", "os2-128"};

/// A network on which bases say whatever the test wants.
struct TalkingNetwork {
  std::mutex mutex;
  std::vector<ReceivedMapPose> waiting;

  Link link() {
    Link link;
    link.send = [](std::string_view, Bytes) { return true; };
    link.receive = [] { return std::vector<StoredMessage>(); };
    link.map_poses = [this] {
      const std::lock_guard lock(mutex);
      return std::exchange(waiting, {});
    };
    return link;
  }
  void say(const ReceivedMapPose& message) {
    const std::lock_guard lock(mutex);
    waiting.push_back(message);
  }
};

}  // namespace

TEST_CASE("of what bases say of places the newest of the own session is kept") {
  using Clock = std::chrono::steady_clock;
  LatestMapPose kept(kAlpha);
  CHECK_FALSE(kept.latest());
  kept.take(map_pose_of(kAlpha, 3, 7), Clock::time_point(1s));
  REQUIRE(kept.latest());
  CHECK(kept.latest()->message.sequence == 7);

  SECTION("a later keyframe replaces it") {
    kept.take(map_pose_of(kAlpha, 3, 8), Clock::time_point(2s));
    CHECK(kept.latest()->message.sequence == 8);
    CHECK(kept.latest()->arrival == Clock::time_point(2s));
  }
  SECTION("an earlier keyframe does not") {
    kept.take(map_pose_of(kAlpha, 3, 6), Clock::time_point(2s));
    CHECK(kept.latest()->message.sequence == 7);
    CHECK(kept.latest()->arrival == Clock::time_point(1s));
    CHECK(kept.counters().outdated == 1);
  }
  SECTION("a later epoch does, whatever the keyframe") {
    kept.take(map_pose_of(kAlpha, 4, 2), Clock::time_point(2s));
    CHECK(kept.latest()->message.epoch == 4);
    CHECK(kept.latest()->message.sequence == 2);
  }
  SECTION("an earlier epoch does not, whatever the keyframe") {
    kept.take(map_pose_of(kAlpha, 2, 99), Clock::time_point(2s));
    CHECK(kept.latest()->message.epoch == 3);
    CHECK(kept.counters().outdated == 1);
  }
  SECTION("said again, it is as young as the last time") {
    kept.take(map_pose_of(kAlpha, 3, 7), Clock::time_point(2s));
    CHECK(kept.latest()->arrival == Clock::time_point(2s));
    CHECK(kept.counters().taken == 2);
  }
  SECTION("another robot's, or another start's, is not its") {
    kept.take(map_pose_of({kAlpha.robot + 1, kAlpha.boot}, 3, 8), Clock::time_point(2s));
    kept.take(map_pose_of({kAlpha.robot, {1, 2}}, 3, 8), Clock::time_point(2s));
    CHECK(kept.latest()->message.sequence == 7);
    CHECK(kept.counters().of_others == 2);
  }
  SECTION("what is none is counted") {
    kept.take(std::nullopt, Clock::time_point(2s));
    CHECK(kept.latest()->message.sequence == 7);
    CHECK(kept.counters().malformed == 1);
  }
}

TEST_CASE(
    "a publisher knows the place in the map that a base tells, while it has nothing to send") {
  TalkingNetwork network;
  Publisher publisher(kAlphaInfo, network.link());
  CHECK_FALSE(publisher.map_pose());
  network.say(map_pose_of({kAlpha.robot, {1, 2}}, 3, 9));
  network.say(std::nullopt);
  network.say(map_pose_of(kAlpha, 3, 5));
  network.say(map_pose_of(kAlpha, 3, 4));
  // Within a tenth of a second; a session's message alone would take a whole one.
  const auto begin = std::chrono::steady_clock::now();
  while (!publisher.map_pose()) std::this_thread::sleep_for(1ms);
  CHECK(std::chrono::steady_clock::now() - begin < 800ms);
  while (publisher.counters().map_poses.outdated == 0) std::this_thread::sleep_for(1ms);
  CHECK(publisher.map_pose()->message.sequence == 5);
  const MapPoseCounters counters = publisher.counters().map_poses;
  CHECK(counters.taken == 1);
  CHECK(counters.of_others == 1);
  CHECK(counters.malformed == 1);
  publisher.finish();
  CHECK(publisher.map_pose()->message.sequence == 5);
}

TEST_CASE("every user of a shared link hears every place") {
  TalkingNetwork network;
  SharedLink shared(network.link());
  const Link one = shared.share();
  const Link two = shared.share();
  network.say(map_pose_of(kAlpha, 3, 5));
  CHECK(one.map_poses().size() == 1);
  CHECK(two.map_poses().size() == 1);
  CHECK(one.map_poses().empty());
}
