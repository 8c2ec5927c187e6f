// Tests of topics in shared memory: order, leases, loss, restarts.
#include <sys/stat.h>
#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cerrno>
#include <string>
#include <vector>

#include "tests/ports/shared_memory/share.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::publish;
using test::small;
using test::TestShare;
using test::text_of;

namespace {

ReaderOptions from_oldest() {
  ReaderOptions options;
  options.start = ReaderOptions::Start::kOldest;
  return options;
}

}  // namespace

TEST_CASE("A message arrives as it was written, in the writer's own memory") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  Sample sample;
  CHECK(reader.take(sample) == Taken::kNothing);
  CHECK(publish(writer, "one") == 1);
  REQUIRE(reader.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "one");
  CHECK(sample.sequence() == 1);
  CHECK(sample.stamp_ns() == 7);
  CHECK(sample.missed() == 0);
  CHECK(sample.intact());
  sample.release();
  CHECK_FALSE(sample.has_message());
  CHECK(reader.take(sample) == Taken::kNothing);
}

TEST_CASE("Stamps before 1970 and far in the future survive") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  for (const std::int64_t stamp : {std::int64_t{-1}, INT64_MIN, INT64_MAX, std::int64_t{1} << 32}) {
    (void)writer.loan();
    REQUIRE(writer.publish(1, stamp) != 0);
    Sample sample;
    REQUIRE(reader.take(sample) == Taken::kMessage);
    CHECK(sample.stamp_ns() == stamp);
  }
}

TEST_CASE("A consumer that keeps up gets every message in order") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  for (std::uint32_t i = 1; i <= 100; ++i) {
    REQUIRE(publish(writer, std::to_string(i)) == i);
    Sample sample;
    REQUIRE(reader.take(sample) == Taken::kMessage);
    CHECK(text_of(sample) == std::to_string(i));
  }
  CHECK(reader.missed() == 0);
}

TEST_CASE("A consumer that is late learns how many messages it missed") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "1") == 1);
  Sample sample;
  REQUIRE(reader.take(sample) == Taken::kMessage);
  sample.release();
  for (int i = 2; i <= 20; ++i) REQUIRE(publish(writer, std::to_string(i)) != 0);
  REQUIRE(reader.take(sample) == Taken::kMessage);
  // Two consumers with two leases, one to write, three of history: 8 chunks, none of them leased.
  CHECK(sample.sequence() == 13);
  CHECK(text_of(sample) == "13");
  CHECK(sample.missed() == 11);
  CHECK(reader.missed() == 11);
  for (int i = 14; i <= 20; ++i) {
    REQUIRE(reader.take(sample) == Taken::kMessage);
    CHECK(text_of(sample) == std::to_string(i));
    CHECK(sample.missed() == 0);
  }
  CHECK(reader.take(sample) == Taken::kNothing);
}

TEST_CASE("Those who want the newest message skip the others without missing them") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  for (int i = 1; i <= 5; ++i) REQUIRE(publish(writer, std::to_string(i)) != 0);
  Sample sample;
  REQUIRE(reader.take_latest(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "5");
  CHECK(reader.missed() == 0);
  CHECK(reader.take_latest(sample) == Taken::kNothing);
}

TEST_CASE("A late joiner gets the latest message, or the oldest that is there") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  for (int i = 1; i <= 20; ++i) REQUIRE(publish(writer, std::to_string(i)) != 0);
  Reader latest;
  Reader oldest;
  REQUIRE(latest.open(share.name(), "topic").ok);
  REQUIRE(oldest.open(share.name(), "topic", from_oldest()).ok);
  Sample sample;
  REQUIRE(latest.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "20");
  sample.release();
  REQUIRE(oldest.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "13");
  CHECK(sample.missed() == 0);
}

TEST_CASE("With every lease held the writer goes on and touches none of them") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  std::array<Reader, 2> readers;
  std::array<Sample, 4> samples;
  for (Reader& reader : readers) REQUIRE(reader.open(share.name(), "topic").ok);
  for (std::size_t i = 0; i < 4; ++i) {
    REQUIRE(publish(writer, "held " + std::to_string(i)) != 0);
    // Both take the odd ones, so the leases are of different chunks.
    Reader& reader = readers.at(i / 2);
    REQUIRE(reader.take_latest(samples.at(i)) == Taken::kMessage);
  }
  for (int i = 0; i < 1000; ++i) REQUIRE(publish(writer, "new") != 0);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(samples.at(i).intact());
    CHECK(text_of(samples.at(i)) == "held " + std::to_string(i));
  }
  CHECK(writer.consumer(0).leases == 2);
  CHECK(writer.consumer(1).leases == 2);
}

