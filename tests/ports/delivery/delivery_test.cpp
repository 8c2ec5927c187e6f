// Tests of the delivery of a session and of what earlier starts left.
#include "ports/delivery/delivery.hpp"

#include "ports/delivery/keyframe_head.hpp"
#include "ports/spool/spool.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/ports/lcm/network.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::delivery;
using namespace unimapper::lcm_port::lcm_test;
using namespace unimapper::wire;
using namespace std::chrono_literals;

namespace {

DeliveryOptions options_with(const std::filesystem::path& spool) {
  DeliveryOptions options;
  options.spool = spool;
  options.publisher.bytes_per_second = 1e9;
  options.publisher.session_period = 20ms;
  return options;
}

}  // namespace

TEST_CASE("what a start leaves in the spool the next one delivers beside its own session") {
  const TemporaryDirectory folder;
  Network base({.reached = false});
  {
    Delivery delivery(kMonday, options_with(folder / "spool"), base.link());
    publish(delivery, kMonday, 7);
  }  // nobody was there
  base.reach();
  const DeliveryCounters counters = [&] {
    Delivery delivery(kTuesday, options_with(folder / "spool"), base.link());
    CHECK(delivery.counters().earlier.keyframes == 7);
    publish(delivery, kTuesday, 5);
    return delivery.finish();
  }();
  CHECK(counters.published);
  CHECK(counters.spooled);
  CHECK(counters.own.keyframes_acknowledged == 5);
  CHECK(counters.earlier.sessions_delivered == 1);
  CHECK(counters.earlier.keyframes_acknowledged == 7);
  CHECK(counters.earlier.keyframes_lost == 0);
  CHECK(counters.disk.keyframes_durable == 5);
  const auto sessions = base.sessions();
  REQUIRE(sessions.size() == 2);
  wire_test::check_whole(sessions[0], kMonday, 7);
  wire_test::check_whole(sessions[1], kTuesday, 5);
  // The start after has nothing left to do.
  const spool::Spool spool(folder / "spool");
  for (const EarlierSession& session : spool.earlier_sessions()) {
    CHECK(session.ended);
    CHECK(session.waiting.empty());
  }
}

TEST_CASE("a delivery knows where the base says that its robot is, and earlier sessions do not") {
  const TemporaryDirectory folder;
  Network base({.reached = false});
  {
    Delivery delivery(kMonday, options_with(folder / "spool"), base.link());
    publish(delivery, kMonday, 2);
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

TEST_CASE("without a network keyframes wait in the spool; an end waits no longer than it may") {
  const TemporaryDirectory folder;
  Network base({.reached = false});
  {
    Delivery delivery(kMonday, options_with(folder / "spool"));
    publish(delivery, kMonday, 3);
    CHECK_FALSE(delivery.is_published());
    CHECK_FALSE(delivery.map_pose());
    const DeliveryCounters counters = delivery.finish();
    CHECK_FALSE(counters.published);
    CHECK(counters.disk.keyframes_durable == 3);
  }
  DeliveryOptions options = options_with(folder / "spool");
  options.publisher.finish_timeout = 0ms;
  options.finish_timeout = 0ms;
  Delivery delivery(kTuesday, std::move(options), base.link());
  const DeliveryCounters counters = delivery.finish();
  CHECK(counters.earlier.sessions_delivered == 0);
  CHECK(counters.earlier.keyframes == 3);
}

TEST_CASE("the head of an encoded keyframe is that of its record; what is none has no head") {
  const auto bytes = encode_keyframe(wire_test::keyframe_of(kMonday.id, 42));
  const auto head = read_head(bytes);
  REQUIRE(head);
  CHECK(head->session == kMonday.id);
  CHECK(head->sequence == 42);
  for (std::size_t length = 0; length < 32; ++length) {
    INFO("cut after " << length << " bytes");
    CHECK_FALSE(read_head(Bytes(bytes).first(length)));
  }
  for (const std::size_t at : {0U, 4U}) {  // of the magic word, of the schema
    auto other = bytes;
    ++other[at];
    CHECK_FALSE(read_head(other));
  }
}
