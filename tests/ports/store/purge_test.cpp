// Tests of sessions that are removed from a project for good.
#include "tests/ports/store/faulty_disk.hpp"
#include "tests/ports/store/project.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

namespace {

Epoch remove_beta(ProjectWriter& writer) {
  return writer.purge("remove --purge beta", "removed for good beta", {2});
}

}  // namespace

TEST_CASE("a session that is removed for good leaves nothing behind but its number") {
  Project project;
  ProjectWriter& writer = project.writer;
  (void)commit(writer, "first");
  (void)commit(writer, "say", [](ProjectState& state) {
    state.sessions = {1};
    state.statements = {{0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)},
                        {0, StatementKind::kForbidden, {1, 0}, {1, 4}, std::nullopt}};
  });
  (void)commit(writer, "take in", [&](ProjectState& state) {
    state.sessions = {1, 2};
    state.epoch.result = writer.keep(small_result());
  });
  {
    Transaction transaction(writer.database());
    writer.outcomes().keep({{1, 4}, {2, 0}, pose_of(3), 1}, small_result().loops[0]);
    writer.outcomes().keep({{1, 4}, {1, 0}, pose_of(3), 1}, small_result().loops[0]);
    writer.placements().keep({1, 2, 1}, {12, 3, "fits"});
    transaction.commit();
  }
  const Epoch epoch = remove_beta(writer);
  CHECK(epoch.number == 4);
  CHECK(epoch.parent == 3);
  CHECK(epoch.result == 0);
  CHECK(project.check().empty());
  writer.give_back_space();
  StoreReader reader(project.folder.path());
  REQUIRE(reader.sessions().size() == 1);
  CHECK(reader.sessions()[0].info.name == "alpha");
  ProjectReader epochs = reader.project();
  CHECK(epochs.current().sessions == std::vector<std::int64_t>{1});
  // The epoch that does not show it is as it was, but for what was said of it.
  REQUIRE(epochs.at(2).statements.size() == 1);
  CHECK(epochs.at(2).statements[0].kind == StatementKind::kForbidden);
  for (const std::int64_t gone : {1, 3}) {
    CHECK(epochs.epochs()[static_cast<std::size_t>(gone) - 1].purged_by == 4);
    CHECK_THROWS_WITH(epochs.at(gone), Contains("epoch 4 removed a session of it for good"));
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
  Project project;
  (void)commit(project.writer, "merge", [&](ProjectState& state) {
    MapResult result = small_result();
    result.sessions.pop_back();
    result.loops.pop_back();
    result.pairs.clear();
    state.sessions = {1};
    state.epoch.result = project.writer.keep(result);
  });
  CHECK(remove_beta(project.writer).result == 1);
  CHECK(project.writer.reader().at(1).epoch.result == 1);
}

TEST_CASE("what arrives after a session was removed for good is no session that epochs know") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)remove_beta(writer);
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
    Project project;
    (void)commit(project.writer, small_result());
    const Attempt attempt(writes, [&] {
      (void)remove_beta(project.writer);
      project.writer.give_back_space();
    });
    REQUIRE(project.check().empty());
    const bool is_gone = project.current().epoch.number == 2;
    REQUIRE(StoreReader(project.folder.path()).sessions().size() == (is_gone ? 1 : 2));
    REQUIRE((is_gone || attempt.failed));
    if (!attempt.failed && !attempt.was_hit) break;
    REQUIRE(writes < 200);
  }
}
