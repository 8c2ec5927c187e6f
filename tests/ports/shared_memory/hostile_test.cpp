// Tests of topics in shared memory against processes that do not keep to the protocol.
#include <fcntl.h>
#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cerrno>
#include <vector>

#include "tests/ports/shared_memory/share.hpp"
#include "tests/random.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::publish;
using test::Random;
using test::TestShare;
using test::text_of;

namespace {

WriterOptions small() {
  WriterOptions options;
  options.message_bytes = 64;
  options.consumers = 3;
  options.leases = 2;
  options.history = 1;
  return options;
}

File table_of(const TestShare& share, std::uint32_t slot) {
  return open_file(file_name(share.name(), "topic", FilePart::kConsumer, slot), true);
}

}  // namespace

TEST_CASE("A hostile consumer's lease table never stops the writer nor another consumer") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader honest;
  REQUIRE(honest.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "held") != 0);
  Sample held;
  REQUIRE(honest.take(held) == Taken::kMessage);
  const std::array<File, 2> tables{table_of(share, 1), table_of(share, 2)};
  Random random(1);
  for (int i = 0; i < 3000; ++i) {
    for (const File& table : tables) {
      std::array<std::uint32_t, 2 * sizeof(LeaseTable) / 4> words{};
      // Chunks that exist, mostly: the worst a consumer can say.
      for (std::uint32_t& word : words) word = random.below(4) == 0 ? ~0U : random.below(12);
      REQUIRE(pwrite(table.descriptor(), words.data(), sizeof words, 0) == sizeof words);
      if (random.below(8) == 0) REQUIRE(ftruncate(table.descriptor(), random.below(70)) == 0);
    }
    REQUIRE(publish(writer, "new") != 0);
    Sample sample;
    REQUIRE(honest.take(sample) == Taken::kMessage);
    CHECK(text_of(sample) == "new");
    CHECK(sample.missed() == 0);
  }
  CHECK(held.intact());
  CHECK(text_of(held) == "held");
}

TEST_CASE("A consumer whose lease table another one destroys loses its leases and nothing else") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader victim;
  REQUIRE(victim.open(share.name(), "topic").ok);
  REQUIRE(publish(writer, "held") != 0);
  Sample held;
  REQUIRE(victim.take(held) == Taken::kMessage);
  const File table = table_of(share, victim.slot());
  REQUIRE(ftruncate(table.descriptor(), 0) == 0);
  for (int i = 0; i < 20; ++i) REQUIRE(publish(writer, "new") != 0);
  CHECK_FALSE(held.intact());
  held.release();
  REQUIRE(victim.take_latest(held) == Taken::kMessage);
  CHECK(text_of(held) == "new");
  CHECK(held.intact());
}

TEST_CASE("A reader cannot write what the others read") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  REQUIRE(publish(writer, "x") != 0);
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGSEGV, SIG_DFL);
    Reader reader;
    Sample sample;
    if (!reader.open(share.name(), "topic").ok) _exit(1);
    if (reader.take(sample) != Taken::kMessage) _exit(2);
    *const_cast<std::byte*>(sample.bytes().data()) = std::byte{0};
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
}

TEST_CASE("A file that is no topic is refused, and a writer replaces it") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  const FileName name = file_name(share.name(), "topic", FilePart::kSegment);
  const File file = open_file(name, true);
  std::array<std::uint32_t, 16> good{};
  REQUIRE(pread(file.descriptor(), good.data(), sizeof good, 0) == sizeof good);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  // Magic, version, content, sizes and counts: each wrong once.
  for (std::size_t word = 0; word < 7; ++word) {
    for (const std::uint32_t wrong : {0U, ~0U, good.at(word) ^ 0x80000000U}) {
      std::array<std::uint32_t, 16> bad = good;
      if (bad.at(word) == wrong) continue;
      bad.at(word) = wrong;
      REQUIRE(pwrite(file.descriptor(), bad.data(), sizeof bad, 0) == sizeof bad);
      Reader late;
      const Outcome outcome = late.open(share.name(), "topic");
      CHECK_FALSE(outcome.ok);
      CHECK((outcome.error_number == EPROTO || outcome.error_number == EAGAIN));
    }
  }
  writer = Writer();
  Writer next;
  REQUIRE(next.open(share.name(), "topic", small()).ok);
  CHECK(publish(next, "anew") == 1);
  CHECK(reader.is_replaced());
  REQUIRE(reader.open(share.name(), "topic").ok);
  Sample sample;
  REQUIRE(reader.take(sample) == Taken::kMessage);
  CHECK(text_of(sample) == "anew");
}

TEST_CASE("A segment of any length but its own is refused") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  const File file = open_file(file_name(share.name(), "topic", FilePart::kSegment), true);
  const std::int64_t bytes = file.size();
  for (const std::int64_t wrong : {std::int64_t{0}, std::int64_t{20}, bytes - 1, bytes + 1}) {
    REQUIRE(ftruncate(file.descriptor(), static_cast<off_t>(wrong)) == 0);
    Reader reader;
    CHECK_FALSE(reader.open(share.name(), "topic").ok);
  }
}

TEST_CASE("Random words in the header lead no reader out of the segment") {
  const TestShare share;
  Writer writer;
  WriterOptions options = small();
  options.message_bytes = 4096;
  REQUIRE(writer.open(share.name(), "topic", options).ok);
  REQUIRE(publish(writer, "x") != 0);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  Mapping mapping;
  const File file = open_file(file_name(share.name(), "topic", FilePart::kSegment), true);
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
