// Tests of what a spool writes while it waits for the disk.
#include "tests/ports/spool/disk.hpp"
#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

namespace {

/// Whether a start after the process was killed now would find the keyframe.
bool is_found_by_next_start(const std::filesystem::path& folder, std::uint32_t sequence) {
  const TemporaryDirectory other;
  std::filesystem::copy(folder, other / "copy", std::filesystem::copy_options::recursive);
  Spool next(other / "copy", small());
  return has_equal(next, kMonday, sequence);
}

bool becomes_found_by_next_start(const std::filesystem::path& folder, std::uint32_t sequence) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (std::chrono::steady_clock::now() < deadline) {
    if (is_found_by_next_start(folder, sequence)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

/// Adds keyframe 0 and returns while the disk is waited for.
void begin_sync(Spool& spool, Disk& disk) {
  disk.blocks = true;
  add(spool, kMonday, 0, 1);
  wait_until([&] { return disk.waiting > 0; });
}

}  // namespace

TEST_CASE("a keyframe added while the disk is waited for survives the end of the process") {
  const TemporaryDirectory folder;
  Disk disk;
  Spool spool(folder / "spool", small(), on(disk));
  begin_sync(spool, disk);
  add(spool, kMonday, 1, 4);
  const bool found = becomes_found_by_next_start(folder / "spool", 3);
  const bool durable = spool.is_durable(kMonday.id, 0) || spool.is_durable(kMonday.id, 3);
  disk.blocks = false;
  CHECK(found);
  CHECK_FALSE(durable);
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_durable == 4);
  CHECK(spool.counters().keyframes_on_disk == 4);
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(has_equal(spool, kMonday, i));
}

TEST_CASE("what was written beside a sync that fails is written again") {
  const TemporaryDirectory folder;
  Disk disk;
  disk.fails_once = true;
  Spool spool(folder / "spool", small(), on(disk));
  begin_sync(spool, disk);
  SECTION("the sync fails") {
    add(spool, kMonday, 1, 4);
    (void)becomes_found_by_next_start(folder / "spool", 3);
    disk.sync_error = EIO;
  }
  SECTION("the writing fails") {
    disk.write_error = EIO;
    add(spool, kMonday, 1, 4);
  }
  SECTION("the disk is full") {
    disk.write_error = ENOSPC;
    add(spool, kMonday, 1, 4);
  }
  disk.blocks = false;
  wait_until_written(spool, 4);
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_durable == 4);
  CHECK(spool.counters().keyframes_on_disk == 4);
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(is_found_by_next_start(folder / "spool", i));
}

TEST_CASE("many keyframes beside slow syncs fill segments, and all become durable once") {
  const TemporaryDirectory folder;
  Disk disk;
  Spool spool(folder / "spool", small(), on(disk));
  for (std::uint32_t i = 0; i < 200; i += 10) {
    disk.blocks = true;
    add(spool, kMonday, i, i + 10);
    spool.acknowledge(kMonday.id, {{i}});
    disk.blocks = false;
  }
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_durable == 200);
  CHECK(spool.counters().keyframes_refused == 0);
  CHECK(is_found_by_next_start(folder / "spool", 199));
}
