// Tests of the delivery of a session and of what earlier starts left.
#include "ports/delivery/delivery.hpp"

#include <catch2/catch.hpp>
#include <thread>

#include "ports/delivery/keyframe_head.hpp"
#include "tests/ports/delivery/base.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::delivery;
using namespace unimapper::delivery::delivery_test;
using namespace unimapper::wire;
using namespace std::chrono_literals;
using lcm_port::lcm_test::map_pose_of;

namespace {

const SessionInfo kMonday{{1, {3, 11}}, "monday", "os2-128"};
const SessionInfo kTuesday{{1, {3, 12}}, "tuesday", "os2-128"};

EncodedKeyframe keyframe(const SessionInfo& info, std::uint32_t sequence) {
  return wire_test::encode_for_sending(wire_test::keyframe_of(info.id, sequence));
}

DeliveryOptions options_with(const std::filesystem::path& spool) {
  DeliveryOptions options;
  options.spool = spool;
  options.publisher.bytes_per_second = 1e9;
  options.publisher.session_period = 20ms;
  return options;
}

void publish(Delivery& delivery, std::uint32_t keyframes) {
  for (std::uint32_t i = 0; i < keyframes; ++i) delivery.publish(keyframe(delivery.info(), i));
}

}  // namespace

TEST_CASE("what a start leaves in the spool the next one delivers beside its own session") {
  const TemporaryDirectory folder;
  Base base;
  {
    Delivery delivery(kMonday, options_with(folder / "spool"), base.link());
    publish(delivery, 7);
  }  // nobody was there
  base.reach();
  Delivery delivery(kTuesday, options_with(folder / "spool"), base.link());
  CHECK(delivery.counters().earlier.keyframes == 7);
  publish(delivery, 5);
  const DeliveryCounters counters = delivery.finish();
  CHECK(counters.published);
  CHECK(counters.spooled);
  CHECK(counters.own.keyframes_acknowledged == 5);
  CHECK(counters.earlier.sessions_delivered == 1);
  CHECK(counters.earlier.keyframes_acknowledged == 7);
  CHECK(counters.disk.keyframes_durable == 5);
  const auto sessions = base.sessions();
  REQUIRE(sessions.size() == 2);
  wire_test::check_whole(sessions[sessions[0].info.name == "monday" ? 0 : 1], kMonday, 7);
  wire_test::check_whole(sessions[sessions[0].info.name == "monday" ? 1 : 0], kTuesday, 5);
}

TEST_CASE("without a network a delivery keeps keyframes for a later start") {
  const TemporaryDirectory folder;
  Base base;
  {
    Delivery delivery(kMonday, options_with(folder / "spool"));
    CHECK_FALSE(delivery.is_published());
    publish(delivery, 3);
    const DeliveryCounters counters = delivery.finish();
    CHECK_FALSE(counters.published);
    CHECK(counters.disk.keyframes_durable == 3);
  }
  base.reach();
  Delivery delivery(kTuesday, options_with(folder / "spool"), base.link());
  CHECK(delivery.finish().earlier.keyframes_acknowledged == 3);
}

TEST_CASE("a delivery knows where the base says that its robot is, and earlier sessions do not") {
  const TemporaryDirectory folder;
  Base base;
  {
    Delivery delivery(kMonday, options_with(folder / "spool"), base.link());
    publish(delivery, 2);
    CHECK_FALSE(delivery.map_pose());
  }
  base.reach();
  Delivery delivery(kTuesday, options_with(folder / "spool"), base.link());
  base.say(map_pose_of(kMonday.id, 3, 1));
  base.say(map_pose_of(kTuesday.id, 3, 7));
  while (!delivery.map_pose()) std::this_thread::sleep_for(1ms);
  CHECK(delivery.map_pose()->message.session == kTuesday.id);
  CHECK(delivery.map_pose()->message.sequence == 7);
  CHECK(delivery.finish().own.map_poses.of_others == 1);
  CHECK(delivery.map_pose()->message.sequence == 7);
}

TEST_CASE("without a network no base says where a robot is") {
  const TemporaryDirectory folder;
  const Delivery delivery(kMonday, options_with(folder / "spool"));
  CHECK_FALSE(delivery.map_pose());
}

TEST_CASE("the end of a delivery waits for earlier sessions no longer than it may") {
  const TemporaryDirectory folder;
  Base base;
  {
    Delivery delivery(kMonday, options_with(folder / "spool"));
    publish(delivery, 3);
  }
  DeliveryOptions options = options_with(folder / "spool");
  options.publisher.finish_timeout = 0ms;
  options.finish_timeout = 0ms;
  Delivery delivery(kTuesday, std::move(options), base.link());
  const DeliveryCounters counters = delivery.finish();
  CHECK(counters.earlier.sessions_delivered == 0);
  CHECK(counters.earlier.keyframes == 3);
}

TEST_CASE("the head of an encoded keyframe is that of its record") {
  const auto bytes = encode_keyframe(wire_test::keyframe_of(kMonday.id, 42));
  const auto head = read_head(bytes);
  REQUIRE(head);
  CHECK(head->session == kMonday.id);
  CHECK(head->sequence == 42);
}

TEST_CASE("what is no keyframe of this schema has no head") {
  const auto bytes = encode_keyframe(wire_test::keyframe_of(kMonday.id, 0));
  for (std::size_t length = 0; length < 32; ++length) {
    INFO("cut after " << length << " bytes");
    CHECK_FALSE(read_head(Bytes(bytes).first(length)));
  }
  auto other_magic = bytes;
  ++other_magic[0];
  CHECK_FALSE(read_head(other_magic));
  auto other_schema = bytes;
  ++other_schema[4];
  CHECK_FALSE(read_head(other_schema));
}
