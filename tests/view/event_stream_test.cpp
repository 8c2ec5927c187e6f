// Tests of the stream of events.
#include "src/apps/view/event_stream.hpp"

#include "tests/test.hpp"

using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

constexpr std::chrono::milliseconds kMoment{1};
constexpr std::chrono::seconds kLong{20};

}  // namespace

TEST_CASE("a follower gets each event once, in order") {
  EventStream events;
  std::uint64_t seen = events.latest();
  bool missed = false;
  CHECK(events.after(seen, kMoment, missed).empty());
  events.publish("map", R"({"epoch":1})");
  events.publish("map", R"({"epoch":2})");
  CHECK(events.after(seen, kMoment, missed) ==
        "id: 1\nevent: map\ndata: {\"epoch\":1}\n\nid: 2\nevent: map\ndata: {\"epoch\":2}\n\n");
  CHECK_FALSE(missed);
  CHECK(events.after(seen, kMoment, missed).empty());
}

TEST_CASE("a follower that is too slow is told that it missed some") {
  EventStream events;
  std::uint64_t seen = 0;
  for (int i = 0; i < 2000; ++i) events.publish("keyframe", "{}");
  bool missed = false;
  CHECK_THAT(events.after(seen, kMoment, missed), Contains("id: 2000\n"));
  CHECK(missed);
  CHECK(seen == 2000);
}

TEST_CASE("who waits for an event wakes when it comes, and when the stream is closed") {
  EventStream events;
  std::uint64_t seen = 0;
  bool missed = false;
  std::thread sender([&] { events.publish("map", "{}"); });
  CHECK_FALSE(events.after(seen, kLong, missed).empty());
  sender.join();
  std::thread closer([&] { events.close(); });
  CHECK(events.after(seen, kLong, missed).empty());
  closer.join();
  CHECK(events.is_closed());
}
