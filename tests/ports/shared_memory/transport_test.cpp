// Tests of topics in shared memory: order, leases, loss, restarts.
#include <sys/stat.h>
#include <sys/wait.h>

#include <cerrno>

#include "tests/ports/shared_memory/share.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::ConsumedTopic;
using test::publish;
using test::small;
using test::take_text;
using test::TestShare;
using test::text_of;
using test::Topic;

TEST_CASE("A message arrives as it was written, in the writer's own memory") {
  ConsumedTopic topic;
  Sample sample;
  CHECK(topic.reader.take(sample) == Taken::kNothing);
  CHECK(publish(topic.writer, "one") == 1);
  REQUIRE(topic.reader.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "one");
  CHECK(sample.sequence() == 1);
  CHECK(sample.stamp_ns() == 7);
  CHECK(sample.missed() == 0);
  CHECK(sample.intact());
  sample.release();
  CHECK_FALSE(sample.has_message());
  CHECK(topic.reader.take(sample) == Taken::kNothing);
  // Stamps before 1970 and far in the future.
  for (const std::int64_t stamp : {std::int64_t{-1}, INT64_MIN, INT64_MAX, std::int64_t{1} << 32}) {
    (void)topic.writer.loan();
    REQUIRE(topic.writer.publish(1, stamp) != 0);
    REQUIRE(topic.reader.take(sample) == Taken::kMessage);
    CHECK(sample.stamp_ns() == stamp);
  }
}

TEST_CASE("A consumer that is late learns how many messages it missed") {
  ConsumedTopic topic;
  topic.publish("1");
  CHECK(take_text(topic.reader) == "1");
  topic.publish_numbers(2, 20);
  Sample sample;
  REQUIRE(topic.reader.take(sample) == Taken::kMessage);
  // Two consumers with two leases, one to write, three of history: 8 chunks, none of them leased.
  CHECK(sample.sequence() == 13);
  CHECK(text_of(sample) == "13");
  CHECK(sample.missed() == 11);
  CHECK(topic.reader.missed() == 11);
  for (int i = 14; i <= 20; ++i) {
    REQUIRE(topic.reader.take(sample) == Taken::kMessage);
    CHECK(text_of(sample) == std::to_string(i));
    CHECK(sample.missed() == 0);
  }
  CHECK(topic.reader.take(sample) == Taken::kNothing);
}

TEST_CASE("Those who want the newest message skip the others without missing them") {
  ConsumedTopic topic;
  topic.publish_numbers(1, 5);
  Sample sample;
  REQUIRE(topic.reader.take_latest(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "5");
  CHECK(topic.reader.missed() == 0);
  CHECK(topic.reader.take_latest(sample) == Taken::kNothing);
}

TEST_CASE("A late joiner gets the latest message, or the oldest that is there") {
  Topic topic;
  topic.publish_numbers(1, 20);
  Reader latest;
  Reader oldest;
  topic.open(latest);
  topic.open(oldest, {.start = ReaderOptions::Start::kOldest});
  CHECK(take_text(latest) == "20");
  Sample sample;
  REQUIRE(oldest.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "13");
  CHECK(sample.missed() == 0);
}

TEST_CASE("With every lease held the writer goes on and touches none of them") {
  Topic topic;
  std::array<Reader, 2> readers;
  std::array<Sample, 4> samples;
  for (Reader& reader : readers) topic.open(reader);
  for (std::size_t i = 0; i < 4; ++i) {
    topic.publish("held " + std::to_string(i));
    // Two each, so the leases are of different chunks.
    REQUIRE(readers.at(i / 2).take_latest(samples.at(i)) == Taken::kMessage);
  }
  topic.publish("new", 1000);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(samples.at(i).intact());
    CHECK(text_of(samples.at(i)) == "held " + std::to_string(i));
  }
  CHECK(topic.writer.consumer(0).leases == 2);
  CHECK(topic.writer.consumer(1).leases == 2);
}

TEST_CASE("A consumer holds no more messages than it may") {
  ConsumedTopic topic;
  std::array<Sample, 3> samples;
  topic.publish("x", 3);
  REQUIRE(topic.reader.take(samples[0]) == Taken::kMessage);
  REQUIRE(topic.reader.take(samples[1]) == Taken::kMessage);
  CHECK(topic.reader.take(samples[2]) == Taken::kLeasesUsed);
  samples[0].release();
  CHECK(topic.reader.take(samples[2]) == Taken::kMessage);
}

TEST_CASE("A moved sample keeps its lease, and only the last owner gives it back") {
  ConsumedTopic topic;
  topic.publish("x");
  Sample kept;
  {
    Sample sample;
    REQUIRE(topic.reader.take(sample) == Taken::kMessage);
    kept = std::move(sample);
  }
  CHECK(topic.writer.consumer(topic.reader.slot()).leases == 1);
  CHECK(kept.intact());
  kept.release();
  CHECK(topic.writer.consumer(topic.reader.slot()).leases == 0);
}

TEST_CASE("Revoked leases end, and the sample says so once its memory is used") {
  ConsumedTopic topic;
  topic.publish("old");
  Sample sample;
  REQUIRE(topic.reader.take(sample) == Taken::kMessage);
  topic.publish("new", 20);
  CHECK(sample.intact());
  topic.writer.revoke(topic.reader.slot());
  CHECK(topic.writer.consumer(topic.reader.slot()).leases == 0);
  topic.publish("new", 20);
  CHECK_FALSE(sample.intact());
  sample.release();
  REQUIRE(topic.reader.take_latest(sample) == Taken::kMessage);
  topic.publish("new", 20);
  CHECK(sample.intact());
}

