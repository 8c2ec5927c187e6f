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

TEST_CASE("positions of keyframes come back as they were made, to the bit") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  StoredStatement said;
  said.kind = StatementKind::kPosition;
  said.match.session = 1;
  said.positions.push_back({1, {691234.1, 5335678.0 / 3.0, -0.0}, {0.1, 0.2, 0.3}, 0.7, 1.0 / 3.0});
  said.positions.push_back({4, {0.0, 0.0, 512.5}, Eigen::Vector3d::Zero(), std::nullopt, 0.25});
  MapResult result = small_result();
  result.positions.push_back({{1, 4}, {1.5, 2.5, 0.1}, {0, 0, 1}, 0.5, 2.0, true, "", {1, 2, 3}});
  result.positions.push_back(
      {{1, 0}, {0, 0, 7}, {0, 0, 0}, std::nullopt, 2.0, false, "off", {0, 0, 9}});
  result.georeference = GeoreferenceResult{{691000.0, 0.0, 0.0}, true, std::nullopt};
  (void)writer.commit("say", [&](ProjectState& state) {
    state.statements.push_back(said);
    state.epoch.result = writer.keep(result);
    return std::optional<std::string>("said");
  });
  (void)change_nothing(writer, "second");
  const ProjectState state = store.current();
  REQUIRE(state.statements.size() == 1);
  CHECK(state.statements[0].kind == StatementKind::kPosition);
  REQUIRE(state.statements[0].positions.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const StoredPosition& found = state.statements[0].positions[i];
    CHECK(found.sequence == said.positions[i].sequence);
    CHECK(found.position == said.positions[i].position);
    CHECK(found.point == said.positions[i].point);
    CHECK(found.sigma_xy_m == said.positions[i].sigma_xy_m);
    CHECK(found.sigma_z_m == said.positions[i].sigma_z_m);
  }
  StoreReader reader(store.folder.path());
  const MapResult found = reader.project().result(1);
  REQUIRE(found.positions.size() == 2);
  CHECK(found.positions[0].keyframe == KeyframeRow{1, 4});
  CHECK(found.positions[0].position == result.positions[0].position);
  CHECK(found.positions[0].residual == Eigen::Vector3d(1, 2, 3));
  CHECK(found.positions[0].used);
  CHECK(found.positions[1].reason == "off");
  CHECK_FALSE(found.positions[1].sigma_xy_m);
  REQUIRE(found.georeference);
  CHECK(found.georeference->origin == result.georeference->origin);
  CHECK(found.georeference->is_horizontal);
  CHECK_FALSE(found.georeference->heading_sigma_rad);
  CHECK(store.check().empty());
}

TEST_CASE("the check names positions that are none") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  const auto say = [&writer](StatementKind kind, std::vector<StoredPosition> positions) {
    (void)writer.commit("say", [&](ProjectState& state) {
      state.statements.clear();
      StoredStatement& said = state.statements.emplace_back();
      said.kind = kind;
      said.match.session = 1;
      said.positions = std::move(positions);
      return std::optional<std::string>("said");
    });
  };
  const auto last_fault = [&store] {
    const auto faults = store.check();
    return faults.empty() ? std::string() : faults.back();
  };
  say(StatementKind::kPosition, {{9, {1, 2, 3}, {0, 0, 0}, 1.0, 1.0}});
  CHECK_THAT(last_fault(), Contains("is about a keyframe that is not there"));
  say(StatementKind::kPosition, {{1, {1, 2, 3}, {0, 0, 0}, 1.0, 0.0}});
  CHECK_THAT(last_fault(), Contains("has a position that is none"));
  say(StatementKind::kPosition, {});
  CHECK_THAT(last_fault(), Contains("has no position"));
  say(StatementKind::kApart, {{1, {1, 2, 3}, {0, 0, 0}, 1.0, 1.0}});
  CHECK_THAT(last_fault(), Contains("is none of positions and has some"));
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

