// Tests of what a base answers to probes, and of what a publisher learns from its base.
#include "ports/lcm/shared_link.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/ports/lcm/network.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace unimapper::lcm_port::lcm_test;
using namespace std::chrono_literals;

namespace {

const SessionId kRobot = kMonday.id;
const SessionId kOtherStart{kRobot.robot, {1, 2}};

ProbeMessage probe_of(const SessionId& session, std::uint32_t number) {
  return {session, number, 0, 0, {}};
}

/// A network to a base that answers probes at once and whose clock is three hours ahead.
struct AnsweringNetwork : Network {
  static constexpr std::int64_t kAheadNs = 10800 * std::int64_t{1000000000};

  template <typename Clock>
  static std::int64_t now_ns() {
    return std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
  }

  Link link() {
    using Steady = std::chrono::steady_clock;
    Link link = Network::link();
    link.send = [this, send = link.send](std::string_view channel, Bytes message) {
      if (channel != kProbeChannel) return send(channel, message);
      const std::lock_guard lock(mutex);
      receiver.receive(
          decode_probe(message).value(),
          ProbeArrival{now_ns<Steady>(), now_ns<std::chrono::system_clock>() + kAheadNs});
      return true;
    };
    link.receipts = [this] {
      const std::lock_guard lock(mutex);
      std::vector<ReceivedReceipt> received;
      for (const auto& message : receiver.take_receipts(77, 1000000, now_ns<Steady>())) {
        received.push_back({message, Steady::now()});
      }
      return received;
    };
    return link;
  }
};

}  // namespace

TEST_CASE("a base answers each probe once, with the pieces before it and how long it took") {
  Receiver receiver;
  const auto pieces = cut_into_pieces(keyframe(kMonday, 0), 400);
  REQUIRE(pieces.size() > 3);
  receiver.receive(ChunkMessage(pieces[0]));
  receiver.receive(ChunkMessage(pieces[0]));
  receiver.receive(probe_of(kRobot, 5), ProbeArrival{1000, 2000});
  receiver.receive(ChunkMessage(pieces[1]));
  receiver.receive(probe_of(kRobot, 6), ProbeArrival{1500, 2500});
  const auto receipts = receiver.take_receipts(42, 1000000, 1600);
  REQUIRE(receipts.size() == 2);
  CHECK(receipts[0].session == kRobot);
  CHECK(receipts[0].base == 42);
  CHECK(receipts[0].number == 5);
  CHECK(receipts[0].pieces == 2);
  CHECK(receipts[0].held_ns == 600);
  CHECK(receipts[0].base_time_ns == 2000);
  CHECK(receipts[0].window_bytes == 1000000);
  CHECK(receipts[1].number == 6);
  CHECK(receipts[1].pieces == 3);
  CHECK(receiver.take_receipts(42, 1000000, 1700).empty());
}

TEST_CASE("the window is divided among the robots that are heard, and never too small for one") {
  Receiver receiver;
  const auto ask = [&](std::uint32_t robot, std::int64_t now_ns) {
    receiver.receive(probe_of({robot, {0, 1}}, 1), ProbeArrival{now_ns, now_ns});
  };
  for (std::uint32_t robot = 1; robot <= 4; ++robot) ask(robot, 0);
  for (const auto& receipt : receiver.take_receipts(1, 1000000, 0)) {
    CHECK(receipt.window_bytes == 250000);
  }
  ask(1, 10000000000);
  CHECK(receiver.take_receipts(1, 1000000, 10000000000).at(0).window_bytes == 1000000);
  ask(1, 10000000001);
  CHECK(receiver.take_receipts(1, 0, 10000000001).at(0).window_bytes == kSmallestWindow);
}

TEST_CASE("a flood of probes costs a bounded number of answers") {
  Receiver receiver;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    receiver.receive(probe_of(kRobot, i), ProbeArrival{i, i});
  }
  const auto receipts = receiver.take_receipts(1, 1000000, 5000);
  CHECK(receipts.size() <= 16);
  CHECK(receipts.back().number == 999);
}