TEST_CASE("A topic has one writer; the next goes on where it ended, and leases survive it") {
  ConsumedTopic topic;
  Writer next;
  const Outcome refused = next.open(topic.share.name(), "topic", small());
  CHECK_FALSE(refused.ok);
  CHECK(refused.error_number == EBUSY);
  CHECK(next.loan().empty());
  CHECK(publish(topic.writer, "first writer") == 1);
  Sample held;
  REQUIRE(topic.reader.take(held) == Taken::kMessage);
  CHECK(topic.reader.has_writer());
  // Ends in the middle of a message.
  std::memset(topic.writer.loan().data(), 0xAA, 10);
  topic.writer = Writer();
  CHECK_FALSE(topic.reader.has_writer());

  topic.open();
  CHECK(topic.reader.has_writer());
  CHECK_FALSE(topic.reader.is_replaced());
  topic.publish("second writer", 20);
  CHECK(held.intact());
  CHECK(text_of(held) == "first writer");
  Sample sample;
  REQUIRE(topic.reader.take_latest(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "second writer");
  CHECK(sample.sequence() == 21);
  CHECK(sample.writer() == held.writer() + 1);
}

TEST_CASE("A writer of another size makes the topic anew, and readers notice") {
  ConsumedTopic topic;
  topic.publish("old");
  Sample held;
  REQUIRE(topic.reader.take(held) == Taken::kMessage);
  topic.writer = Writer();
  WriterOptions larger = small();
  larger.message_bytes = 1U << 20U;
  topic.open(larger);
  REQUIRE(publish(topic.writer, "new") == 1);
  CHECK(topic.reader.is_replaced());
  CHECK_FALSE(topic.reader.wait(10'000'000'000));
  CHECK(text_of(held) == "old");
  held.release();
  topic.open(topic.reader);
  CHECK(take_text(topic.reader) == "new");
}

TEST_CASE("A removed topic is gone for those who come, not for those who are there") {
  ConsumedTopic topic;
  topic.publish("x");
  topic.writer.remove();
  CHECK(topic.writer.loan().empty());
  CHECK(topic.reader.is_replaced());
  CHECK(take_text(topic.reader) == "x");
  Reader late;
  CHECK(late.open(topic.share.name(), "topic").error_number == ENOENT);
}

TEST_CASE("Consumers beyond the slots are refused until one leaves") {
  ConsumedTopic topic;
  Reader third;
  {
    Reader second;
    topic.open(second);
    CHECK(second.slot() != topic.reader.slot());
    CHECK(third.open(topic.share.name(), "topic").error_number == EBUSY);
  }
  CHECK(third.open(topic.share.name(), "topic").ok);
}

TEST_CASE("What a killed consumer held is given back, and its slot is free at once") {
  Topic topic;
  topic.publish("x");
  const pid_t child = fork();
  if (child == 0) {
    Reader reader;
    Sample sample;
    if (!reader.open(topic.share.name(), "topic").ok) _exit(1);
    if (reader.take(sample) != Taken::kMessage) _exit(2);
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  CHECK_FALSE(topic.writer.consumer(0).present);
  CHECK(topic.writer.consumer(0).leases == 1);
  CHECK(topic.writer.consumer(0).process == static_cast<std::uint32_t>(child));
  CHECK(topic.writer.reclaim() == 1);
  CHECK(topic.writer.consumer(0).leases == 0);
  Reader next;
  topic.open(next);
  CHECK(next.slot() == 0);
  CHECK(topic.writer.reclaim() == 0);
  CHECK(topic.writer.consumer(0).present);
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
  using Size = std::uint32_t WriterOptions::*;
  const std::vector<std::pair<Size, std::uint32_t>> impossible = {
      {&WriterOptions::message_bytes, 0}, {&WriterOptions::message_bytes, ~0U},
      {&WriterOptions::consumers, 0},     {&WriterOptions::consumers, 17},
      {&WriterOptions::leases, 0},        {&WriterOptions::leases, 9},
      {&WriterOptions::history, 0},       {&WriterOptions::history, ~0U}};
  for (const auto& [size, value] : impossible) {
    WriterOptions options = small();
    options.*size = value;
    CHECK(writer.open(share.name(), "topic", options).error_number == EINVAL);
  }
  CHECK_FALSE(writer.is_open());
  Reader reader;
  CHECK(reader.open(share.name(), "topic").error_number == ENOENT);
  Sample sample;
  CHECK(reader.take(sample) == Taken::kFailed);
}

TEST_CASE("More than the loan is not published") {
  Topic topic;
  CHECK(topic.writer.publish(1, 0) == 0);
  CHECK(topic.writer.loan().size() == 64);
  CHECK(topic.writer.publish(65, 0) == 0);
  CHECK(topic.writer.publish(64, 0) == 1);
  CHECK(topic.writer.publish(1, 0) == 0);
}

TEST_CASE("The audience decides who may open a topic's files") {
  const auto [audience, segment, table] = GENERATE(
      Catch::Generators::table<Audience, unsigned, unsigned>({{Audience::kSameUser, 0600, 0600},
                                                              {Audience::kSameGroup, 0640, 0660},
                                                              {Audience::kEveryone, 0644, 0666}}));
  WriterOptions options = small();
  options.audience = audience;
  const Topic topic(options);
  const auto mode = [&topic](FilePart part) {
    struct stat status = {};
    const File file = topic.file(part, 0, false);
    return fstat(file.descriptor(), &status) == 0 ? status.st_mode & 0777U : 0U;
  };
  CHECK(mode(FilePart::kSegment) == segment);
  CHECK(mode(FilePart::kConsumer) == table);
  CHECK(mode(FilePart::kWriterLock) == 0600U);
}
