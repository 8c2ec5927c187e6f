// Tests of stored projects: epochs, statements, results, outcomes of loops, invariants.
#include <catch2/catch.hpp>

#include "ports/store/project_writer.hpp"
#include "ports/store/session_import.hpp"
#include "ports/store/transaction.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/ports/store/faulty_disk.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

Pose pose_of(int number) {
  const double angle = 0.1 * number;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {1.0 / 3.0 + number, -2.0 * number, 0.1}};
}

bool same(const Pose& a, const Pose& b) {
  return a.rotation == b.rotation && a.translation == b.translation;
}

/// A store with two sessions that a base has received.
struct Received {
  TemporaryDirectory folder;

  Received() {
    Base base(folder.path());
    base.feed(wire_test::session_stream(kAlpha, 5));
    base.feed(wire_test::session_stream(kBeta, 3));
    base.advance();
  }
  [[nodiscard]] std::vector<std::string> check() const {
    return StoreReader(folder.path()).check();
  }
  [[nodiscard]] ProjectState current() const {
    StoreReader reader(folder.path());
    return reader.project().current();
  }
};

std::optional<Epoch> change_nothing(ProjectWriter& writer, const std::string& command) {
  return writer.commit(command, [](ProjectState&) { return std::optional<std::string>("done"); });
}

MapResult small_result() {
  MapResult result;
  result.parameters = "{}";
  result.sessions.push_back({1,
                             "central",
                             "",
                             pose_of(1),
                             {0, 1, 2, 3, 4},
                             {pose_of(0), pose_of(1), pose_of(2), pose_of(3), pose_of(4)}});
  result.sessions.push_back({2, "unconnected", "too few", {}, {0, 2}, {pose_of(5), pose_of(6)}});
  LoopResult loop;
  loop.query = {1, 4};
  loop.match = {1, 0};
  loop.T_match_query = pose_of(7);
  for (int i = 0; i < 36; ++i) loop.information.data()[i] = 1.0 / (i + 3);
  loop.overlap = 0.123456789;
  loop.confidence = 0.9F;
  loop.accepted = true;
  loop.by_person = true;
  loop.reason = "linked by a person";
  result.loops.push_back(loop);
  loop.query = {2, 0};
  loop.accepted = loop.by_person = false;
  loop.reason = "overlap 0.10 (limit 0.45)";
  result.loops.push_back(loop);
  return result;
}

std::optional<Epoch> keep_result(ProjectWriter& writer) {
  return writer.commit("merge", [&writer](ProjectState& state) {
    state.epoch.result = writer.keep(small_result());
    return std::optional<std::string>("merged");
  });
}

}  // namespace

TEST_CASE("what a base has received is in the next epoch, and what it receives later in a later") {
  const Received store;
  CHECK(store.current().sessions.empty());
  {
    ProjectWriter writer(store.folder.path(), "a test");
    CHECK(writer.current().sessions == std::vector<std::int64_t>{1, 2});
    const auto epoch = change_nothing(writer, "first");
    REQUIRE(epoch);
    CHECK(epoch->number == 1);
    CHECK(epoch->parent == 0);
  }
  CHECK(store.current().sessions == std::vector<std::int64_t>{1, 2});
  {
    Base base(store.folder.path());
    base.feed(SessionId{3, 33}, 0);
    base.advance();
  }
  CHECK(store.current().sessions == std::vector<std::int64_t>{1, 2});
  ProjectWriter writer(store.folder.path(), "a test");
  (void)change_nothing(writer, "second");
  CHECK(store.current().sessions == std::vector<std::int64_t>{1, 2, 3});
  CHECK(store.current().epoch.parent == 1);
  CHECK(store.check().empty());
}

TEST_CASE("a session that was taken out stays out, and earlier epochs show it") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  (void)change_nothing(writer, "first");
  (void)writer.commit("remove", [](ProjectState& state) {
    std::erase(state.sessions, 1);
    return std::optional<std::string>("removed");
  });
  (void)change_nothing(writer, "third");
  CHECK(store.current().sessions == std::vector<std::int64_t>{2});
  StoreReader reader(store.folder.path());
  CHECK(reader.project().at(1).sessions == std::vector<std::int64_t>{1, 2});
  CHECK(reader.project().epochs().size() == 3);
  CHECK_THROWS_WITH(reader.project().at(4), Contains("has no epoch 4"));
  CHECK(store.check().empty());
}

