// Tests of alarms of robots: each is raised, and is over again.
#include "src/apps/view/robot_alarms.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;

namespace {

constexpr std::int64_t kNow = 1'800'000'000;

store::SessionListing session_of(bool ended = false) {
  store::SessionListing session;
  session.row = 4;
  session.info.name = "avia";
  session.ended = ended;
  session.announced = session.keyframes = 50;
  return session;
}

/// A message that was received then, after `health` had been.
store::HealthRow message(std::int64_t received_s, store::HealthRow health = {}) {
  health.session = 4;
  health.received_s = received_s;
  return health;
}

using Texts = std::vector<std::string>;

Texts texts(const std::vector<store::HealthRow>& history, std::int64_t now_s = kNow,
            const store::SessionListing& session = session_of()) {
  Texts texts;
  for (const RobotAlarm& alarm : alarms_of(session, history, now_s)) {
    texts.push_back(alarm.kind + ": " + alarm.text);
  }
  return texts;
}

}  // namespace

TEST_CASE("missed deadlines are an alarm of their own session until a minute is without") {
  store::HealthRow health;
  health.deadline_misses = 3;
  const auto first = message(kNow - 60, health);
  auto other = message(kNow, health);
  other.session = 5;
  CHECK(texts({message(kNow), other}) == Texts{});
  health.deadline_misses = 5;
  const auto second = message(kNow, health);
  CHECK(texts({first}, kNow - 60) ==
        Texts{"deadline: missed its deadline 3 times within a minute"});
  CHECK(texts({first, second}) == Texts{"deadline: missed its deadline 2 times within a minute"});
  CHECK(texts({first, second, message(kNow + 60, health)}, kNow + 60) == Texts{});
}

TEST_CASE("drops are alarms by cause, but for those that are no fault of the robot's") {
  store::HealthRow health;
  health.details = {{"drop", "cells_full", {10}}, {"drop", "out_of_range", {10}}};
  const auto first = message(kNow - 60, health);
  health.details = {{"drop", "cells_full", {17}},
                    {"drop", "out_of_range", {900}},
                    {"drop", "not_finite", {8}},
                    {"drop", "description_full", {8}},
                    {"drop", "of a later version", {1}}};
  CHECK(texts({first, message(kNow, health)}) ==
        Texts{"dropped cells_full: dropped 7 within a minute: cells_full",
              "dropped of a later version: dropped 1 within a minute: of a later version"});
  CHECK(texts({first, message(kNow, health), message(kNow + 60, health)}, kNow + 60) == Texts{});
}

TEST_CASE("a container is nearly full at nine tenths") {
  store::HealthRow health;
  health.details = {{"container", "spool", {9, 10}}, {"container", "cells", {89, 100}}};
  CHECK(texts({message(kNow, health)}) == Texts{"full spool: spool is 90 % full"});
  health.details = {{"container", "spool", {8, 10}}, {"container", "odd", {5, 0}}};
  CHECK(texts({message(kNow, health)}) == Texts{});
}

TEST_CASE("a clock that was set is an alarm, an offset is none") {
  store::HealthRow health;
  health.details = {{"clock", "90000000000", {500000, 0}}};
  const auto first = message(kNow - 60, health);
  CHECK(texts({first}, kNow - 60) == Texts{});
  health.details = {{"clock", "-2500000", {500000, 1}}};
  const auto second = message(kNow, health);
  CHECK(texts({first, second}) ==
        Texts{"clock: a clock was set: the base's is ahead of the robot's by -2.5 ms now"});
  CHECK(texts({first, second, message(kNow + 60, health)}, kNow + 60) == Texts{});
}

TEST_CASE("a robot that is silent is an alarm for an hour, unless its session has ended") {
  const std::vector<store::HealthRow> history = {message(kNow - 31)};
  CHECK(texts({message(kNow - 30)}) == Texts{});
  CHECK(texts(history) == Texts{"silence: sends nothing, and its session has not ended"});
  CHECK(alarms_of(session_of(), history, kNow).at(0).since_s == kNow - 31);
  CHECK(texts(history, kNow, session_of(true)) == Texts{});
  CHECK(texts(history, kNow + kAlarmedSeconds) == Texts{});
  CHECK(texts({message(kNow - 31), message(kNow)}) == Texts{});
}

TEST_CASE("keyframes that do not arrive are an alarm, also once the session has ended") {
  store::HealthRow health;
  health.keyframes = 52;
  const auto made = message(kNow - 60, health);
  health.keyframes = 90;
  store::SessionListing session = session_of();
  CHECK(texts({message(kNow, health)}) == Texts{});  // they have had no time
  CHECK(texts({made, message(kNow, health)}) ==
        Texts{"missing: 2 keyframes have not arrived within a minute"});
  session.keyframes = 52;
  CHECK(texts({made, message(kNow, health)}, kNow, session) == Texts{});
  session.announced = 90;
  session.ended = true;
  CHECK(texts({}, kNow, session) ==
        Texts{"missing: 38 of 90 keyframes are missing, and its session has ended"});
  session.keyframes = 90;
  CHECK(texts({}, kNow, session) == Texts{});
}

TEST_CASE("alarms are told when they are new, say something new, or are over") {
  AlarmList list;
  const RobotAlarm one{4, "avia", "deadline", "2 times", kNow};
  auto changes = list.replace({one});
  REQUIRE(changes.size() == 1);
  CHECK_FALSE(changes[0].is_over);
  RobotAlarm same = one;
  same.since_s = kNow + 1;
  CHECK(list.replace({same}).empty());
  CHECK(list.present().at(0).since_s == kNow);
  same.text = "3 times";
  changes = list.replace({same, {5, "avia-2", "deadline", "2 times", kNow}});
  REQUIRE(changes.size() == 2);
  CHECK(changes[0].alarm.text == "3 times");
  CHECK(changes[0].alarm.since_s == kNow);
  CHECK(changes[1].alarm.session == 5);
  changes = list.replace({same});
  REQUIRE(changes.size() == 1);
  CHECK(changes[0].is_over);
  CHECK(changes[0].alarm.session == 5);
  CHECK(list.replace({}).size() == 1);
  CHECK(list.present().empty());
}
