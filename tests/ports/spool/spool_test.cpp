// Tests of the spool: round trip, restart, limits.
#include "ports/spool/spool.hpp"

#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

TEST_CASE("keyframes are read back as they were added, durable or not, and written once") {
  const TemporaryDirectory folder;
  Spool spool(folder / "spool");
  add(spool, kMonday, 0, 20);
  for (std::uint32_t i = 0; i < 20; ++i) CHECK(has_equal(spool, kMonday, i));
  REQUIRE(spool.flush(kPatience));
  add(spool, kMonday, 19, 20);
  REQUIRE(spool.flush(kPatience));
  for (std::uint32_t i = 0; i < 20; ++i) {
    CHECK(spool.is_durable(kMonday.id, i));
    CHECK(spool.holds(kMonday.id, i));
    CHECK(has_equal(spool, kMonday, i));
  }
  CHECK_FALSE(spool.holds(kMonday.id, 20));
  CHECK_FALSE(spool.read(kTuesday.id, 0));
  const SpoolCounters counters = spool.counters();
  CHECK(counters.keyframes_added == 21);
  CHECK(counters.keyframes_durable == 20);
  CHECK(counters.keyframes_on_disk == 20);
  CHECK(counters.keyframes_refused == 0);
  CHECK_FALSE(counters.failing);
}

TEST_CASE("after a restart earlier sessions are listed with what nobody acknowledged") {
  const TemporaryDirectory folder;
  {
    Spool spool(folder / "spool", small());
    add(spool, kMonday, 0, 60);
    REQUIRE(spool.flush(kPatience));
    spool.acknowledge(kMonday.id, std::vector<std::uint32_t>{0, 1, 2, 5, 59});
    CHECK(spool.earlier_sessions().empty());
  }
  {
    Spool spool(folder / "spool", small());
    add(spool, kTuesday, 0, 3);
    const auto earlier = spool.earlier_sessions();
    REQUIRE(earlier.size() == 1);
    CHECK(earlier[0].info.id == kMonday.id);
    CHECK(earlier[0].info.name == "monday");
    CHECK(earlier[0].info.sensor == "os2-128");
    CHECK(earlier[0].keyframes == 60);
    CHECK(earlier[0].acknowledged == 5);
    CHECK_FALSE(earlier[0].ended);
    REQUIRE(earlier[0].waiting.size() == 55);
    CHECK(earlier[0].waiting[0].sequence == 3);
    CHECK(earlier[0].waiting[0].bytes == 2000);
    CHECK(has_equal(spool, kMonday, 3));
    spool.end(kMonday.id);
  }
  const Spool spool(folder / "spool", small());
  const auto earlier = spool.earlier_sessions();
  REQUIRE(earlier.size() == 2);
  CHECK(earlier[0].ended);
  CHECK_FALSE(earlier[1].ended);
  CHECK(earlier[1].waiting.size() == 3);
  CHECK(spool.counters().bytes_waiting == 58 * 2000);
}

TEST_CASE("what is acknowledged is written after its period, though nothing else is") {
  const TemporaryDirectory folder;
  SpoolOptions options;
  options.acknowledge_period = std::chrono::milliseconds(10);
  Spool spool(folder / "spool", options);
  add(spool, kMonday, 0, 1);
  REQUIRE(spool.flush(kPatience));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // it waits for work
  const std::uint64_t before = spool.counters().commits;
  spool.acknowledge(kMonday.id, {{0}});
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  while (spool.counters().commits == before && std::chrono::steady_clock::now() < limit) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(spool.counters().commits == before + 1);
}

TEST_CASE("at its limit the oldest keyframes go, and those nobody has are counted") {
  const TemporaryDirectory folder;
  Spool spool(folder / "spool", small());
  for (std::uint32_t i = 0; i < 1000; ++i) {
    spool.add(kMonday, keyframe_of(kMonday, i));
    if (i % 20 == 19) REQUIRE(spool.flush(kPatience));
    CHECK(spool.counters().bytes_on_disk <= kSmallestSpoolBytes);
  }
  const SpoolCounters counters = spool.counters();
  CHECK(counters.keyframes_durable == 1000);
  CHECK(counters.keyframes_on_disk + counters.keyframes_lost == 1000);
  CHECK(counters.keyframes_on_disk > 300);
  CHECK(counters.bytes_waiting == 2000 * counters.keyframes_on_disk);
  CHECK_FALSE(spool.holds(kMonday.id, 0));
  CHECK(has_equal(spool, kMonday, 999));
  std::uint64_t bytes = 0;
  for (const auto& file : segments_of(folder / "spool")) bytes += std::filesystem::file_size(file);
  CHECK(bytes <= kSmallestSpoolBytes);
}

