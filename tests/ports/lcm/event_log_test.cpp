// Tests of event logs, against LCM's own reader and writer too.
#include "ports/lcm/event_log.hpp"

#include "lcm/lcm-cpp.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/records.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using lcm_test::bytes_of;
using Data = std::vector<std::uint8_t>;

namespace {

/// What a log holds.
struct Contents {
  std::vector<LogEvent> events;
  std::vector<LogFault> faults;
  std::uint64_t fault_count;
  std::vector<std::string> sentences;
};

Contents read(const std::filesystem::path& path,
              std::uint64_t limit = EventLogReader::kDefaultMaxEventBytes) {
  EventLogReader reader(path, limit);
  std::vector<LogEvent> events;
  LogEvent event;
  while (reader.next(event)) events.push_back(event);
  return {events, reader.faults(), reader.fault_count(), reader.fault_sentences()};
}

Contents read(const Data& bytes) {
  wire_test::MemoryFile file;
  file.write(bytes.data(), bytes.size());
  return read(file.path());
}

/// Data of event `i`, of 0 to 400 bytes.
Data data_of(int i) {
  wire_test::Random random(4 + static_cast<std::uint64_t>(i));
  Data data(static_cast<std::size_t>(i) * 100);
  for (auto& byte : data) byte = static_cast<std::uint8_t>(random.bits());
  return data;
}

/// A log of five events.
struct Sample {
  TemporaryDirectory directory;
  std::filesystem::path path = directory / "log";
  std::vector<std::size_t> ends;  ///< of events in the file
  Data bytes;

  Sample() {
    EventLogWriter writer(path);
    for (int i = 0; i < 5; ++i) {
      writer.write(1000 * i - 7, "CHANNEL_" + std::to_string(i), data_of(i));
      writer.flush();
      ends.push_back(std::filesystem::file_size(path));
    }
    bytes = bytes_of(path);
  }
};

}  // namespace

TEST_CASE("liblcm reads our logs as we do") {
  const Sample log;
  lcm::LogFile theirs(log.path.string(), "r");
  REQUIRE(theirs.good());
  const Contents ours = read(log.path);
  CHECK(ours.fault_count == 0);
  REQUIRE(ours.events.size() == 5);
  for (int i = 0; i < 5; ++i) {
    const LogEvent& event = ours.events[i];
    CHECK(event.number == i);
    CHECK(event.stamp_us == 1000 * i - 7);
    CHECK(event.channel == "CHANNEL_" + std::to_string(i));
    CHECK(event.data == data_of(i));
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
  const auto events = read(directory / "log").events;
  REQUIRE(events.size() == 3);
  CHECK(events[2].number == 2);
  CHECK(events[2].stamp_us == 123456791);
  CHECK(events[2].channel == "SOME_CHANNEL");
  CHECK(events[2].data == Data{1, 2, 3});
}

TEST_CASE("a log cut anywhere keeps every whole event and reports the torn one") {
  const Sample log;
  for (std::size_t length = 0; length < log.bytes.size(); ++length) {
    const Contents cut =
        read(Data(log.bytes.begin(), log.bytes.begin() + static_cast<long>(length)));
    const auto torn = std::upper_bound(log.ends.begin(), log.ends.end(), length);
    const auto whole = static_cast<std::size_t>(torn - log.ends.begin());
    const std::size_t begin = whole == 0 ? 0 : log.ends[whole - 1];
    CAPTURE(length);
    REQUIRE(cut.events.size() == whole);
    REQUIRE(cut.fault_count == (length == begin ? 0 : 1));
    if (length == begin) continue;
    REQUIRE(cut.faults.at(0).offset == begin);
    REQUIRE_THAT(cut.faults[0].reason, Catch::StartsWith("the log ends within an event"));
  }
}

TEST_CASE("rubbish between events is skipped and reported") {
  const Sample log;
  // Half a magic word at the end of the rubbish must not hide the real one behind it.
  for (const Data& rubbish : {Data{0}, Data(70000, 0xED), Data{0xED, 0xA1, 0xDA},
                              Data{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0}}) {
    for (std::size_t at : log.ends) {
      Data damaged = log.bytes;
      damaged.insert(damaged.begin() + static_cast<long>(at), rubbish.begin(), rubbish.end());
      const Contents contents = read(damaged);
      CHECK(contents.events.size() == 5);
      CHECK(contents.fault_count >= 1);
    }
  }
}

TEST_CASE("an event behind rubbish of any length is found") {
  // Rubbish is searched in blocks of 256, 512, 1024 ... bytes: a magic word may lie in two of them.
  const Sample log;
  for (std::size_t length = 1; length <= 2000; ++length) {
    Data damaged(length, 0);
    damaged.insert(damaged.end(), log.bytes.begin(), log.bytes.end());
    const Contents contents = read(damaged);
    if (contents.events.empty() || contents.events[0].offset != length ||
        contents.events[0].number != 0 || contents.fault_count != 1) {
      FAIL("behind " << length << " bytes");
    }
  }
}

TEST_CASE("no flipped bit costs more than the event it is in, nor an event without a fault") {
  const Sample log;
  for (std::size_t bit = 0; bit < log.bytes.size() * 8; ++bit) {
    const Contents damaged = read(lcm_test::with_flipped(log.bytes, bit));
    const std::size_t events = damaged.events.size();
    if (events < 4 || (events < 5 && damaged.fault_count == 0)) FAIL("bit " << bit);
  }
}

TEST_CASE("an event as large as the limit is read, one byte more is too much") {
  const Sample log;
  CHECK(read(log.path, 400).events.size() == 5);
  CHECK(read(log.path, 400).fault_count == 0);
  const Contents limited = read(log.path, 399);
  CHECK(limited.events.size() == 4);
  CHECK(limited.fault_count == 1);
  CHECK_THAT(limited.sentences.at(0), Catch::Contains("larger than the limit"));
}

TEST_CASE("of many faults the first are kept and the others counted") {
  const Sample log;
  const auto sentences = [&](std::size_t faults) {
    // A byte of rubbish in front of every event.
    std::string damaged;
    for (std::size_t i = 0; i < faults; ++i) {
      damaged += '\0';
      damaged.append(log.bytes.begin(), log.bytes.end());
    }
    const Contents contents = read(log.directory.write("damaged", damaged));
    CHECK(contents.events.size() == 5 * faults);
    CHECK(contents.fault_count == faults);
    return contents.sentences;
  };
  constexpr std::size_t kKept = EventLogReader::kMaxFaultsKept;
  CHECK(sentences(kKept).size() == kKept);
  const std::vector<std::string> more = sentences(kKept + 3);
  REQUIRE(more.size() == kKept + 1);
  CHECK_THAT(more.front(), Catch::Contains("damaged: at byte 0: no event starts here"));
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
