// Tests of the durable store: idempotence, restart, schema, locks.
#include "ports/store/session_follower.hpp"
#include "ports/store/session_key.hpp"
#include "ports/store/store_file.hpp"
#include "ports/store/transaction.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

namespace {

const SessionInfo kAlpha{{1, 0xFEDCBA9876543210ULL}, "alpha", "os2-128"};
const SessionInfo kBeta{{0xFFFFFFFF, 22}, "beta", "vlp-16"};

/// Runs statements on a database, whatever it is.
void run(const std::filesystem::path& file, const std::string& statements) {
  Database(file, Access::kWrite).run(statements);
}

}  // namespace

TEST_CASE("an identity is the same after its way through bytes") {
  for (const SessionId& id : {SessionId{}, kAlpha.id, kBeta.id}) CHECK(from_key(to_key(id)) == id);
  CHECK_FALSE(from_key(std::vector<std::uint8_t>(3)));
}

TEST_CASE("sessions come out of a store as they arrived") {
  const TemporaryDirectory folder;
  {
    Base base(folder.path());
    base.feed(wire_test::session_stream(kAlpha, 5));
    base.feed(wire_test::session_stream(kBeta, 3));
    base.advance();
    CHECK(base.acknowledged() == std::map<SessionId, std::uint64_t>{{kAlpha.id, 5}, {kBeta.id, 3}});
    CHECK(base.store.counters().keyframes == 8);
    CHECK(base.store.counters().summaries == 0);
    CHECK(base.store.counters().longest_commit.count() > 0);
    CHECK(base.store.counters().commit_times.total >= base.store.counters().longest_commit);
    CHECK(base.store.counters().waits.total.count() > 0);
    CHECK(base.store.trouble().empty());
  }
  StoreReader reader(folder.path());
  const std::vector<SessionListing> sessions = reader.sessions();
  REQUIRE(sessions.size() == 2);
  wire_test::check_whole(reader.read(sessions[0]), kAlpha, 5);
  wire_test::check_whole(reader.read(sessions[1]), kBeta, 3);
  CHECK(sessions[0].first_stamp_ns == wire_test::keyframe_of(kAlpha.id, 0).scans.back().stamp_ns);
  CHECK(sessions[0].last_stamp_ns == wire_test::keyframe_of(kAlpha.id, 4).scans.back().stamp_ns);
  CHECK(reader.check().empty());
}

TEST_CASE("summaries are stored until their keyframes are, across restarts") {
  const TemporaryDirectory folder;
  {
    Base base(folder.path());
    base.feed(kAlpha.id, 0);
    base.feed(most_of(kAlpha.id, 1));
    base.feed(most_of(kAlpha.id, 2));
    base.feed(most_of(kBeta.id, 0));
    base.advance();
    CHECK(base.store.counters().summaries == 3);
    CHECK(base.acknowledged() == std::map<SessionId, std::uint64_t>{{kAlpha.id, 1}, {kBeta.id, 0}});
  }
  {
    StoreReader reader(folder.path());
    const std::vector<SessionListing> sessions = reader.sessions();
    REQUIRE(sessions.size() == 2);
    CHECK(sessions[0].keyframes == 1);
    CHECK(sessions[0].summaries == 2);
    const SessionData session = reader.read(sessions[0]);
    CHECK(session.keyframes.size() == 1);
    REQUIRE(session.summaries.size() == 2);
    CHECK(session.summaries[1].sequence == 2);
    CHECK(session.summaries[1].keypoints.size() ==
          wire_test::keyframe_of(kAlpha.id, 2).keypoints.size());
    CHECK(reader.check().empty());
  }
  Base base(folder.path());
  base.feed(most_of(kAlpha.id, 1));
  base.feed(kAlpha.id, 2);
  base.advance();
  CHECK(base.store.counters().summaries == 0);
  StoreReader reader(folder.path());
  const SessionData session = reader.read(reader.sessions()[0]);
  CHECK(session.keyframes.size() == 2);
  REQUIRE(session.summaries.size() == 1);
  CHECK(session.summaries[0].sequence == 1);
}

