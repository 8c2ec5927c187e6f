// Tests of stored projects: epochs, statements, results, outcomes of loops and placements, locks.
#include "tests/ports/store/project.hpp"

#include "tests/ports/store/faulty_disk.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

TEST_CASE("what a base has received is in the next epoch, and what it receives later in a later") {
  const Received store;
  CHECK(store.current().sessions.empty());
  {
    ProjectWriter writer(store.folder.path(), "a test");
    CHECK(writer.current().sessions == std::vector<std::int64_t>{1, 2});
    const auto epoch = commit(writer, "first");
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
  (void)commit(writer, "second");
  CHECK(store.current().sessions == std::vector<std::int64_t>{1, 2, 3});
  CHECK(store.current().epoch.parent == 1);
  CHECK(store.check().empty());
}

TEST_CASE("a session that was taken out stays out, and earlier epochs show it") {
  Project project;
  (void)commit(project.writer, "first");
  (void)commit(project.writer, "remove",
               [](ProjectState& state) { std::erase(state.sessions, 1); });
  (void)commit(project.writer, "third");
  CHECK(project.current().sessions == std::vector<std::int64_t>{2});
  ProjectReader& reader = project.writer.reader();
  CHECK(reader.at(1).sessions == std::vector<std::int64_t>{1, 2});
  CHECK(reader.epochs().size() == 3);
  CHECK_THROWS_WITH(reader.at(4), Contains("has no epoch 4"));
}

TEST_CASE("statements come back as they were made, to the bit") {
  const std::vector<StoredStatement> said = {
      {0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)},
      {0, StatementKind::kLink, {1, 1}, {2, 1}, std::nullopt},
      {0, StatementKind::kForbidden, {1, 0}, {1, 4}, std::nullopt},
      {0, StatementKind::kApart, {2, 0}, {}, std::nullopt},
      {0, StatementKind::kReference, {1, 0}, {}, std::nullopt},
      {0,
       StatementKind::kPosition,
       {1, 0},
       {},
       std::nullopt,
       {{1, {691234.1, 5335678.0 / 3.0, -0.0}, {0.1, 0.2, 0.3}, 0.7, 1.0 / 3.0},
        {4, {0.0, 0.0, 512.5}, Eigen::Vector3d::Zero(), std::nullopt, 0.25}}}};
  Project project;
  for (const StoredStatement& one : said) {
    (void)commit(project.writer, "say",
                 [&](ProjectState& state) { state.statements.push_back(one); });
  }
  CHECK(text_of(project.current().statements) == text_of(said));
  CHECK(project.writer.reader().at(2).statements.size() == 2);
}

TEST_CASE("the result of a merge comes back to the bit, and later epochs show it") {
  Project project;
  REQUIRE(commit(project.writer, small_result())->result == 1);
  (void)commit(project.writer, "second");
  CHECK(project.current().epoch.result == 1);
  CHECK(text_of(project.writer.reader().result(1)) == text_of(small_result()));
}

TEST_CASE("a change that throws, or changes nothing, leaves no epoch") {
  Project project;
  const auto fail = [&](ProjectState& state) {
    state.epoch.result = project.writer.keep(small_result());
    throw StoreError("on purpose");
  };
  CHECK_THROWS_WITH(commit(project.writer, "bad", fail), Contains("on purpose"));
  CHECK_FALSE(
      project.writer.commit("none", [](ProjectState&) { return std::optional<std::string>(); }));
  CHECK(project.current().epoch.number == 0);
  CHECK(project.writer.database().number("SELECT count(*) FROM results") == 0);
}

TEST_CASE("whichever write of a change fails, the epoch before is whole") {
  const FaultyDisk disk;
  Project project;
  std::int64_t epochs = 0;
  for (int writes = 0;; ++writes) {
    const Attempt attempt(writes, [&] { (void)commit(project.writer, small_result()); });
    epochs += attempt.failed ? 0 : 1;
    REQUIRE(project.current().epoch.number == epochs);
    REQUIRE(project.check().empty());
    REQUIRE(writes < 200);
    if (attempt.failed || attempt.was_hit) continue;
    CHECK(writes > 3);
    break;
  }
}

TEST_CASE("one process writes to a store, in several places, and others are told who it is") {
  const Received store;
  const std::filesystem::path folder = store.folder.path();
  {
    const ProjectWriter writer(folder, "`unimapper map merge`");
    CHECK_THROWS_WITH(KeyframeStore(folder),
                      Contains("`unimapper map merge` writes to this store (process "));
    CHECK(StoreReader(folder).sessions().size() == 2);
  }
  const KeyframeStore base(folder);
  ProjectWriter beside(folder, base.lock());
  CHECK(commit(beside, "base --merge")->number == 1);
  const auto who = Contains("a base writes to this store (process ");
  const auto where = Contains(folder.string());
  CHECK_THROWS_WITH(ProjectWriter(folder, "a test"), who && where);
  CHECK_THROWS_WITH(KeyframeStore(folder), who && where);
  const TemporaryDirectory empty;
  CHECK_THROWS_WITH(ProjectWriter(empty.path(), "a test"), Contains("is no store"));
}

TEST_CASE("outcomes of loops are found for exactly the same question") {
  const Received store;
  ProjectWriter writer(store.folder.path(), "a test");
  const LoopKey key{{1, 4}, {2, 0}, pose_of(3), 0xFEDCBA9876543210ULL};
  const LoopResult outcome = small_result().loops[0];
  CHECK_FALSE(writer.outcomes().find(key));
  {
    Transaction transaction(writer.database());
    writer.outcomes().keep(key, outcome);
    writer.outcomes().keep(key, small_result().loops[1]);  // the first one stays
    transaction.commit();
  }
  const auto found = writer.outcomes().find(key);
  REQUIRE(found);
  const auto text = [](const LoopResult& l) {
    return Words()(l.T_match_query, l.information, l.overlap, l.accepted, l.reason).text();
  };
  CHECK(text(*found) == text(outcome));
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

TEST_CASE("a base's epoch is replaced by its next one, and no result is left behind") {
  Project project;
  ProjectWriter& writer = project.writer;
  (void)commit(writer, "first");
  REQUIRE(commit(writer, small_result())->number == 2);
  REQUIRE(commit(writer, "base --merge")->number == 3);
  for (const std::string outcome : {"merged 1", "merged 2", "merged 3"}) {
    const auto epoch = writer.replace(3, [&](ProjectState& state) {
      state.epoch.result = writer.keep(small_result());
      return std::optional(outcome);
    });
    REQUIRE(epoch);
    CHECK(epoch->number == 3);
    CHECK(epoch->parent == 2);
    CHECK(epoch->command == "base --merge");
  }
  // That of the second epoch, and the latest.
  CHECK(writer.database().number("SELECT count(*) FROM results") == 2);
  CHECK(writer.database().number("SELECT count(DISTINCT result) FROM result_loops") == 2);
  CHECK(project.current().sessions == std::vector<std::int64_t>{1, 2});

  // Only the latest epoch may be, and a change that throws leaves it as it was.
  const auto nothing = [](ProjectState&) { return std::optional<std::string>(); };
  const auto fail = [](ProjectState&) -> std::optional<std::string> {
    throw std::runtime_error("no memory");
  };
  CHECK_THROWS_WITH(writer.replace(2, nothing), Contains("epoch 2 is not the latest"));
  CHECK_THROWS_AS(writer.replace(3, fail), std::runtime_error);
  CHECK_FALSE(writer.replace(3, nothing));
  CHECK(project.current().epoch.outcome == "merged 3");
}
