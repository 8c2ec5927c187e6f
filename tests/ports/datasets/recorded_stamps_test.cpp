// Tests of stamps against the order of recording.
#include "ports/datasets/recorded_stamps.hpp"

#include "tests/test.hpp"

using namespace unimapper::datasets;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kPeriod = kSecond / 10;

struct Message {
  std::int64_t stamp_ns;
  std::int64_t log_ns;
};

/// Sixty messages at 10 Hz, recorded 20 to 40 ms later.
struct Recording {
  std::vector<Message> messages;

  Recording() {
    for (std::int64_t i = 0; i < 60; ++i) {
      const std::int64_t stamp_ns = 1'700'000'000 * kSecond + i * kPeriod;
      messages.push_back({stamp_ns, stamp_ns + kSecond / 50 + i % 3 * kSecond / 100});
    }
  }
  void step(std::size_t first, std::int64_t by_ns) {
    for (std::size_t i = first; i < messages.size(); ++i) messages[i].stamp_ns += by_ns;
  }
  [[nodiscard]] RecordedStamps check() const { return check_stamps_of(messages); }
  [[nodiscard]] RecordedStamps check_without_log() const {
    std::vector<std::int64_t> stamps_ns;
    for (const Message& message : messages) stamps_ns.push_back(message.stamp_ns);
    return check_recorded_stamps(stamps_ns, {});
  }
};

}  // namespace

TEST_CASE("stamps in order are right, whatever they wait for") {
  Recording recording;
  std::vector<Message>& messages = recording.messages;
  SECTION("even") {}
  SECTION("scans are lost") { messages.erase(messages.begin() + 20, messages.begin() + 35); }
  SECTION("messages pile up for a second") {
    for (std::size_t i = 20; i < 30; ++i) messages[i].log_ns = messages[30].log_ns;
  }
  SECTION("a message is recorded after those behind it") {
    std::rotate(messages.begin() + 20, messages.begin() + 21, messages.begin() + 25);
    messages[24].log_ns = messages[23].log_ns + 1000;
  }
  SECTION("messages are recorded twice") {
    const Message again{messages[20].stamp_ns, messages[20].log_ns - 1000};
    messages.insert(messages.begin() + 20, again);
  }
  SECTION("the recorder's clock drifts") {
    for (std::size_t i = 0; i < 60; ++i)
      messages[i].log_ns += static_cast<std::int64_t>(i) * 500'000;
  }
  SECTION("recording is delayed from one message on") {
    for (std::size_t i = 40; i < 60; ++i) messages[i].log_ns += 3 * kSecond / 10;
  }
  SECTION("the recorder's clock is set back") {
    for (std::size_t i = 40; i < 60; ++i) messages[i].log_ns -= 3 * kSecond / 10;
  }
  SECTION("nothing at all") { messages.clear(); }
  const RecordedStamps found = recording.check();
  CHECK(found.glitches == 0);
  CHECK(found.steps.empty());
}

TEST_CASE("a stamp alone out of order is a glitch, onto another stamp or between them") {
  for (const std::int64_t by_ns : {kSecond, -kSecond, kSecond + kPeriod / 2, -3 * kPeriod}) {
    Recording recording;
    for (const std::size_t i : {15U, 30U, 44U}) recording.messages[i].stamp_ns += by_ns;
    const RecordedStamps found = recording.check();
    CHECK(found.steps.empty());
    CHECK(found.glitches == 3);
    CHECK(found.first_glitch == 15);
    CHECK(found.is_glitch[30]);
    // Without times of recording the order tells the same.
    CHECK(recording.check_without_log().is_glitch == found.is_glitch);
  }
}

TEST_CASE("a step that all later stamps follow is one of the clock") {
  for (const std::int64_t by_ns : {kSecond, -kSecond, -1'690'000'000 * kSecond}) {
    Recording recording;
    recording.step(40, by_ns);
    const RecordedStamps found = recording.check();
    CHECK(found.glitches == 0);
    REQUIRE(found.steps.size() == 1);
    CHECK(found.steps[0].first == 40);
    CHECK(std::abs(found.steps[0].by_ns - by_ns) <= kSecond / 50);
    // The longer part is taken for right.
    CHECK(found.without_steps(0, 0) == 0);
    CHECK(found.without_steps(59, 0) == -found.steps[0].by_ns);
  }
  Recording early;
  early.step(10, kSecond);
  CHECK(early.check().without_steps(0, 0) == early.check().steps.at(0).by_ns);
  CHECK(early.check().without_steps(59, 0) == 0);
}

TEST_CASE("without times of recording a step forward is a gap, one back a step") {
  Recording recording;
  recording.step(40, kSecond);
  CHECK(recording.check_without_log().steps.empty());
  recording.step(40, -3 * kSecond);
  const RecordedStamps found = recording.check_without_log();
  REQUIRE(found.steps.size() == 1);
  CHECK(found.steps[0].first == 40);
}

TEST_CASE("a step that both topics have is of one clock") {
  Recording scans;
  Recording poses;
  scans.step(10, -kSecond);
  poses.step(11, -kSecond);
  RecordedStamps of_scans = scans.check();
  RecordedStamps of_poses = poses.check();
  find_common_steps(of_poses, of_scans);
  REQUIRE(of_scans.steps.size() == 1);
  CHECK(of_scans.without_steps(0, 0) == 0);
  CHECK(of_scans.without_steps(59, 0) == of_poses.without_steps(59, 0));
}
