// Tests of a store on a disk that fails or is full.
#include "tests/ports/store/base.hpp"
#include "tests/ports/store/faulty_disk.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};

}  // namespace

TEST_CASE("a commit that fails acknowledges nothing, is reported and tried again") {
  const TemporaryDirectory folder;
  const FaultyDisk disk;
  Base base(folder.path());
  base.feed(kAlpha.id, 0);
  base.advance();
  REQUIRE(base.acknowledged().at(kAlpha.id) == 1);

  const bool in_sync = GENERATE(false, true);
  const int error = GENERATE(SQLITE_FULL, SQLITE_IOERR_WRITE);
  CAPTURE(in_sync, error);
  FaultyDisk::write_error = in_sync ? SQLITE_OK : error;
  FaultyDisk::sync_error = in_sync ? SQLITE_IOERR_FSYNC : SQLITE_OK;
  base.feed(kAlpha.id, 1);
  for (int second = 0; second < 3; ++second) {
    base.advance();
    REQUIRE(FaultyDisk::failures > second);
    CHECK(base.store.waiting() == 1);
    CHECK(base.receiver.progress()[0].received == 1);
  }
  CHECK(base.acknowledged().at(kAlpha.id) == 1);
  CHECK(base.store.counters().failed_commits >= 3);
  CHECK_THAT(base.store.trouble(), Contains("store.sqlite: ") && Contains("disk"));
  CHECK(stored_bytes(folder.path()).size() == 1);

  FaultyDisk::heal();
  base.advance();
  CHECK(base.store.trouble().empty());
  CHECK(base.acknowledged().at(kAlpha.id) == 2);
  CHECK(stored_bytes(folder.path()).size() == 2);
  CHECK(StoreReader(folder.path()).check().empty());
}

TEST_CASE("a commit is acknowledged whole or not at all, whichever write fails") {
  const TemporaryDirectory folder;
  const FaultyDisk disk;
  Base base(folder.path());
  std::uint32_t made = 0;
  int commits_failed = 0;
  for (int writes = 0; writes < 30; ++writes) {
    FaultyDisk::writes_left = writes;
    FaultyDisk::write_error = SQLITE_IOERR_WRITE;
    for (int i = 0; i < 3; ++i) base.feed(kAlpha.id, made++);
    base.advance();
    commits_failed += FaultyDisk::failures > 0 ? 1 : 0;
    FaultyDisk::heal();
    for (const auto& [session, below] : base.acknowledged()) {
      REQUIRE(below <= stored_bytes(folder.path()).size());
    }
  }
  base.advance();
  base.advance();
  CHECK(commits_failed > 10);
  CHECK(base.receiver.progress()[0].received == made);
  const auto stored = stored_bytes(folder.path());
  CHECK(stored.size() == made);
  for (const auto& [name, bytes] : stored) {
    REQUIRE(bytes == wire::encode_keyframe(wire_test::keyframe_of(kAlpha.id, name.sequence)));
  }
  CHECK(StoreReader(folder.path()).check().empty());
}

TEST_CASE("a store at its largest size takes nothing more and loses nothing it has") {
  const TemporaryDirectory folder;
  StoreOptions options = impatient();
  options.max_bytes = 280000;
  std::uint64_t acknowledged = 0;
  {
    Base base(folder.path(), options);
    for (std::uint32_t sequence = 0; sequence < 200; ++sequence) {
      base.feed(kAlpha.id, sequence);
      if (sequence % 10 == 9) base.advance();
    }
    acknowledged = base.receiver.progress()[0].received;
    CHECK(acknowledged > 5);
    CHECK(acknowledged < 200);
    CHECK_THAT(base.store.trouble(), Contains("full"));
    // What is said is that nothing more is wanted now.
    for (const wire::StoredMessage& message : base.receiver.take_stored()) {
      CHECK(message.below == acknowledged);
      CHECK(message.until == message.first);
    }
  }
  CHECK(std::filesystem::file_size(database_of(folder.path())) <= options.max_bytes + 8192);
  CHECK(stored_bytes(folder.path()).size() == acknowledged);
  // With more room it goes on.
  Base base(folder.path());
  base.feed_first(kAlpha.id, 200);
  base.advance();
  CHECK(base.acknowledged().at(kAlpha.id) == 200);
}

TEST_CASE("a session that cannot be read is reported, not taken for a new one") {
  const TemporaryDirectory folder;
  {
    Base base(folder.path());
    base.feed_first(kAlpha.id, 3);
    base.advance();
  }
  Base base(folder.path());
  // Somebody took the table away under the base.
  Database(database_of(folder.path()), Access::kWrite).run("DROP TABLE keyframes");
  base.feed(kAlpha.id, 0);
  base.advance();
  CHECK(base.acknowledged().empty());
  CHECK_THAT(base.store.trouble(), Contains("no such table"));
}
