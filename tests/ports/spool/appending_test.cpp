// Tests of what a spool writes while it waits for the disk.
#include <atomic>
#include <catch2/catch.hpp>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <thread>

#include "ports/spool/spool.hpp"
#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

namespace {

/// A disk that can be waited for as long as a test likes.
struct SlowDisk {
  std::atomic<bool> blocks{false};
  std::atomic<int> waiting{0};  ///< syncs begun while it blocks
  std::atomic<int> sync_error{0};
  std::atomic<int> write_error{0};
};

class SlowFiles : public Files {
 public:
  explicit SlowFiles(SlowDisk& disk) : disk_(disk) {}

  bool sync(int file) override {
    if (disk_.blocks) ++disk_.waiting;
    while (disk_.blocks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    errno = disk_.sync_error.exchange(0);
    return errno == 0 && Files::sync(file);
  }
  bool write(int file, wire::Bytes bytes) override {
    errno = disk_.write_error.exchange(0);
    return errno == 0 && Files::write(file, bytes);
  }

 private:
  SlowDisk& disk_;
};

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
void begin_sync(Spool& spool, SlowDisk& disk) {
  disk.blocks = true;
  add(spool, kMonday, 0, 1);
  while (disk.waiting == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace

TEST_CASE("a keyframe added while the disk is waited for survives the end of the process") {
  const TemporaryDirectory folder;
  SlowDisk disk;
  Spool spool(folder / "spool", small(), std::make_unique<SlowFiles>(disk));
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
  SlowDisk disk;
  Spool spool(folder / "spool", small(), std::make_unique<SlowFiles>(disk));
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
  while (spool.counters().keyframes_durable < 4) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_durable == 4);
  CHECK(spool.counters().keyframes_on_disk == 4);
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(is_found_by_next_start(folder / "spool", i));
}

TEST_CASE("many keyframes beside slow syncs fill segments, and all become durable once") {
  const TemporaryDirectory folder;
  SlowDisk disk;
  Spool spool(folder / "spool", small(), std::make_unique<SlowFiles>(disk));
  for (std::uint32_t i = 0; i < 200; i += 10) {
    disk.blocks = true;
    add(spool, kMonday, i, i + 10);
    const std::uint32_t stored[] = {i};
    spool.acknowledge(kMonday.id, stored);
    disk.blocks = false;
  }
  REQUIRE(spool.flush(kPatience));
  CHECK(spool.counters().keyframes_durable == 200);
  CHECK(spool.counters().keyframes_refused == 0);
  CHECK(is_found_by_next_start(folder / "spool", 199));
}