TEST_CASE("of two summaries that differ none is stored") {
  const TemporaryDirectory folder;
  KeyframeRecord forged = wire_test::keyframe_of(kAlpha.id, 0);
  forged.T_odometry_keyframe.translation.x() += 100.0;
  Base base(folder.path());
  base.feed(most_of(forged));
  const bool is_stored_before = GENERATE(true, false);
  if (is_stored_before) base.advance();
  base.feed(most_of(kAlpha.id, 0));
  base.advance();
  CHECK(StoreReader(folder.path()).sessions().empty());
}

TEST_CASE("the same keyframes once more change nothing, across restarts") {
  const TemporaryDirectory folder;
  for (int round = 0; round < 3; ++round) {
    Base base(folder.path());
    base.feed(wire_test::session_stream(kAlpha, 4));
    base.advance();
    CHECK(base.acknowledged().at(kAlpha.id) == 4);
    CHECK(base.store.counters().keyframes == (round == 0 ? 4 : 0));
  }
  CHECK(stored_bytes(folder.path()).size() == 4);
}

TEST_CASE("a store that is handed what it has leaves it as it is") {
  const TemporaryDirectory folder;
  KeyframeStore store(folder.path(), impatient());
  const auto received = [](std::uint32_t cells) {
    wire::ReceivedKeyframe keyframe;
    keyframe.record = wire_test::keyframe_of(kAlpha.id, 7, cells);
    keyframe.bytes = wire::encode_keyframe(keyframe.record);
    return keyframe;
  };
  const std::vector<std::uint8_t> first = received(50).bytes;
  for (const std::uint32_t cells : {50U, 80U, 90U}) {
    (void)store.keep(received(cells));
    CHECK(store.commit_all(1).keyframes.size() == 1);  // it is stored
  }
  CHECK(store.counters().keyframes == 1);
  CHECK(store.counters().repeated == 2);
  const auto stored = stored_bytes(folder.path());
  REQUIRE(stored.size() == 1);
  CHECK(stored.begin()->second == first);
  CHECK(StoreReader(folder.path()).check().empty());
}

TEST_CASE("keyframes that wait are committed together, after a while or when they are many") {
  const TemporaryDirectory folder;
  StoreOptions options;
  options.batch_keyframes = 4;
  options.batch_interval_ns = 3 * kSecondNs;
  Base base(folder.path(), options);
  base.advance();
  base.feed_first(kAlpha.id, 3);
  base.advance();
  CHECK(base.store.waiting() == 3);
  CHECK(base.store.counters().commits == 0);
  base.feed(kAlpha.id, 3);
  CHECK(base.store.waiting() == 0);
  CHECK(base.store.counters().commits == 1);
  base.feed(kAlpha.id, 4);
  base.advance();
  CHECK(base.store.waiting() == 1);
  base.advance();
  base.advance();
  CHECK(base.store.waiting() == 0);
  base.feed(kAlpha.id, 5);
  base.receiver.store_all();
  CHECK(base.store.waiting() == 0);
  CHECK(stored_bytes(folder.path()).size() == 6);
}

TEST_CASE("what waits for the disk is bounded") {
  const TemporaryDirectory folder;
  StoreOptions options;
  options.batch_interval_ns = 100 * kSecondNs;
  const std::uint64_t bytes = wire::encode_keyframe(wire_test::keyframe_of(kAlpha.id, 0)).size();
  options.max_waiting_bytes = bytes + 10;
  Base base(folder.path(), options);
  base.feed(kAlpha.id, 0);
  base.feed(kAlpha.id, 1);
  CHECK(base.store.waiting() == 1);
  CHECK(base.receiver.counters().refused == 1);
}

TEST_CASE("two sessions of one name are told apart, and a nameless one has its numbers") {
  const TemporaryDirectory folder;
  Base base(folder.path());
  SessionInfo twin = kAlpha;
  twin.id.boot = 5;
  base.feed(wire_test::session_stream(kAlpha, 1));
  base.feed(wire_test::session_stream(twin, 2));
  base.feed({3, 4}, 0);
  base.advance();
  base.receiver.store_all();
  std::map<std::string, std::uint64_t> keyframes;
  for (const SessionListing& session : StoreReader(folder.path()).sessions()) {
    keyframes[session.info.name] = session.keyframes;
  }
  CHECK(keyframes == std::map<std::string, std::uint64_t>{
                         {"alpha", 1}, {"alpha-2", 2}, {wire::name_of({3, 4}), 1}});
}

