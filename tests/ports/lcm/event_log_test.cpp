// Tests of event logs, against LCM's own reader and writer too.
#include "ports/lcm/event_log.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "lcm/lcm-cpp.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/records.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using wire_test::Random;
using Data = std::vector<std::uint8_t>;

namespace {

Data read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_file(const std::filesystem::path& path, const Data& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

std::vector<LogEvent> read_all(EventLogReader& reader) {
  std::vector<LogEvent> events;
  LogEvent event;
  while (reader.next(event)) events.push_back(event);
  return events;
}

/// Five events of 0 to 400 bytes; returns where each one ends in the file.
std::vector<std::size_t> write_sample(const std::filesystem::path& path) {
  EventLogWriter writer(path);
  Random random(4);
  std::vector<std::size_t> ends;
  std::size_t size = 0;
  for (int i = 0; i < 5; ++i) {
    Data data(static_cast<std::size_t>(i) * 100);
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random.bits());
    const std::string channel = "CHANNEL_" + std::to_string(i);
    writer.write(1000 * i - 7, channel, data);
    ends.push_back(size += 28 + channel.size() + data.size());
  }
  return ends;
}

}  // namespace

TEST_CASE("a log reads back as it was written") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  EventLogReader reader(directory / "log");
  const std::vector<LogEvent> events = read_all(reader);
  REQUIRE(events.size() == 5);
  CHECK(reader.fault_count() == 0);
  for (int i = 0; i < 5; ++i) {
    CHECK(events[i].number == i);
    CHECK(events[i].stamp_us == 1000 * i - 7);
    CHECK(events[i].channel == "CHANNEL_" + std::to_string(i));
    CHECK(events[i].data.size() == static_cast<std::size_t>(i) * 100);
  }
}

TEST_CASE("the bytes of a log are big-endian and hold nothing but the events") {
  const TemporaryDirectory directory;
  EventLogWriter writer(directory / "log");
  writer.write(0x0102030405060708, "AB", Data{0xFF, 0x00});
  writer.flush();
  CHECK(read_file(directory / "log") == Data{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0,   0,   0,    0, 0,
                                             0,    1,    2,    3,    4, 5, 6,   7,   8,    0, 0,
                                             0,    2,    0,    0,    0, 2, 'A', 'B', 0xFF, 0});
}

TEST_CASE("liblcm reads our logs") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  lcm::LogFile theirs((directory / "log").string(), "r");
  REQUIRE(theirs.good());
  EventLogReader ours(directory / "log");
  LogEvent event;
  while (ours.next(event)) {
    const lcm::LogEvent* other = theirs.readNextEvent();
    REQUIRE(other != nullptr);
    CHECK(other->eventnum == event.number);
    CHECK(other->timestamp == event.stamp_us);
    CHECK(other->channel == event.channel);
    const auto* data = static_cast<const std::uint8_t*>(other->data);
    CHECK(Data(data, data + other->datalen) == event.data);
  }
  CHECK(theirs.readNextEvent() == nullptr);
}

TEST_CASE("we read liblcm's logs") {
  const TemporaryDirectory directory;
  {
    lcm::LogFile theirs((directory / "log").string(), "w");
    REQUIRE(theirs.good());
    Data data{1, 2, 3};
    for (int i = 0; i < 3; ++i) {
      lcm::LogEvent event{};
      event.timestamp = 123456789 + i;
      event.channel = "SOME_CHANNEL";
      event.datalen = static_cast<std::int32_t>(data.size());
      event.data = data.data();
      REQUIRE(theirs.writeEvent(&event) == 0);
    }
  }
  EventLogReader reader(directory / "log");
  const std::vector<LogEvent> events = read_all(reader);
  REQUIRE(events.size() == 3);
  CHECK(events[2].number == 2);
  CHECK(events[2].stamp_us == 123456791);
  CHECK(events[2].channel == "SOME_CHANNEL");
  CHECK(events[2].data == Data{1, 2, 3});
}

TEST_CASE("a log cut anywhere keeps every whole event and reports the torn one") {
  const TemporaryDirectory directory;
  const std::vector<std::size_t> ends = write_sample(directory / "log");
  const Data bytes = read_file(directory / "log");
  wire_test::MemoryFile cut;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    cut.write(bytes.data(), length);
    EventLogReader reader(cut.path());
    const std::size_t events = read_all(reader).size();
    const auto whole = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= length; }));
    const bool clean = length == 0 || std::count(ends.begin(), ends.end(), length) == 1;
    if (events != whole || (reader.fault_count() == 0) != clean) {
      FAIL("cut at " << length << ": " << events << " events, " << reader.fault_count()
                     << " faults");
    }
  }
}

TEST_CASE("the torn tail is reported with file and offset") {
  const TemporaryDirectory directory;
  const std::vector<std::size_t> ends = write_sample(directory / "log");
  Data bytes = read_file(directory / "log");
  bytes.erase(bytes.end() - 10, bytes.end());
  write_file(directory / "cut.lcmlog", bytes);
  EventLogReader reader(directory / "cut.lcmlog");
  read_all(reader);
  REQUIRE(reader.fault_sentences().size() == 1);
  CHECK_THAT(reader.fault_sentences()[0],
             Catch::Contains("cut.lcmlog: at byte " + std::to_string(ends[3])) &&
                 Catch::Contains("the log ends within an event"));
}

