// Tests of a store that is kept as a file: later versions still read it.
#include "tests/folders.hpp"
#include "tests/ports/store/project.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

namespace {

namespace fs = std::filesystem;

const SessionInfo kGamma{{3, 33}, "gamma", "vlp-16"};

Pose at(double x) { return {Eigen::Matrix3d::Identity(), {x, 0.5, 0.25}}; }

/// Two sessions, a loop, a pair and a known position.
MapResult kept_result() {
  MapResult result;
  result.parameters = R"({"threads": 1})";
  result.sessions.push_back({1, "central", "", at(0), {0, 1, 2}, {at(1), at(2), at(3)}});
  result.sessions.push_back({2, "unconnected", "no loops found", {}, {0, 1}, {at(4), at(5)}});
  LoopResult loop;
  loop.query = {1, 2};
  loop.match = {1, 0};
  loop.T_match_query = at(6);
  loop.overlap = 0.75;
  loop.accepted = true;
  loop.reason = "descriptor";
  result.loops.push_back(loop);
  result.pairs.push_back({1, 2, "provisional", "ambiguous: 2 loops contradict 3", 9, 3, 2, at(8)});
  result.positions.push_back({{1, 1}, {7e5, 5e6, 3}, {0, 0, 1}, 0.5, 2.0, true, "", {1, 2, 3}});
  result.georeference = GeoreferenceResult{{7e5, 5e6, 0.0}, true, 0.25};
  return result;
}

std::vector<StoredStatement> kept_statements() {
  return {
      {0, StatementKind::kLink, {1, 0}, {2, 1}, at(7)},
      {0, StatementKind::kForbidden, {1, 0}, {1, 2}, std::nullopt},
      {0, StatementKind::kReference, {1, 0}, {}, std::nullopt},
      {0, StatementKind::kApart, {2, 0}, {}, std::nullopt},
      {0,
       StatementKind::kPosition,
       {1, 0},
       {},
       std::nullopt,
       {{0, {7e5, 5e6, 3}, {0, 0, 1}, 0.5, 2.0}, {2, {0, 0, 3}, {0, 0, 0}, std::nullopt, 0.1}}}};
}

/// Sessions, statements of every kind, a result, an undo, a summary and an outcome.
void write_store(const fs::path& folder) {
  {
    Base base(folder);
    base.feed(wire_test::session_stream(kAlpha, 3));
    base.feed(wire_test::session_stream(kBeta, 2));
    base.feed(most_of(kBeta.id, 2));
    base.advance();
  }
  ProjectWriter writer(folder, "a test");
  (void)commit(writer, kept_result());
  (void)commit(writer, "say", [](ProjectState& state) { state.statements = kept_statements(); });
  (void)commit(writer, "remove", [](ProjectState& state) {
    std::erase(state.sessions, 2);
    state.epoch.result = 0;
  });
  (void)commit(writer, "undo", [](ProjectState& state) {
    state.sessions = {1, 2};
    state.epoch.result = 1;
    state.epoch.parent = 1;
  });
  // A third session comes and goes for good.
  (void)import_messages(writer.database(), wire_test::session_stream(kGamma, 1));
  (void)commit(writer, "add");
  (void)writer.purge("remove --purge gamma", "removed for good gamma", {3});
  Transaction transaction(writer.database());
  writer.outcomes().keep({{1, 2}, {1, 0}, at(6.5), 17}, kept_result().loops[0]);
  writer.placements().keep({2, 1, 17}, {3, 1, "fits 12.5 m away as well"});
  transaction.commit();
  writer.database().run("PRAGMA wal_checkpoint(TRUNCATE)");
}

/// A store with the kept database in it.
struct KeptStore {
  TemporaryDirectory folder;
  KeptStore() {
    fs::copy_file(fs::path(testing::source_folder()) / "tests/ports/store/data/schema_6.sqlite",
                  database_of(folder.path()));
  }
};

}  // namespace

TEST_CASE("a store of schema 6 is read", "[fixture]") {
  const KeptStore kept;
  StoreReader reader(kept.folder.path());
  const auto sessions = reader.sessions();
  REQUIRE(sessions.size() == 2);
  wire_test::check_whole(reader.read(sessions[0]), kAlpha, 3);
  CHECK(sessions[1].keyframes == 2);
  CHECK(sessions[1].summaries == 1);
  CHECK(reader.check().empty());

  ProjectReader project = reader.project();
  REQUIRE(project.epochs().size() == 6);
  const ProjectState state = project.at(4);
  CHECK(state.epoch.command == "undo");
  CHECK(state.epoch.outcome == "undo done");
  CHECK(state.epoch.parent == 1);
  CHECK(state.sessions == std::vector<std::int64_t>{1, 2});
  CHECK(text_of(state.statements) == text_of(kept_statements()));
  CHECK(text_of(project.result(state.epoch.result)) == text_of(kept_result()));
  CHECK(project.at(3).sessions == std::vector<std::int64_t>{1});
  CHECK(project.epochs()[4].purged_by == 6);
  CHECK_THROWS_AS(project.at(5), StoreError);
  CHECK(project.current().sessions == std::vector<std::int64_t>{1, 2});
}

TEST_CASE("a store of schema 6 is written to", "[fixture]") {
  const KeptStore kept;
  {
    ProjectWriter writer(kept.folder.path(), "a test");
    const auto known = writer.outcomes().find({{1, 2}, {1, 0}, at(6.5), 17});
    REQUIRE(known);
    CHECK(known->overlap == 0.75);
    CHECK(writer.placements().find({2, 1, 17}).has_value());
    (void)commit(writer, "nothing");
  }
  Base base(kept.folder.path());
  base.feed(kBeta.id, 2);
  base.advance();
  StoreReader reader(kept.folder.path());
  CHECK(reader.sessions()[1].keyframes == 3);
  CHECK(reader.project().current().epoch.number == 7);
  CHECK(reader.check().empty());
}

// To be run by hand for a new schema: UNIMAPPER_FIXTURE=FILE test_store '[.write_fixture]'
TEST_CASE("the store that is kept is written", "[.write_fixture]") {
  const char* file = std::getenv("UNIMAPPER_FIXTURE");
  REQUIRE(file != nullptr);
  const TemporaryDirectory folder;
  write_store(folder.path());
  fs::create_directories(fs::path(file).parent_path());
  fs::copy_file(database_of(folder.path()), file);
}