TEST_CASE("statements come back as they were made, to the bit") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  const auto say = [&writer](const StoredStatement& statement) {
    (void)writer.commit("say", [&](ProjectState& state) {
      state.statements.push_back(statement);
      return std::optional<std::string>("said");
    });
  };
  say({0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)});
  say({0, StatementKind::kLink, {1, 1}, {2, 1}, std::nullopt});
  say({0, StatementKind::kForbidden, {1, 0}, {1, 4}, std::nullopt});
  say({0, StatementKind::kApart, {2, 0}, {}, std::nullopt});
  say({0, StatementKind::kReference, {1, 0}, {}, std::nullopt});
  const std::vector<StoredStatement> said = store.current().statements;
  REQUIRE(said.size() == 5);
  CHECK(said[0].kind == StatementKind::kLink);
  CHECK(said[0].match == KeyframeRow{1, 0});
  CHECK(said[0].query == KeyframeRow{2, 2});
  REQUIRE(said[0].T_match_query);
  CHECK(same(*said[0].T_match_query, pose_of(3)));
  CHECK_FALSE(said[1].T_match_query);
  CHECK(said[2].kind == StatementKind::kForbidden);
  CHECK(said[3].kind == StatementKind::kApart);
  CHECK(said[3].match.session == 2);
  CHECK(said[4].kind == StatementKind::kReference);
  StoreReader reader(store.folder.path());
  CHECK(reader.project().at(2).statements.size() == 2);
  CHECK(store.check().empty());
}

TEST_CASE("the result of a merge comes back to the bit, and later epochs show it") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  REQUIRE(keep_result(writer)->result == 1);
  (void)change_nothing(writer, "second");
  CHECK(store.current().epoch.result == 1);
  StoreReader reader(store.folder.path());
  const MapResult wanted = small_result();
  const MapResult found = reader.project().result(1);
  CHECK(found.parameters == "{}");
  REQUIRE(found.sessions.size() == 2);
  for (std::size_t s = 0; s < 2; ++s) {
    CHECK(found.sessions[s].session == wanted.sessions[s].session);
    CHECK(found.sessions[s].state == wanted.sessions[s].state);
    CHECK(found.sessions[s].reason == wanted.sessions[s].reason);
    CHECK(same(found.sessions[s].T_map_session, wanted.sessions[s].T_map_session));
    CHECK(found.sessions[s].sequences == wanted.sessions[s].sequences);
    REQUIRE(found.sessions[s].T_map_keyframe.size() == wanted.sessions[s].T_map_keyframe.size());
    for (std::size_t k = 0; k < wanted.sessions[s].T_map_keyframe.size(); ++k) {
      CHECK(same(found.sessions[s].T_map_keyframe[k], wanted.sessions[s].T_map_keyframe[k]));
    }
  }
  REQUIRE(found.loops.size() == 2);
  CHECK(found.loops[0].query == wanted.loops[0].query);
  CHECK(found.loops[0].match == wanted.loops[0].match);
  CHECK(same(found.loops[0].T_match_query, wanted.loops[0].T_match_query));
  CHECK(found.loops[0].overlap == wanted.loops[0].overlap);
  CHECK(found.loops[0].confidence == wanted.loops[0].confidence);
  CHECK(found.loops[0].accepted);
  CHECK(found.loops[0].by_person);
  CHECK(found.loops[0].reason == "linked by a person");
  CHECK_FALSE(found.loops[1].accepted);
  CHECK(found.loops[1].reason == wanted.loops[1].reason);
  CHECK(store.check().empty());
}

TEST_CASE("a change that throws, or changes nothing, leaves no epoch") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  CHECK_THROWS_WITH(writer.commit("bad",
                                  [&writer](ProjectState& state) -> std::optional<std::string> {
                                    state.epoch.result = writer.keep(small_result());
                                    throw StoreError("on purpose");
                                  }),
                    Contains("on purpose"));
  CHECK_FALSE(writer.commit("none", [](ProjectState&) { return std::optional<std::string>(); }));
  CHECK(store.current().epoch.number == 0);
  CHECK(writer.database().number("SELECT count(*) FROM results") == 0);
  CHECK(store.check().empty());
}

TEST_CASE("whichever write of a change fails, the epoch before is whole") {
  const FaultyDisk disk;
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  std::int64_t epochs = 0;
  int writes = 0;
  for (;; ++writes) {
    FaultyDisk::heal();
    FaultyDisk::writes_left = writes;
    FaultyDisk::write_error = SQLITE_FULL;
    bool failed = false;
    try {
      (void)keep_result(writer);
      ++epochs;
    } catch (const StoreError&) {
      failed = true;
    }
    const bool was_reached = FaultyDisk::failures > 0;
    FaultyDisk::heal();
    REQUIRE(store.current().epoch.number == epochs);
    REQUIRE(store.check().empty());
    if (!failed && !was_reached) break;
    REQUIRE(writes < 200);
  }
  CHECK(writes > 3);
}

TEST_CASE("one writes to a store, and others are told who it is") {
  const Received store;
  {
    const ProjectWriter writer(store.folder.path(), "`unimapper map merge`");
    CHECK_THROWS_WITH(KeyframeStore(store.folder.path()),
                      Contains("`unimapper map merge` writes to this store (process "));
    CHECK(StoreReader(store.folder.path()).sessions().size() == 2);
  }
  const KeyframeStore base(store.folder.path());
  CHECK_THROWS_WITH(ProjectWriter(store.folder.path(), "a test"),
                    Contains("a base writes to this store (process "));
  const TemporaryDirectory empty;
  CHECK_THROWS_WITH(ProjectWriter(empty.path(), "a test"), Contains("is no store"));
}