TEST_CASE("A consumer holds no more messages than it may") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  for (int i = 0; i < 3; ++i) REQUIRE(publish(writer, "x") != 0);
  std::array<Sample, 3> samples;
  REQUIRE(reader.take(samples[0]) == Taken::kMessage);
  REQUIRE(publish(writer, "x") != 0);
  REQUIRE(reader.take(samples[1]) == Taken::kMessage);
  REQUIRE(publish(writer, "x") != 0);
  CHECK(reader.take(samples[2]) == Taken::kLeasesUsed);
  samples[0].release();
  CHECK(reader.take(samples[2]) == Taken::kMessage);
}

TEST_CASE("A moved sample keeps its lease, and only the last owner gives it back") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "x") != 0);
  Sample kept;
  {
    Sample sample;
    REQUIRE(reader.take(sample) == Taken::kMessage);
    kept = std::move(sample);
  }
  CHECK(writer.consumer(reader.slot()).leases == 1);
  CHECK(kept.intact());
  kept.release();
  CHECK(writer.consumer(reader.slot()).leases == 0);
}

TEST_CASE("Revoked leases end, and the sample says so once its memory is used") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "old") != 0);
  Sample sample;
  REQUIRE(reader.take(sample) == Taken::kMessage);
  for (int i = 0; i < 20; ++i) REQUIRE(publish(writer, "new") != 0);
  CHECK(sample.intact());
  writer.revoke(reader.slot());
  CHECK(writer.consumer(reader.slot()).leases == 0);
  for (int i = 0; i < 20; ++i) REQUIRE(publish(writer, "new") != 0);
  CHECK_FALSE(sample.intact());
  sample.release();
  REQUIRE(reader.take_latest(sample) == Taken::kMessage);
  for (int i = 0; i < 20; ++i) REQUIRE(publish(writer, "new") != 0);
  CHECK(sample.intact());
}

TEST_CASE("A topic has one writer, and another one only after it") {
  const TestShare share;
  Writer first;
  REQUIRE(first.open(share.name(), "topic", small()).ok);
  Writer second;
  const Outcome refused = second.open(share.name(), "topic", small());
  CHECK_FALSE(refused.ok);
  CHECK(refused.error_number == EBUSY);
  CHECK(second.loan().empty());
  CHECK(publish(first, "still there") == 1);
  first = Writer();
  CHECK(second.open(share.name(), "topic", small()).ok);
  CHECK(publish(second, "next") == 2);
}

TEST_CASE("A new writer goes on where the last one ended, and leases survive it") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "first writer") == 1);
  Sample held;
  REQUIRE(reader.take(held) == Taken::kMessage);
  CHECK(reader.has_writer());
  // Ends in the middle of a message.
  std::memset(writer.loan().data(), 0xAA, 10);
  writer = Writer();
  CHECK_FALSE(reader.has_writer());

  Writer next;
  REQUIRE(next.open(share.name(), "topic", small()).ok);
  CHECK(reader.has_writer());
  CHECK_FALSE(reader.is_replaced());
  for (int i = 0; i < 20; ++i) REQUIRE(publish(next, "second writer") != 0);
  CHECK(held.intact());
  CHECK(text_of(held) == "first writer");
  Sample sample;
  REQUIRE(reader.take_latest(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "second writer");
  CHECK(sample.sequence() == 21);
  CHECK(sample.writer() == held.writer() + 1);
}

TEST_CASE("A writer of another size makes the topic anew, and readers notice") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "old") != 0);
  Sample held;
  REQUIRE(reader.take(held) == Taken::kMessage);
  writer = Writer();
  WriterOptions larger = small();
  larger.message_bytes = 1U << 20U;
  REQUIRE(writer.open(share.name(), "topic", larger).ok);
  REQUIRE(publish(writer, "new") == 1);
  CHECK(reader.is_replaced());
  CHECK_FALSE(reader.wait(10'000'000'000));
  CHECK(text_of(held) == "old");
  held.release();
  REQUIRE(reader.open(share.name(), "topic").ok);
  REQUIRE(reader.take(held) == Taken::kMessage);
  CHECK(text_of(held) == "new");
}

TEST_CASE("A removed topic is gone for those who come, not for those who are there") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  REQUIRE(publish(writer, "x") != 0);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  writer.remove();
  CHECK(writer.loan().empty());
  CHECK(reader.is_replaced());
  Sample sample;
  REQUIRE(reader.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "x");
  Reader late;
  CHECK(late.open(share.name(), "topic").error_number == ENOENT);
}