TEST_CASE("evidence about placements is found for exactly the same question") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  const PlacementKey key{1, 2, 0xFEDCBA9876543210ULL};
  CHECK_FALSE(writer.placements().find(key));
  {
    Transaction transaction(writer.database());
    writer.placements().keep(key, {12, 3, "the surroundings repeat"});
    writer.placements().keep(key, {0, 0, "another"});  // the first one stays
    transaction.commit();
  }
  const auto found = writer.placements().find(key);
  REQUIRE(found);
  CHECK(found->supporting == 12);
  CHECK(found->contradicting == 3);
  CHECK(found->aliasing == "the surroundings repeat");
  CHECK_FALSE(writer.placements().find({1, 2, key.fingerprint + 1}));
  CHECK_FALSE(writer.placements().find({2, 1, key.fingerprint}));
  CHECK(store.check().empty());
  // What is damaged is checked again.
  writer.database().run("UPDATE placement_outcomes SET contradicting = 0");
  CHECK_FALSE(writer.placements().find(key));
  CHECK(store.check() == std::vector<std::string>{"1 outcomes of placements are damaged"});
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
       {"UPDATE result_sessions SET reason = ''", "is apart without a reason"},
       {"UPDATE result_sessions SET poses = zeroblob(length(poses))", "is damaged"},
       {"UPDATE result_sessions SET sequences = zeroblob(length(sequences))", "out of order"},
       {"UPDATE result_loops SET query_sequence = 3 WHERE number = 1", "a keyframe that is not in"},
       {"UPDATE result_loops SET reason = ''", "without a reason"},
       {"DELETE FROM keyframes WHERE sequence = 4; "
        "UPDATE sessions SET keyframes = keyframes - 1 WHERE id = 1",
        "a keyframe that is not stored"}}));
  // As a result of before checksums, which nothing else would find.
  Database(database_of(store.folder.path()), Access::kWrite)
      .run("UPDATE results SET crc32 = NULL; " + change);
  std::string all;
  for (const std::string& text : store.check()) all += text + "\n";
  INFO(change);
  CHECK_THAT(all, Contains(fault));
}

TEST_CASE("a session of the map may say what is wrong with its odometry") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)writer.commit("merge", [&writer](ProjectState& state) {
      MapResult result = small_result();
      result.sessions[0].reason = "its odometry steps by 40.0 m";
      state.epoch.result = writer.keep(result);
      return std::optional<std::string>("merged");
    });
  }
  CHECK(store.check().empty());
}

TEST_CASE("whatever of a result has changed on the disk, it is not used") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)keep_result(writer);
  }
  REQUIRE(store.check().empty());
  const std::string change =
      GENERATE(as<std::string>(), "results SET parameters = '{ }'",
               "result_sessions SET anchor = (SELECT pose FROM result_loops)",
               "result_sessions SET sequences = x'0000000000000001000000020000000300000005'",
               "result_loops SET pose = (SELECT anchor FROM result_sessions)",
               "result_loops SET confidence = confidence + 0.001",
               "result_loops SET accepted = 1 - accepted WHERE number = 1",
               "result_loops SET match_sequence = match_sequence + 1 WHERE number = 0");
  INFO(change);
  Database(database_of(store.folder.path()), Access::kWrite).run("UPDATE " + change);
  const std::vector<std::string> faults = store.check();
  REQUIRE(faults.size() == 1);
  CHECK_THAT(faults[0], Contains("is damaged"));
  StoreReader reader(store.folder.path());
  CHECK_THROWS_WITH(reader.project().result(1), Contains("is damaged"));
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

  // What is damaged is replaced, what is sound stays.
  writer.database().run("UPDATE keyframes SET bytes = x'0102' WHERE sequence = 3");
  CHECK_FALSE(StoreReader(folder.path()).check().empty());
  const auto repaired = import(stream, true);
  CHECK(repaired.at(kAlpha.id).replaced == 1);
  CHECK(repaired.at(kAlpha.id).repeated == 4);
  CHECK(repaired.at(kAlpha.id).differing == 0);
  CHECK(reader.check().empty());
  wire_test::check_whole(reader.read(reader.sessions()[0]), kAlpha, 5);
}

