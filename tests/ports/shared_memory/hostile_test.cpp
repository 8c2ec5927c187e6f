// Tests of topics in shared memory against processes that do not keep to the protocol.
#include <fcntl.h>
#include <sys/wait.h>

#include <cerrno>

#include "tests/ports/shared_memory/share.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::ConsumedTopic;
using test::publish;
using test::Random;
using test::take_text;
using test::text_of;
using test::Topic;

namespace {

WriterOptions options_of(std::uint32_t message_bytes = 64) {
  return {.message_bytes = message_bytes, .consumers = 3};
}

}  // namespace

TEST_CASE("A hostile consumer's lease table never stops the writer nor another consumer") {
  ConsumedTopic topic(options_of());
  topic.publish("held");
  Sample held;
  REQUIRE(topic.reader.take(held) == Taken::kMessage);
  const std::array<File, 2> tables{topic.file(FilePart::kConsumer, 1),
                                   topic.file(FilePart::kConsumer, 2)};
  Random random(1);
  for (int i = 0; i < 3000; ++i) {
    for (const File& table : tables) {
      std::array<std::uint32_t, 2 * sizeof(LeaseTable) / 4> words{};
      // Chunks that exist, mostly: the worst a consumer can say.
      for (std::uint32_t& word : words) word = random.below(4) == 0 ? ~0U : random.below(12);
      REQUIRE(pwrite(table.descriptor(), words.data(), sizeof words, 0) == sizeof words);
      if (random.below(8) == 0) REQUIRE(ftruncate(table.descriptor(), random.below(70)) == 0);
    }
    topic.publish("new");
    Sample sample;
    REQUIRE(topic.reader.take(sample) == Taken::kMessage);
    CHECK(text_of(sample) == "new");
    CHECK(sample.missed() == 0);
  }
  CHECK(held.intact());
  CHECK(text_of(held) == "held");
}

TEST_CASE("A consumer whose lease table another one destroys loses its leases and nothing else") {
  ConsumedTopic topic(options_of());
  topic.publish("held");
  Sample held;
  REQUIRE(topic.reader.take(held) == Taken::kMessage);
  const File table = topic.file(FilePart::kConsumer, topic.reader.slot());
  REQUIRE(ftruncate(table.descriptor(), 0) == 0);
  topic.publish("new", 20);
  CHECK_FALSE(held.intact());
  held.release();
  REQUIRE(topic.reader.take_latest(held) == Taken::kMessage);
  CHECK(text_of(held) == "new");
  CHECK(held.intact());
}

TEST_CASE("A reader cannot write what the others read") {
  Topic topic(options_of());
  topic.publish("x");
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGSEGV, SIG_DFL);
    Reader reader;
    Sample sample;
    if (!reader.open(topic.share.name(), "topic").ok) _exit(1);
    if (reader.take(sample) != Taken::kMessage) _exit(2);
    *const_cast<std::byte*>(sample.bytes().data()) = std::byte{0};
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
}

TEST_CASE("A file that is no topic is refused, and a writer replaces it") {
  ConsumedTopic topic(options_of());
  const File file = topic.file(FilePart::kSegment);
  std::array<std::uint32_t, 16> good{};
  REQUIRE(pread(file.descriptor(), good.data(), sizeof good, 0) == sizeof good);
  // Magic, version, content, sizes and counts: each wrong once.
  for (std::size_t word = 0; word < 7; ++word) {
    for (const std::uint32_t wrong : {0U, ~0U, good.at(word) ^ 0x80000000U}) {
      std::array<std::uint32_t, 16> bad = good;
      if (bad.at(word) == wrong) continue;
      bad.at(word) = wrong;
      REQUIRE(pwrite(file.descriptor(), bad.data(), sizeof bad, 0) == sizeof bad);
      Reader late;
      const Outcome outcome = late.open(topic.share.name(), "topic");
      CHECK_FALSE(outcome.ok);
      CHECK((outcome.error_number == EPROTO || outcome.error_number == EAGAIN));
    }
  }
  topic.writer = Writer();
  topic.open(options_of());
  CHECK(publish(topic.writer, "anew") == 1);
  CHECK(topic.reader.is_replaced());
  topic.open(topic.reader);
  CHECK(take_text(topic.reader) == "anew");
}

TEST_CASE("A segment of any length but its own is refused") {
  const Topic topic(options_of());
  const File file = topic.file(FilePart::kSegment);
  const std::int64_t bytes = file.size();
  for (const std::int64_t wrong : {std::int64_t{0}, std::int64_t{20}, bytes - 1, bytes + 1}) {
    REQUIRE(ftruncate(file.descriptor(), static_cast<off_t>(wrong)) == 0);
    Reader reader;
    CHECK_FALSE(reader.open(topic.share.name(), "topic").ok);
  }
}

TEST_CASE("Random words in the header lead no reader out of the segment") {
  Topic topic(options_of(4096));
  topic.publish("x");
  Reader reader;
  topic.open(reader);
  Mapping mapping;
  const File file = topic.file(FilePart::kSegment);
  REQUIRE(mapping.open(file, static_cast<std::size_t>(file.size()), true).ok);
  auto* const words = reinterpret_cast<std::uint32_t*>(mapping.data());
  const std::size_t count = chunks_offset(reader.shape()) / 4;
  Random random(2);
  std::size_t messages = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t kind = random.below(3);
    const auto value = static_cast<std::uint32_t>(random.bits());
    // Claims would only make it wait.
    for (std::uint32_t chunk = 0; chunk < reader.shape().chunks; ++chunk) {
      words[kChunkHeadersOffset / 4 + 8 * chunk + 1] = 0;
    }
    if (i % 4 != 0)
      words[random.below(static_cast<std::uint32_t>(count))] = kind == 0 ? value : kind;
    words[12] = reader.latest() + random.below(2);
    words[kChunkHeadersOffset / 4 + 8 * random.below(reader.shape().chunks)] = reader.latest();
    Sample sample;
    if (reader.take(sample) != Taken::kMessage) continue;
    ++messages;
    REQUIRE(sample.bytes().size() <= 4096);
    std::size_t sum = 0;
    for (const std::byte byte : sample.bytes()) sum += static_cast<std::size_t>(byte);
    CHECK(sum <= 4096 * 255);
  }
  CHECK(messages > 1000);
}