TEST_CASE("outcomes of loops are found for exactly the same question") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  const LoopKey key{{1, 4}, {2, 0}, pose_of(3), 0xFEDCBA9876543210ULL};
  LoopResult outcome = small_result().loops[0];
  CHECK_FALSE(writer.outcomes().find(key));
  {
    Transaction transaction(writer.database());
    writer.outcomes().keep(key, outcome);
    outcome.reason = "another";
    writer.outcomes().keep(key, outcome);  // the first one stays
    transaction.commit();
  }
  const auto found = writer.outcomes().find(key);
  REQUIRE(found);
  CHECK(same(found->T_match_query, outcome.T_match_query));
  CHECK(found->information == small_result().loops[0].information);
  CHECK(found->overlap == outcome.overlap);
  CHECK(found->accepted);
  CHECK(found->reason == "linked by a person");
  LoopKey other = key;
  other.fingerprint += 1;
  CHECK_FALSE(writer.outcomes().find(other));
  other = key;
  other.proposed.translation.x() = std::nextafter(other.proposed.translation.x(), 1e9);
  CHECK_FALSE(writer.outcomes().find(other));
  other = key;
  other.match.sequence = 1;
  CHECK_FALSE(writer.outcomes().find(other));
  CHECK(store.check().empty());
  // One that is damaged is verified again.
  writer.database().run("UPDATE loop_outcomes SET reason = 'x'");
  CHECK_FALSE(writer.outcomes().find(key));
  CHECK(store.check() == std::vector<std::string>{"1 outcomes of loops are damaged"});
}

TEST_CASE("the check finds what breaks an invariant of the project") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)writer.commit("say", [](ProjectState& state) {
      state.statements.push_back({0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)});
      return std::optional<std::string>("said");
    });
    (void)keep_result(writer);
  }
  REQUIRE(store.check().empty());
  const auto [change, fault] = GENERATE(table<std::string, std::string>(
      {{"UPDATE epochs SET number = 9 WHERE number = 2", "epoch 9 does not follow on 1"},
       {"UPDATE epochs SET parent = 2 WHERE number = 2", "epoch 2 has no parent"},
       {"UPDATE epochs SET known_sessions = 1", "session that it doesn't know"},
       {"UPDATE epochs SET outcome = ''", "does not say what it is"},
       {"UPDATE epochs SET result = NULL", "a result belongs to no epoch"},
       {"DELETE FROM epoch_sessions WHERE session = 2", "shows a session that is not in it"},
       {"UPDATE statements SET kind = 'hope'", "a statement is damaged"},
       {"UPDATE statements SET query_sequence = 77", "a keyframe that is not there"},
       {"UPDATE statements SET pose = zeroblob(96)", "has a pose that is none"},
       {"UPDATE statements SET pose = zeroblob(95)", "a link is damaged"},
       {"UPDATE result_sessions SET state = 'merged'", "not one central session"},
       {"UPDATE result_sessions SET reason = ''", "a wrong reason"},
       {"UPDATE result_sessions SET poses = zeroblob(length(poses))", "is damaged"},
       {"UPDATE result_sessions SET sequences = zeroblob(length(sequences))", "out of order"},
       {"UPDATE result_loops SET query_sequence = 3 WHERE number = 1", "a keyframe that is not in"},
       {"UPDATE result_loops SET reason = ''", "without a reason"},
       {"DELETE FROM keyframes WHERE sequence = 4; "
        "UPDATE sessions SET keyframes = keyframes - 1 WHERE id = 1",
        "a keyframe that is not stored"}}));
  Database(database_of(store.folder.path()), Access::kWrite).run(change);
  std::string all;
  for (const std::string& text : store.check()) all += text + "\n";
  INFO(change);
  CHECK_THAT(all, Contains(fault));
}

TEST_CASE("a recorded session is imported once, whole or not at all") {
  const TemporaryDirectory folder;
  ProjectWriter writer(folder.path(), "a test", true);
  const auto import = [&writer](const std::vector<wire_test::Message>& messages, bool commits) {
    Transaction transaction(writer.database());
    SessionImport imported(writer.database());
    wire::Receiver receiver({}, imported);
    wire_test::feed(receiver, messages);
    receiver.store_all();
    CHECK(imported.trouble().empty());
    if (commits) transaction.commit();
    return imported.sessions();
  };
  const auto stream = wire_test::session_stream(kAlpha, 5);
  CHECK(import(stream, false).at(kAlpha.id).keyframes == 5);
  CHECK(StoreReader(folder.path()).sessions().empty());
  CHECK(import(stream, true).at(kAlpha.id).keyframes == 5);
  const auto again = import(stream, true);
  CHECK(again.at(kAlpha.id).keyframes == 0);
  CHECK(again.at(kAlpha.id).repeated == 5);
  StoreReader reader(folder.path());
  REQUIRE(reader.sessions().size() == 1);
  wire_test::check_whole(reader.read(reader.sessions()[0]), kAlpha, 5);
  CHECK(reader.check().empty());
}