TEST_CASE("a base's epoch is replaced by its next one, and no result is left behind") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  (void)change_nothing(writer, "first");
  REQUIRE(keep_result(writer)->number == 2);
  REQUIRE(change_nothing(writer, "base --merge")->number == 3);
  const auto replace = [&](const std::string& outcome) {
    return writer.replace(3, [&](ProjectState& state) {
      state.epoch.result = writer.keep(small_result());
      return std::optional(outcome);
    });
  };
  for (const char* outcome : {"merged 1", "merged 2", "merged 3"}) {
    const auto epoch = replace(outcome);
    REQUIRE(epoch);
    CHECK(epoch->number == 3);
    CHECK(epoch->parent == 2);
    CHECK(epoch->command == "base --merge");
  }
  // That of the second epoch, and the latest.
  CHECK(writer.database().number("SELECT count(*) FROM results") == 2);
  CHECK(writer.database().number("SELECT count(DISTINCT result) FROM result_loops") == 2);
  CHECK(store.current().epoch.outcome == "merged 3");
  CHECK(store.current().sessions == std::vector<std::int64_t>{1, 2});
  CHECK(store.check().empty());

  // Only the latest epoch may be, and a change that throws leaves it as it was.
  CHECK_THROWS_WITH(
      writer.replace(2, [](ProjectState&) { return std::optional(std::string("x")); }),
      Contains("epoch 2 is not the latest"));
  CHECK_THROWS_AS(writer.replace(3,
                                 [](ProjectState&) -> std::optional<std::string> {
                                   throw std::runtime_error("no memory");
                                 }),
                  std::runtime_error);
  CHECK_FALSE(writer.replace(3, [](ProjectState&) { return std::optional<std::string>(); }));
  CHECK(store.current().epoch.outcome == "merged 3");
  CHECK(store.check().empty());
}

TEST_CASE("a process that holds the lock may write in several places") {
  const TemporaryDirectory folder;
  const KeyframeStore base(folder.path());
  ProjectWriter beside(folder.path(), base.lock());
  CHECK(change_nothing(beside, "base --merge")->number == 1);
  CHECK_THROWS_WITH(ProjectWriter(folder.path(), "a test"),
                    Contains("a base writes to this store"));
}

TEST_CASE("a session that is removed for good leaves nothing behind but its number") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  (void)change_nothing(writer, "first");
  (void)writer.commit("say", [](ProjectState& state) {
    state.sessions = {1};
    state.statements.push_back({0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)});
    state.statements.push_back({0, StatementKind::kForbidden, {1, 0}, {1, 4}, std::nullopt});
    return std::optional<std::string>("said");
  });
  (void)writer.commit("take in", [&](ProjectState& state) {
    state.sessions = {1, 2};
    state.epoch.result = writer.keep(small_result());
    return std::optional<std::string>("merged");
  });
  {
    Transaction transaction(writer.database());
    writer.outcomes().keep({{1, 4}, {2, 0}, pose_of(3), 1}, small_result().loops[0]);
    writer.outcomes().keep({{1, 4}, {1, 0}, pose_of(3), 1}, small_result().loops[0]);
    writer.placements().keep({1, 2, 1}, {12, 3, "fits"});
    transaction.commit();
  }
  const Epoch epoch = writer.purge("remove --purge beta", "removed for good beta", {2});
  CHECK(epoch.number == 4);
  CHECK(epoch.parent == 3);
  CHECK(epoch.result == 0);
  CHECK(store.check().empty());
  writer.give_back_space();
  CHECK(store.check().empty());
  StoreReader reader(store.folder.path());
  REQUIRE(reader.sessions().size() == 1);
  CHECK(reader.sessions()[0].info.name == "alpha");
  ProjectReader project = reader.project();
  CHECK(project.current().sessions == std::vector<std::int64_t>{1});
  // The epoch that does not show it is as it was, but for what was said of it.
  REQUIRE(project.at(2).statements.size() == 1);
  CHECK(project.at(2).statements[0].kind == StatementKind::kForbidden);
  for (const std::int64_t gone : {1, 3}) {
    CHECK(project.epochs()[static_cast<std::size_t>(gone) - 1].purged_by == 4);
    CHECK_THROWS_WITH(project.at(gone), Contains("epoch 4 removed a session of it for good"));
  }
  const std::vector<std::pair<const char*, int>> left = {
      {"keyframes", 5}, {"loop_outcomes", 1},   {"placement_outcomes", 0},
      {"results", 0},   {"result_sessions", 0}, {"statements", 1},
      {"health", 0}};
  for (const auto& [table, rows] : left) {
    INFO(table);
    CHECK(writer.database().number(std::string("SELECT count(*) FROM ") + table) == rows);
  }
  CHECK(writer.database().number("PRAGMA freelist_count") == 0);
}