TEST_CASE("Consumers beyond the slots are refused until one leaves") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader first;
  REQUIRE(first.open(share.name(), "topic").ok);
  Reader third;
  {
    Reader second;
    REQUIRE(second.open(share.name(), "topic").ok);
    CHECK(second.slot() != first.slot());
    CHECK(third.open(share.name(), "topic").error_number == EBUSY);
  }
  CHECK(third.open(share.name(), "topic").ok);
}

TEST_CASE("What a killed consumer held is given back, and its slot is free at once") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  REQUIRE(publish(writer, "x") != 0);
  const pid_t child = fork();
  if (child == 0) {
    Reader reader;
    Sample sample;
    if (!reader.open(share.name(), "topic").ok) _exit(1);
    if (reader.take(sample) != Taken::kMessage) _exit(2);
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  CHECK_FALSE(writer.consumer(0).present);
  CHECK(writer.consumer(0).leases == 1);
  CHECK(writer.consumer(0).process == static_cast<std::uint32_t>(child));
  CHECK(writer.reclaim() == 1);
  CHECK(writer.consumer(0).leases == 0);
  Reader next;
  REQUIRE(next.open(share.name(), "topic").ok);
  CHECK(next.slot() == 0);
  CHECK(writer.reclaim() == 0);
  CHECK(writer.consumer(0).present);
}

TEST_CASE("Impossible sizes and names are refused with a sentence") {
  const TestShare share;
  Writer writer;
  for (const char* name :
       {"", ".hidden", "a/b", "a b", "longer-than-forty-characters-and-so-refused"}) {
    const Outcome outcome = writer.open(name, "topic");
    CHECK(outcome.error_number == EINVAL);
    CHECK_FALSE(std::string(outcome.message).empty());
    CHECK_FALSE(writer.open(share.name(), name).ok);
  }
  const auto refused = [&](auto change) {
    WriterOptions options = small();
    change(options);
    return writer.open(share.name(), "topic", options).error_number == EINVAL;
  };
  CHECK(refused([](WriterOptions& o) { o.message_bytes = 0; }));
  CHECK(refused([](WriterOptions& o) { o.message_bytes = ~0U; }));
  CHECK(refused([](WriterOptions& o) { o.consumers = 0; }));
  CHECK(refused([](WriterOptions& o) { o.consumers = 17; }));
  CHECK(refused([](WriterOptions& o) { o.leases = 0; }));
  CHECK(refused([](WriterOptions& o) { o.leases = 9; }));
  CHECK(refused([](WriterOptions& o) { o.history = 0; }));
  CHECK(refused([](WriterOptions& o) { o.history = ~0U; }));
  CHECK_FALSE(writer.is_open());
  Reader reader;
  CHECK(reader.open(share.name(), "topic").error_number == ENOENT);
  Sample sample;
  CHECK(reader.take(sample) == Taken::kFailed);
}

TEST_CASE("Readers of another content are refused") {
  const TestShare share;
  Writer writer;
  WriterOptions options = small();
  options.content = 5;
  REQUIRE(writer.open(share.name(), "topic", options).ok);
  Reader reader;
  CHECK(reader.open(share.name(), "topic").error_number == EPROTO);
  ReaderOptions expected;
  expected.content = 5;
  CHECK(reader.open(share.name(), "topic", expected).ok);
}

TEST_CASE("More than the loan is not published") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  CHECK(writer.publish(1, 0) == 0);
  CHECK(writer.loan().size() == 64);
  CHECK(writer.publish(65, 0) == 0);
  CHECK(writer.publish(64, 0) == 1);
  CHECK(writer.publish(1, 0) == 0);
}

TEST_CASE("The audience decides who may open a topic's files") {
  const auto mode = [](const TestShare& share, FilePart part) {
    struct stat status = {};
    const File file = open_file(file_name(share.name(), "topic", part), false);
    return fstat(file.descriptor(), &status) == 0 ? status.st_mode & 0777U : 0U;
  };
  WriterOptions options = small();
  const std::array<std::array<unsigned, 2>, 3> expected{{{0600, 0600}, {0640, 0660}, {0644, 0666}}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const TestShare share;
    Writer writer;
    options.audience = static_cast<Audience>(i);
    REQUIRE(writer.open(share.name(), "topic", options).ok);
    CHECK(mode(share, FilePart::kSegment) == expected.at(i)[0]);
    CHECK(mode(share, FilePart::kConsumer) == expected.at(i)[1]);
    CHECK(mode(share, FilePart::kWriterLock) == 0600U);
  }
}
