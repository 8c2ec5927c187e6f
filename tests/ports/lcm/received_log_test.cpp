// Tests of sessions received as LCM messages and from event logs.
#include "ports/lcm/received_log.hpp"

#include <sys/resource.h>

#include <csignal>

#include "ports/lcm/event_log.hpp"
#include "ports/lcm/session_log.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/ports/lcm/network.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace unimapper::lcm_port::lcm_test;
using wire_test::check_whole;
using wire_test::Random;

namespace {

void write_log(const std::filesystem::path& path, std::uint32_t keyframes) {
  SessionLogWriter writer(path, kMonday, 2000);
  for (std::uint32_t i = 0; i < keyframes; ++i) writer.write(keyframe(kMonday, i));
  writer.finish();
}

/// A disk on which files grow to `bytes` at most, for as long as it lives.
class SmallDisk {
 public:
  explicit SmallDisk(std::uintmax_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = static_cast<rlim_t>(bytes);
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

}  // namespace

TEST_CASE("a full disk costs a session's log the keyframes of that time, and no other") {
  const TemporaryDirectory directory;
  const std::filesystem::path path = directory / "log";
  SessionLogWriter writer(path, kMonday, 2000);
  writer.write(keyframe(kMonday, 0));
  {
    const SmallDisk disk(std::filesystem::file_size(path) + 100);
    CHECK_THROWS_AS(writer.write(keyframe(kMonday, 1)), EventLogError);
    CHECK_THROWS_AS(writer.write(keyframe(kMonday, 2)), EventLogError);
  }
  writer.write(keyframe(kMonday, 3));
  writer.finish();
  EventLogReader reader(path);
  LogEvent event;
  for (std::int64_t number = 0; reader.next(event); ++number) CHECK(event.number == number);
  CHECK(reader.fault_count() == 0);
  const auto sessions = read_event_log(path).sessions;
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].complete);
  CHECK(sessions[0].keyframes_missing == 2);
  REQUIRE(sessions[0].keyframes.size() == 2);
  CHECK(sessions[0].keyframes[0].sequence == 0);
  CHECK(sessions[0].keyframes[1].sequence == 3);
}

TEST_CASE("rubbish on every channel is counted and harmless") {
  Random random(9);
  Receiver receiver;
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::uint8_t> data(random.below(200));
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random.bits());
    const std::string_view channels[] = {kSessionChannel, kKeyframeChannel, kHealthChannel,
                                         "SOMETHING_ELSE"};
    receive(receiver, channels[random.below(4)], data);
  }
  const ReceiverCounters counters = receiver.counters();
  CHECK(counters.malformed == counters.messages);
  CHECK(counters.foreign + counters.messages == 20000);
  CHECK(receiver.take_sessions().empty());
}

TEST_CASE("a session goes through an event log unchanged, with its name even without keyframes") {
  const std::uint32_t keyframes = GENERATE(0U, 4U);
  const TemporaryDirectory directory;
  write_log(directory / "log", keyframes);
  const ReceivedLog log = read_event_log(directory / "log");
  CHECK(log.faults.empty());
  REQUIRE(log.sessions.size() == 1);
  check_whole(log.sessions[0], kMonday, keyframes);
}

TEST_CASE("a robot that loses power loses no keyframe it had written") {
  const TemporaryDirectory directory;
  SessionLogWriter writer(directory / "log", kMonday, 2000);
  for (std::uint32_t i = 0; i < 3; ++i) {
    writer.write(keyframe(kMonday, i));
    const ReceivedLog log = read_event_log(directory / "log");  // the writer is still open
    CHECK(log.faults.empty());
    REQUIRE(log.sessions.size() == 1);
    CHECK(log.sessions[0].keyframes.size() == i + 1);
    CHECK_FALSE(log.sessions[0].complete);
  }
}

TEST_CASE("equal keyframes give equal logs") {
  const TemporaryDirectory directory;
  write_log(directory / "a", 3);
  write_log(directory / "b", 3);
  CHECK(bytes_of(directory / "a") == bytes_of(directory / "b"));
}

TEST_CASE("several logs can be one stream, and other channels in them are skipped") {
  const TemporaryDirectory directory;
  write_log(directory / "log", 3);
  std::uint64_t events = 0;
  {
    EventLogReader reader(directory / "log");
    EventLogWriter first(directory / "first");
    EventLogWriter second(directory / "second");
    LogEvent event;
    for (; reader.next(event); ++events) {
      EventLogWriter& log = events % 2 == 0 ? first : second;
      log.write(event.stamp_us, event.channel, event.data);
      log.write(event.stamp_us, "CAMERA", std::vector<std::uint8_t>(100, 1));
    }
  }
  Receiver receiver;
  CHECK(feed_event_log(receiver, directory / "first").empty());
  CHECK(feed_event_log(receiver, directory / "second").empty());
  CHECK(receiver.counters().foreign == events);
  check_whole(receiver.take_sessions().at(0), kMonday, 3);
}

TEST_CASE("no flipped bit in a log gets an altered keyframe through") {
  const TemporaryDirectory directory;
  write_log(directory / "log", 2);
  const auto bytes = bytes_of(directory / "log");
  wire_test::MemoryFile file;
  Random random(12);
  for (int i = 0; i < 500; ++i) {
    const auto bits = static_cast<std::uint32_t>(8 * bytes.size());
    const auto damaged = with_flipped(bytes, random.below(bits));
    file.write(damaged.data(), damaged.size());
    for (const SessionData& session : read_event_log(file.path()).sessions) {
      for (const KeyframeRecord& record : session.keyframes) {
        REQUIRE(encode_keyframe(record) == keyframe(kMonday, record.sequence).bytes);
      }
    }
  }
}