TEST_CASE("a map without the session that is removed for good stays") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  (void)writer.commit("merge", [&](ProjectState& state) {
    MapResult result = small_result();
    result.sessions.pop_back();
    result.loops.pop_back();
    state.sessions = {1};
    state.epoch.result = writer.keep(result);
    return std::optional<std::string>("merged");
  });
  CHECK(writer.purge("remove --purge beta", "removed for good beta", {2}).result == 1);
  StoreReader reader(store.folder.path());
  CHECK(reader.project().at(1).epoch.result == 1);
  CHECK(store.check().empty());
}

TEST_CASE("what arrives after a session was removed for good is no session that epochs know") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)writer.purge("remove --purge beta", "removed for good beta", {2});
  }
  {
    Base base(store.folder.path());
    base.feed(SessionId{3, 33}, 0);
    base.feed(kBeta.id, 1);
    base.advance();
  }
  ProjectWriter writer(store.folder.path(), "a test");
  CHECK(writer.current().sessions == std::vector<std::int64_t>{1, 3});
  CHECK(StoreReader(store.folder.path()).sessions().size() == 3);
  CHECK(store.check().empty());
}

TEST_CASE("whichever write of a removal for good fails, the session is whole or gone") {
  const FaultyDisk disk;
  for (int writes = 0;; ++writes) {
    FaultyDisk::heal();
    const Received store;
    ProjectWriter writer(store.folder.path(), "a test");
    (void)keep_result(writer);
    FaultyDisk::writes_left = writes;
    FaultyDisk::write_error = SQLITE_FULL;
    bool failed = false;
    try {
      (void)writer.purge("remove --purge beta", "removed for good beta", {2});
      writer.give_back_space();
    } catch (const StoreError&) {
      failed = true;
    }
    const bool was_reached = FaultyDisk::failures > 0;
    FaultyDisk::heal();
    REQUIRE(store.check().empty());
    const bool is_gone = store.current().epoch.number == 2;
    REQUIRE(StoreReader(store.folder.path()).sessions().size() == (is_gone ? 1 : 2));
    REQUIRE((is_gone || failed));
    if (!failed && !was_reached) break;
    REQUIRE(writes < 200);
  }
}

TEST_CASE("the check finds a purged epoch that shows something") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)change_nothing(writer, "first");
    (void)writer.purge("remove --purge beta", "removed for good beta", {2});
  }
  const auto [change, fault] = GENERATE(table<std::string, std::string>(
      {{"INSERT INTO epoch_sessions (epoch, session) VALUES (1, 1)", "still shows something"},
       {"UPDATE epochs SET purged_by = 1", "was purged by an earlier one"}}));
  Database(database_of(store.folder.path()), Access::kWrite).run(change);
  std::string all;
  for (const std::string& text : store.check()) all += text + "\n";
  CHECK_THAT(all, Contains(fault));
}
