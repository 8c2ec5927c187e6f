// Tests of the spool on a disk that is full, fails or goes away.
#include "tests/ports/spool/disk.hpp"
#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

TEST_CASE("what a failing disk did not take is written once it works, and both are reported") {
  const TemporaryDirectory folder;
  Disk disk;
  std::mutex mutex;
  std::string said;
  SpoolOptions options = small();
  options.report = [&](const std::string& text) {
    const std::lock_guard lock(mutex);
    said += text + "\n";
  };
  Spool spool(folder / "spool", options, on(disk));
  add(spool, kMonday, 0, 5);
  REQUIRE(spool.flush(kPatience));
  SECTION("writing fails") { disk.write_error = EIO; }
  SECTION("syncing fails") { disk.sync_error = EIO; }
  SECTION("it is full") { disk.capacity = disk.used + 700; }
  add(spool, kMonday, 5, 10);
  wait_until_failing(spool);
  CHECK_FALSE(spool.flush(std::chrono::milliseconds(50)));
  CHECK(spool.counters().write_failures > 0);
  CHECK(spool.counters().keyframes_durable == 5);
  CHECK_FALSE(spool.is_durable(kMonday.id, 5));
  // They are in memory still.
  for (std::uint32_t i = 0; i < 10; ++i) CHECK(has_equal(spool, kMonday, i));
  disk.write_error = 0;
  disk.sync_error = 0;
  disk.capacity = std::int64_t{1} << 40U;
  wait_until_written(spool, 10);
  REQUIRE(spool.flush(kPatience));
  CHECK_FALSE(spool.counters().failing);
  for (std::uint32_t i = 0; i < 10; ++i) CHECK(has_equal(spool, kMonday, i));
  const std::lock_guard lock(mutex);
  CHECK(said.find("cannot be written") != std::string::npos);
  CHECK(said.find("works again") != std::string::npos);
}

TEST_CASE("memory for a failing disk is bounded, and what is refused is counted") {
  const TemporaryDirectory folder;
  Disk disk;
  disk.write_error = EIO;
  SpoolOptions options = small();
  options.queue_bytes = 20000;
  Spool spool(folder / "spool", options, on(disk));
  add(spool, kMonday, 0, 1);
  wait_until_failing(spool);
  add(spool, kMonday, 1, 50);
  CHECK(spool.counters().keyframes_refused >= 39);
  CHECK_FALSE(spool.holds(kMonday.id, 1));
  CHECK(has_equal(spool, kMonday, 49));
  disk.write_error = 0;
  while (!spool.flush(kPatience)) {
  }
  const SpoolCounters counters = spool.counters();
  CHECK(counters.keyframes_durable + counters.keyframes_refused == counters.keyframes_added);
}

TEST_CASE("a full disk makes room of what is acknowledged, and of nothing else") {
  const TemporaryDirectory folder;
  Disk disk;
  Spool spool(folder / "spool", small(), on(disk));
  add(spool, kMonday, 0, 100);
  REQUIRE(spool.flush(kPatience));
  disk.capacity = disk.used.load();
  add(spool, kMonday, 100, 110);
  wait_until_failing(spool);
  CHECK(spool.counters().keyframes_on_disk == 100);
  std::vector<std::uint32_t> stored(100);
  std::iota(stored.begin(), stored.end(), 0U);
  spool.acknowledge(kMonday.id, stored);
  wait_until_written(spool, 110);
  CHECK(spool.counters().keyframes_lost == 0);
  for (std::uint32_t i = 100; i < 110; ++i) CHECK(has_equal(spool, kMonday, i));
}

TEST_CASE("nothing is called durable whose folder was removed, and a new folder is made") {
  const TemporaryDirectory folder;
  Spool spool(folder / "spool", small());
  add(spool, kMonday, 0, 5);
  REQUIRE(spool.flush(kPatience));
  std::filesystem::remove_all(folder / "spool");
  add(spool, kMonday, 5, 10);
  wait_until_written(spool, 10);
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_lost == 5);
  for (std::uint32_t i = 0; i < 10; ++i) {
    CHECK(spool.is_durable(kMonday.id, i) == (i >= 5));
    CHECK(has_equal(spool, kMonday, i) == (i >= 5));
  }
  CHECK(segments_of(folder / "spool").size() == 1);
}

TEST_CASE("a disk that fails from the start delays nothing and is used once it works") {
  const TemporaryDirectory folder;
  Disk disk;
  disk.folder_error = EIO;
  Spool spool(folder / "spool", small(), on(disk));
  CHECK(spool.counters().failing);
  add(spool, kMonday, 0, 5);
  for (std::uint32_t i = 0; i < 5; ++i) CHECK(has_equal(spool, kMonday, i));
  disk.folder_error = 0;
  wait_until_written(spool, 5);
  CHECK(spool.counters().keyframes_on_disk == 5);
}