TEST_CASE("a session that is forgotten and heard again is as it was, also before a commit") {
  const TemporaryDirectory folder;
  StoreOptions options;
  options.batch_interval_ns = 100 * kSecondNs;
  KeyframeStore store(folder.path(), options);
  wire::ReceivedKeyframe keyframe;
  keyframe.record = wire_test::keyframe_of(kAlpha.id, 3);
  keyframe.bytes = wire::encode_keyframe(keyframe.record);
  (void)store.keep(std::move(keyframe));
  (void)store.commit_all(1);
  CHECK(store.find(kAlpha.id)->keyframes.contains(3));
  CHECK_FALSE(store.find(kAlpha.id)->summary.info);
  store.keep(wire::SessionSummary{kAlpha.id, kAlpha, true, UINT64_MAX, 2});
  for (int i = 0; i < 2; ++i) {
    const auto session = store.find(kAlpha.id);
    REQUIRE(session);
    CHECK(session->summary.info->sensor == "os2-128");
    CHECK(session->summary.ended);
    CHECK(session->summary.announced == UINT64_MAX);
    CHECK(session->summary.dropped_by_sender == 2);
    CHECK(session->keyframes.count() == 1);
    (void)store.commit_all(2);
  }
  CHECK(store.find(kBeta.id)->keyframes.count() == 0);
}

TEST_CASE("a reader sees what is committed while the base writes on") {
  const TemporaryDirectory folder;
  Base base(folder.path());
  StoreReader reader(folder.path());
  CHECK(reader.sessions().empty());
  base.feed(kAlpha.id, 0);
  base.advance();
  CHECK(reader.sessions().at(0).keyframes == 1);
  base.feed(kAlpha.id, 1);
  CHECK(reader.sessions().at(0).keyframes == 1);
  base.advance();
  CHECK(reader.sessions().at(0).keyframes == 2);
}

TEST_CASE("what is no store of this version is refused in words and left as it is") {
  const TemporaryDirectory folder;
  const std::filesystem::path file = database_of(folder.path());
  SECTION("another schema") {
    KeyframeStore(folder.path());  // NOLINT(bugprone-unused-raii): makes it
    const auto [version, words] = GENERATE(table<std::string, std::string>(
        {{"99", "newer version of Uni-Mapper (schema 99, this version knows 6)"},
         {"5", "an earlier version of Uni-Mapper (schema 5, this version knows 6)"}}));
    run(file, "PRAGMA user_version = " + version);
    CHECK_THROWS_WITH(KeyframeStore(folder.path()), Contains(words));
    CHECK_THROWS_WITH(StoreReader(folder.path()), Contains(words));
  }
  SECTION("another program's database") {
    run(file, "CREATE TABLE mail (text TEXT); INSERT INTO mail VALUES ('hello')");
    CHECK_THROWS_WITH(KeyframeStore(folder.path()), Contains("no store of Uni-Mapper"));
    CHECK_THROWS_WITH(StoreReader(folder.path()), Contains("no store of Uni-Mapper"));
    CHECK(Database(file, Access::kRead).number("SELECT COUNT(*) FROM mail") == 1);
  }
  SECTION("no database") {
    std::ofstream(file) << std::string(10000, 'x');
    CHECK_THROWS_WITH(KeyframeStore(folder.path()), Contains("store.sqlite") && Contains("not a"));
    CHECK_THROWS_WITH(StoreReader(folder.path()), Contains("not a database"));
  }
  SECTION("no store at all") {
    CHECK_FALSE(is_store(folder.path()));
    CHECK_THROWS_WITH(StoreReader(folder.path()), Contains("is no store"));
  }
  SECTION("a file where the folder should be") {
    const std::filesystem::path taken = folder.write("taken", "text");
    CHECK_THROWS_WITH(KeyframeStore(taken), Contains("taken"));
  }
}