TEST_CASE("robot and base learn the offset of their clocks, and the rate adapts") {
  AnsweringNetwork network;
  PublisherOptions options;
  options.datagram_bytes = 1300;
  options.session_period = 10ms;
  Publisher publisher(kMonday, network.link(), options);
  publish(publisher, kMonday, 10);
  const auto base_knows = [&] {
    const std::lock_guard lock(network.mutex);
    const auto progress = network.receiver.progress();
    return !progress.empty() && progress[0].clock && progress[0].bytes_per_second > 0;
  };
  while (!base_knows() || publisher.counters().keyframes_acknowledged < 10) {
    std::this_thread::sleep_for(1ms);
  }
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.rate_adapts);
  CHECK(counters.window_bytes == 1000000);
  CHECK(counters.loss == 0.0);
  REQUIRE(counters.clock);
  const std::int64_t error =
      std::abs(counters.clock->base_minus_robot_ns - AnsweringNetwork::kAheadNs);
  CHECK(error <= counters.clock->uncertainty_ns);
  wire_test::check_whole(network.sessions().at(0), kMonday, 10);
}

TEST_CASE("every user of a shared link hears every receipt and every place in the map") {
  Network network;
  Link link = network.link();
  link.receipts = [is_asked = false]() mutable {
    std::vector<ReceivedReceipt> receipts;
    if (!std::exchange(is_asked, true)) receipts.push_back({ReceiptMessage(), {}});
    return receipts;
  };
  SharedLink shared(link);
  const Link one = shared.share();
  const Link two = shared.share();
  network.say(map_pose_of(kRobot, 3, 5));
  for (const std::size_t messages : {1U, 0U}) {
    CHECK(one.receipts().size() == messages);
    CHECK(two.receipts().size() == messages);
    CHECK(one.map_poses().size() == messages);
    CHECK(two.map_poses().size() == messages);
  }
}

TEST_CASE("of what bases say of places the newest of the own session is kept") {
  using Time = std::chrono::steady_clock::time_point;
  struct Case {
    const char* what;
    ReceivedMapPose said;
    bool is_taken;
    std::uint64_t MapPoseCounters::*counter;
    std::uint64_t count;
  };
  const Case cases[] = {
      {"a later keyframe", map_pose_of(kRobot, 3, 8), true, &MapPoseCounters::taken, 2},
      {"an earlier keyframe", map_pose_of(kRobot, 3, 6), false, &MapPoseCounters::outdated, 1},
      {"a later epoch", map_pose_of(kRobot, 4, 2), true, &MapPoseCounters::taken, 2},
      {"an earlier epoch", map_pose_of(kRobot, 2, 99), false, &MapPoseCounters::outdated, 1},
      {"said again", map_pose_of(kRobot, 3, 7), true, &MapPoseCounters::taken, 2},
      {"another robot's", map_pose_of({kRobot.robot + 1, kRobot.boot}, 3, 8), false,
       &MapPoseCounters::of_others, 1},
      {"another start's", map_pose_of(kOtherStart, 3, 8), false, &MapPoseCounters::of_others, 1},
      {"malformed", std::nullopt, false, &MapPoseCounters::malformed, 1},
  };
  for (const Case& one : cases) {
    INFO(one.what);
    LatestMapPose kept(kRobot);
    CHECK_FALSE(kept.latest());
    kept.take(map_pose_of(kRobot, 3, 7), Time(1s));
    kept.take(one.said, Time(2s));
    const HeardMapPose& latest = kept.latest().value();
    CHECK(latest.message.session == kRobot);
    CHECK(latest.message.epoch == (one.is_taken ? one.said->epoch : 3));
    CHECK(latest.message.sequence == (one.is_taken ? one.said->sequence : 7));
    CHECK(latest.arrival == Time(one.is_taken ? 2s : 1s));
    CHECK(kept.counters().*one.counter == one.count);
  }
}

TEST_CASE(
    "a publisher knows the place in the map that a base tells, while it has nothing to send") {
  Network network;
  Publisher publisher(kMonday, network.link());
  CHECK_FALSE(publisher.map_pose());
  network.say(map_pose_of(kOtherStart, 3, 9));
  network.say(std::nullopt);
  network.say(map_pose_of(kRobot, 3, 5));
  network.say(map_pose_of(kRobot, 3, 4));
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