TEST_CASE("rubbish between events is skipped and reported") {
  const TemporaryDirectory directory;
  const std::vector<std::size_t> ends = write_sample(directory / "log");
  const Data bytes = read_file(directory / "log");
  // Half a magic word at the end of the rubbish must not hide the real one behind it.
  for (const Data& rubbish : {Data{0}, Data(70000, 0xED), Data{0xED, 0xA1, 0xDA},
                              Data{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0}}) {
    for (std::size_t at : ends) {
      Data damaged = bytes;
      damaged.insert(damaged.begin() + static_cast<long>(at), rubbish.begin(), rubbish.end());
      write_file(directory / "damaged", damaged);
      EventLogReader reader(directory / "damaged");
      CHECK(read_all(reader).size() == 5);
      CHECK(reader.fault_count() >= 1);
    }
  }
}

TEST_CASE("an event behind rubbish of any length is found") {
  // Rubbish is searched in blocks of 256, 512, 1024 ... bytes: a magic word may lie in two of them.
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  const Data bytes = read_file(directory / "log");
  wire_test::MemoryFile file;
  for (std::size_t length = 1; length <= 2000; ++length) {
    Data damaged(length, 0);
    damaged.insert(damaged.end(), bytes.begin(), bytes.end());
    file.write(damaged.data(), damaged.size());
    EventLogReader reader(file.path());
    LogEvent event;
    if (!reader.next(event) || event.offset != length || event.number != 0 ||
        reader.fault_count() != 1) {
      FAIL("behind " << length << " bytes");
    }
  }
}

TEST_CASE("an event whose length is wrong does not swallow its successors") {
  const TemporaryDirectory directory;
  const std::vector<std::size_t> ends = write_sample(directory / "log");
  for (std::uint8_t length : {std::uint8_t{250}, std::uint8_t{3}}) {
    Data bytes = read_file(directory / "log");
    bytes[ends[0] + 27] = length;  // event 1 holds 100 bytes of data
    write_file(directory / "damaged", bytes);
    EventLogReader reader(directory / "damaged");
    const std::vector<LogEvent> events = read_all(reader);
    CHECK(events.size() >= 4);
    CHECK(events.back().channel == "CHANNEL_4");
    CHECK(reader.fault_count() >= 1);
  }
}

TEST_CASE("no flipped bit costs more than the event it is in") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  const Data bytes = read_file(directory / "log");
  wire_test::MemoryFile file;
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    Data damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    file.write(damaged.data(), damaged.size());
    EventLogReader reader(file.path());
    if (read_all(reader).size() < 4) FAIL("bit " << bit);
  }
}

TEST_CASE("an event beyond the limit is skipped without being read") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  EventLogReader reader(directory / "log", 350);
  CHECK(read_all(reader).size() == 4);
  CHECK_THAT(reader.fault_sentences().at(0), Catch::Contains("larger than the limit"));
}

TEST_CASE("an event as large as the limit is read, one byte more is too much") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  EventLogReader just(directory / "log", 400);
  CHECK(read_all(just).size() == 5);
  CHECK(just.fault_count() == 0);
  EventLogReader too_small(directory / "log", 399);
  CHECK(read_all(too_small).size() == 4);
  CHECK(too_small.fault_count() == 1);
}

TEST_CASE("of many faults the first are kept and the others counted") {
  const TemporaryDirectory directory;
  write_sample(directory / "log");
  const Data bytes = read_file(directory / "log");
  const auto sentences = [&](std::size_t faults) {
    // A byte of rubbish in front of every event.
    Data damaged;
    for (std::size_t i = 0; i < faults; ++i) {
      damaged.push_back(0);
      damaged.insert(damaged.end(), bytes.begin(), bytes.end());
    }
    write_file(directory / "damaged", damaged);
    EventLogReader reader(directory / "damaged");
    CHECK(read_all(reader).size() == 5 * faults);
    CHECK(reader.fault_count() == faults);
    return reader.fault_sentences();
  };
  constexpr std::size_t kKept = EventLogReader::kMaxFaultsKept;
  CHECK(sentences(kKept).size() == kKept);
  const std::vector<std::string> more = sentences(kKept + 3);
  REQUIRE(more.size() == kKept + 1);
  CHECK_THAT(more.front(), Catch::Contains("at byte 0: no event starts here"));
  CHECK_THAT(more.back(), Catch::EndsWith(": 3 more faults"));
}

TEST_CASE("a log that cannot be opened is refused by name") {
  const TemporaryDirectory directory;
  CHECK_THROWS_WITH(EventLogReader(directory / "absent"),
                    Catch::Contains("absent") && Catch::Contains("No such file"));
  CHECK_THROWS_WITH(EventLogReader(directory / "."), Catch::Contains("is a directory"));
  CHECK_THROWS_WITH(EventLogWriter(directory / "no_such_folder/log"),
                    Catch::Contains("cannot be written"));
  EventLogWriter writer(directory / "log");
  CHECK_THROWS_AS(writer.write(0, "", {}), EventLogError);
  CHECK_THROWS_AS(writer.write(0, std::string(64, 'X'), {}), EventLogError);
}