TEST_CASE("a damaged store is refused or says what is damaged") {
  const TemporaryDirectory folder;
  const std::filesystem::path file = database_of(folder.path());
  {
    Base base(folder.path());
    base.feed(wire_test::session_stream(kAlpha, 6));
    base.advance();
  }
  SECTION("pages overwritten: the tables are gone") {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(8192);
    stream << std::string(5 * 8192, '\xA5');
    stream.close();
    CHECK_THROWS_WITH(KeyframeStore(folder.path()), Contains("malformed"));
    CHECK_THROWS_WITH(StoreReader(folder.path()).sessions(), Contains("malformed"));
  }
  SECTION("cut off") {
    std::filesystem::resize_file(file, 3 * 8192);
    CHECK_THROWS_WITH(stored_bytes(folder.path()), Contains("malformed"));
  }
  SECTION("bytes of a keyframe changed: it is left out and counted") {
    run(file, "UPDATE keyframes SET bytes = zeroblob(length(bytes)) WHERE sequence = 2");
    StoreReader reader(folder.path());
    const SessionData session = reader.read(reader.sessions().at(0));
    CHECK(session.keyframes.size() == 5);
    CHECK(session.keyframes_damaged == 1);
    CHECK(reader.check() == std::vector<std::string>{"keyframe 2 of alpha fails its checksum"});
  }
}

TEST_CASE("the history of health is bounded, the latest of each minute") {
  const TemporaryDirectory folder;
  Base base(folder.path());
  base.feed(wire_test::session_stream(kAlpha, 1));
  wire::HealthMessage health;
  health.session = kAlpha.id;
  base.feed({wire_test::Message(health)});
  base.advance();
  CHECK(StoreReader(folder.path()).sessions().at(0).health_rows == 1);
  {
    Database database(database_of(folder.path()), Access::kWrite);
    HealthHistory history(database);
    health.stages.push_back({"ground\tplane", 1.5F, 2.0F, 3.0F});
    health.clock = wire::ClockOffset{-5000000, 1500, 2};
    Transaction transaction(database);
    for (std::int64_t minute = 0; minute < 1000; ++minute) {
      for (const std::int64_t second : {0, 59}) {
        health.scans = static_cast<std::uint64_t>(60 * minute + second);
        history.keep(health, 60 * minute + second);
      }
    }
    health.session = kBeta.id;  // not stored
    history.keep(health, 0);
    transaction.commit();
    CHECK(database.number("SELECT COUNT(*) FROM health") == kHealthRows);
    CHECK(database.number("SELECT MIN(scans) FROM health") == 60 * 400 + 59);
    CHECK(database.number("SELECT MAX(received_s) FROM health") == 60 * 999 + 59);
    CHECK(database.number("SELECT COUNT(*) FROM health WHERE details = "
                          "'stage\tground plane\t1.500\t2.000\t3.000\n"
                          "clock\t-5000000\t1500\t2\nstored\tkeyframes\t1\n'") == kHealthRows);
  }
  CHECK(StoreReader(folder.path()).sessions().at(0).health_rows ==
        static_cast<std::uint64_t>(kHealthRows));
}

TEST_CASE("a follower sees what is committed beside it, and hands out the newest in order") {
  const TemporaryDirectory directory;
  Base base(directory / "store");
  SessionFollower follower(directory / "store");
  CHECK(follower.has_changed());
  CHECK_FALSE(follower.has_changed());
  CHECK(follower.sessions().empty());
  const SessionId id{1, {2, 3}};
  for (const std::uint32_t sequence : {4U, 2U, 9U, 3U}) base.feed(id, sequence);
  base.feed(
      {wire_test::session_message({id, "alpha", "os2-128"}, wire::SessionState::kRunning, 10)});
  base.advance();
  base.advance();
  CHECK(follower.has_changed());
  CHECK_FALSE(follower.has_changed());
  const auto sessions = follower.sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].id == id);
  CHECK(sessions[0].name == "alpha");
  CHECK_FALSE(sessions[0].ended);
  CHECK(sessions[0].keyframes == 4);
  CHECK(sessions[0].newest == 9);
  CHECK(follower.start_of_newest(sessions[0], 2) == 4);
  CHECK(follower.start_of_newest(sessions[0], 400) == 2);
  const auto some = follower.keyframes(sessions[0].row, 3, 2);
  REQUIRE(some.size() == 2);
  CHECK(some[0].sequence == 3);
  CHECK(some[1].sequence == 4);
  CHECK(some[1].is_sound);
  CHECK(some[1].bytes == wire::encode_keyframe(wire_test::keyframe_of(id, 4)));
  CHECK(follower.keyframes(sessions[0].row, 10, 5).empty());
}