TEST_CASE("acknowledged keyframes go before those that nobody has") {
  const TemporaryDirectory folder;
  {
    Spool spool(folder / "spool", small());
    add(spool, kMonday, 0, 100);
    REQUIRE(spool.flush(kPatience));
    for (std::uint32_t i = 0; i < 1300; ++i) {
      add(spool, kTuesday, i, i + 1);
      spool.acknowledge(kTuesday.id, {{i}});
      if (i % 20 == 0) REQUIRE(spool.flush(kPatience));
    }
    REQUIRE(spool.flush(kPatience));
    CHECK(spool.counters().bytes_on_disk <= kSmallestSpoolBytes);
    CHECK(spool.counters().bytes_waiting == 100 * 2000);
  }
  Spool spool(folder / "spool", small());
  const auto earlier = spool.earlier_sessions();
  REQUIRE(earlier.size() == 2);
  CHECK(earlier[0].waiting.size() == 100);
  for (const auto& waiting : earlier[0].waiting) CHECK(has_equal(spool, kMonday, waiting.sequence));
  // What was acknowledged stays so, although the segments that said so first are gone.
  CHECK(earlier[1].waiting.empty());
  CHECK(earlier[1].acknowledged == 1300);
}

TEST_CASE("segments beyond their age are removed") {
  const TemporaryDirectory folder;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::int64_t now_s = std::chrono::duration_cast<std::chrono::seconds>(now).count();
  // A segment for each age in seconds: 90, 60, 30.
  for (std::uint32_t i = 0; i < 3; ++i) {
    const EncodedKeyframe keyframe = keyframe_of(kMonday, i);
    std::vector<std::uint8_t> bytes = segment_head();
    const auto head = keyframe_head(kMonday, keyframe, now_s - 90 + 30 * i);
    bytes.insert(bytes.end(), head.begin(), head.end());
    bytes.insert(bytes.end(), keyframe.bytes.begin(), keyframe.bytes.end());
    folder.write("spool/" + segment_name(i + 1), std::string(bytes.begin(), bytes.end()));
  }
  SpoolOptions options = small();
  options.max_age = std::chrono::seconds(45);
  Spool spool(folder / "spool", options);
  CHECK(spool.counters().keyframes_on_disk == 3);
  add(spool, kTuesday, 0, 1);
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_lost == 2);
  CHECK(has_equal(spool, kMonday, 2));
  CHECK(has_equal(spool, kTuesday, 0));
}

TEST_CASE("a keyframe larger than the whole spool is refused, one larger than a segment is not") {
  const TemporaryDirectory folder;
  Spool spool(folder / "spool", small());
  add(spool, kMonday, 0, 1, 300000);
  add(spool, kMonday, 1, 2, 2000000);
  add(spool, kMonday, 2, 3, 300000);
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_refused == 1);
  CHECK(has_equal(spool, kMonday, 0, 300000));
  CHECK(has_equal(spool, kMonday, 2, 300000));
}

TEST_CASE("two processes cannot use one spool, and impossible limits and paths are refused") {
  const TemporaryDirectory folder;
  const Spool spool(folder / "spool");
  CHECK_THROWS_WITH(Spool(folder / "spool"), Catch::Contains("another process"));
  SpoolOptions options;
  options.segment_bytes = options.bytes;
  CHECK_THROWS_AS(Spool(folder / "other", options), std::invalid_argument);
  folder.write("file", "");
  CHECK_THROWS_AS(Spool(folder / "file"), SpoolError);
  CHECK_THROWS_AS(Spool(folder / "file" / "below"), SpoolError);
}
