// Tests of sessions received as LCM messages and from event logs.
#include "ports/lcm/received_log.hpp"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <fstream>
#include <iterator>

#include "ports/lcm/event_log.hpp"
#include "ports/lcm/session_log.hpp"
#include "tests/ports/lcm/stream.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using lcm_test::Message;
using wire_test::check_whole;
using wire_test::Random;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};

void write_log(const std::filesystem::path& path, const SessionInfo& info,
               std::uint32_t keyframes) {
  SessionLogWriter writer(path, info, 2000);
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    writer.write(wire_test::encode_for_sending(wire_test::keyframe_of(info.id, i)));
  }
  writer.finish();
}

std::vector<char> content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
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
  SessionLogWriter writer(path, kAlpha, 2000);
  const auto write = [&writer](std::uint32_t sequence) {
    writer.write(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, sequence)));
  };
  write(0);
  {
    const SmallDisk disk(std::filesystem::file_size(path) + 100);
    CHECK_THROWS_AS(write(1), EventLogError);
    CHECK_THROWS_AS(write(2), EventLogError);
  }
  write(3);
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

TEST_CASE("a session goes through an event log unchanged") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 4);
  const ReceivedLog log = read_event_log(directory / "log");
  CHECK(log.faults.empty());
  REQUIRE(log.sessions.size() == 1);
  check_whole(log.sessions[0], kAlpha, 4);
}

TEST_CASE("a robot that loses power loses no keyframe it had written") {
  const TemporaryDirectory directory;
  SessionLogWriter writer(directory / "log", kAlpha, 2000);
  for (std::uint32_t i = 0; i < 3; ++i) {
    writer.write(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, i)));
    const ReceivedLog log = read_event_log(directory / "log");  // the writer is still open
    CHECK(log.faults.empty());
    REQUIRE(log.sessions.size() == 1);
    CHECK(log.sessions[0].keyframes.size() == i + 1);
    CHECK_FALSE(log.sessions[0].complete);
  }
}

TEST_CASE("equal keyframes give equal logs") {
  const TemporaryDirectory directory;
  write_log(directory / "a", kAlpha, 3);
  write_log(directory / "b", kAlpha, 3);
  CHECK(content(directory / "a") == content(directory / "b"));
}

TEST_CASE("a session without keyframes leaves a log with its name") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 0);
  const ReceivedLog log = read_event_log(directory / "log");
  REQUIRE(log.sessions.size() == 1);
  check_whole(log.sessions[0], kAlpha, 0);
}

TEST_CASE("several logs can be one stream, and other channels in them are skipped") {
  const TemporaryDirectory directory;
  std::vector<Message> stream = lcm_test::session_stream(kAlpha, 3);
  {
    EventLogWriter first(directory / "first");
    EventLogWriter second(directory / "second");
    for (std::size_t i = 0; i < stream.size(); ++i) {
      EventLogWriter& log = i % 2 == 0 ? first : second;
      log.write(static_cast<std::int64_t>(i), stream[i].channel, stream[i].data);
      log.write(static_cast<std::int64_t>(i), "CAMERA", std::vector<std::uint8_t>(100, 1));
    }
  }
  Receiver receiver;
  CHECK(feed_event_log(receiver, directory / "first").empty());
  CHECK(feed_event_log(receiver, directory / "second").empty());
  CHECK(receiver.counters().foreign == stream.size());
  check_whole(receiver.take_sessions().at(0), kAlpha, 3);
}

TEST_CASE("a torn log gives every keyframe that is whole in it") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 4);
  const std::vector<char> bytes = content(directory / "log");
  wire_test::MemoryFile torn;
  std::size_t last_keyframes = 0;
  for (std::size_t length = 0; length < bytes.size(); length += 37) {
    torn.write(bytes.data(), length);
    const ReceivedLog log = read_event_log(torn.path());
    const std::size_t keyframes = log.sessions.empty() ? 0 : log.sessions[0].keyframes.size();
    CHECK(keyframes >= last_keyframes);
    last_keyframes = keyframes;
    if (!log.sessions.empty()) CHECK_FALSE(log.sessions[0].complete);
  }
  CHECK(last_keyframes >= 3);
}

TEST_CASE("no flipped bit in a log gets an altered keyframe through") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 2);
  const std::vector<char> bytes = content(directory / "log");
  wire_test::MemoryFile file;
  Random random(12);
  for (int i = 0; i < 500; ++i) {
    std::vector<char> damaged = bytes;
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(bytes.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    file.write(damaged.data(), damaged.size());
    for (const SessionData& session : read_event_log(file.path()).sessions) {
      for (const KeyframeRecord& record : session.keyframes) {
        REQUIRE(encode_keyframe(record) ==
                encode_keyframe(wire_test::keyframe_of(kAlpha.id, record.sequence)));
      }
    }
  }
}
