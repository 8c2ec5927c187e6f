// Tests of a store that is kept as a file: later versions still read it.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "ports/store/project_writer.hpp"
#include "ports/store/session_import.hpp"
#include "ports/store/transaction.hpp"
#include "tests/folders.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

namespace {

namespace fs = std::filesystem;

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};
const SessionInfo kGamma{{3, 33}, "gamma", "vlp-16"};

fs::path fixture() {
  return fs::path(testing::source_folder()) / "tests/ports/store/data/schema_6.sqlite";
}

Pose at(double x) { return {Eigen::Matrix3d::Identity(), {x, 0.5, 0.25}}; }

MapResult two_sessions() {
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
  return result;
}

/// Known positions beyond that.
MapResult placed(MapResult result) {
  result.positions.push_back({{1, 1}, {7e5, 5e6, 3}, {0, 0, 1}, 0.5, 2.0, true, "", {1, 2, 3}});
  result.georeference = GeoreferenceResult{{7e5, 5e6, 0.0}, true, 0.25};
  return result;
}

/// Sessions, statements of every kind, a result, an undo, a summary and an outcome.
void write_store(const fs::path& folder) {
  {
    Base base(folder);
    base.feed(wire_test::session_stream(kAlpha, 3));
    base.feed(wire_test::session_stream(kBeta, 2));
    auto pieces = wire_test::pieces(wire_test::keyframe_of(kBeta.id, 2));
    pieces.pop_back();
    base.feed(pieces);
    base.advance();
  }
  ProjectWriter writer(folder, "a test");
  const auto change = [&writer](const std::string& command, const auto& how) {
    (void)writer.commit(command, [&](ProjectState& state) {
      how(state);
      return std::optional<std::string>(command + " done");
    });
  };
  change("merge",
         [&](ProjectState& state) { state.epoch.result = writer.keep(placed(two_sessions())); });
  change("say", [](ProjectState& state) {
    state.statements.push_back({0, StatementKind::kLink, {1, 0}, {2, 1}, at(7)});
    state.statements.push_back({0, StatementKind::kForbidden, {1, 0}, {1, 2}, std::nullopt});
    state.statements.push_back({0, StatementKind::kReference, {1, 0}, {}, std::nullopt});
    state.statements.push_back({0, StatementKind::kApart, {2, 0}, {}, std::nullopt});
    StoredStatement position{0, StatementKind::kPosition, {1, 0}, {}, std::nullopt};
    position.positions = {{0, {7e5, 5e6, 3}, {0, 0, 1}, 0.5, 2.0},
                          {2, {0, 0, 3}, {0, 0, 0}, std::nullopt, 0.1}};
    state.statements.push_back(position);
  });
  change("remove", [](ProjectState& state) {
    std::erase(state.sessions, 2);
    state.epoch.result = 0;
  });
  change("undo", [](ProjectState& state) {
    state.sessions = {1, 2};
    state.epoch.result = 1;
    state.epoch.parent = 1;
  });
  // A third session comes and goes for good.
  {
    Transaction transaction(writer.database());
    SessionImport import(writer.database());
    wire::Receiver receiver({}, import);
    wire_test::feed(receiver, wire_test::session_stream(kGamma, 1));
    receiver.store_all();
    transaction.commit();
  }
  change("add", [](ProjectState&) {});
  (void)writer.purge("remove --purge gamma", "removed for good gamma", {3});
  Transaction transaction(writer.database());
  writer.outcomes().keep({{1, 2}, {1, 0}, at(6.5), 17}, two_sessions().loops[0]);
  writer.placements().keep({2, 1, 17}, {3, 1, "fits 12.5 m away as well"});
  transaction.commit();
  writer.database().run("PRAGMA wal_checkpoint(TRUNCATE)");
}

/// A store with the kept database in it.
struct KeptStore {
  TemporaryDirectory folder;
  KeptStore() { fs::copy_file(fixture(), database_of(folder.path())); }
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
  REQUIRE(state.statements.size() == 5);
  CHECK(state.statements[0].kind == StatementKind::kLink);
  CHECK(state.statements[0].query == KeyframeRow{2, 1});
  CHECK(state.statements[0].T_match_query->translation == at(7).translation);
  CHECK(state.statements[1].kind == StatementKind::kForbidden);
  CHECK(state.statements[2].kind == StatementKind::kReference);
  CHECK(state.statements[3].kind == StatementKind::kApart);
  CHECK(project.at(3).sessions == std::vector<std::int64_t>{1});
  const MapResult result = project.result(state.epoch.result);
  CHECK(result.parameters == R"({"threads": 1})");
  REQUIRE(result.sessions.size() == 2);
  CHECK(result.sessions[0].T_map_keyframe[2].translation == at(3).translation);
  CHECK(result.sessions[1].reason == "no loops found");
  REQUIRE(result.loops.size() == 1);
  CHECK(result.loops[0].T_match_query.translation == at(6).translation);
  CHECK(result.loops[0].reason == "descriptor");
  REQUIRE(result.pairs.size() == 1);
  CHECK(result.pairs[0].state == "provisional");
  CHECK(result.pairs[0].competing == 2);
  CHECK(result.pairs[0].T_match_query.translation == at(8).translation);
  CHECK(result.positions.size() == 1);
  CHECK(result.georeference.has_value());
}

TEST_CASE("positions in a store of schema 6 are read", "[fixture]") {
  const KeptStore kept;
  StoreReader reader(kept.folder.path());
  ProjectReader project = reader.project();
  const ProjectState state = project.at(4);
  const StoredStatement& said = state.statements[4];
  CHECK(said.kind == StatementKind::kPosition);
  REQUIRE(said.positions.size() == 2);
  CHECK(said.positions[0].position == Eigen::Vector3d(7e5, 5e6, 3));
  CHECK(said.positions[0].point == Eigen::Vector3d(0, 0, 1));
  CHECK(said.positions[0].sigma_xy_m == 0.5);
  CHECK_FALSE(said.positions[1].sigma_xy_m);
  const MapResult result = project.result(state.epoch.result);
  CHECK(result.positions[0].residual == Eigen::Vector3d(1, 2, 3));
  CHECK(result.georeference->origin == Eigen::Vector3d(7e5, 5e6, 0));
  CHECK(result.georeference->heading_sigma_rad == 0.25);
}

TEST_CASE("a purged epoch in a store of schema 6 is read", "[fixture]") {
  const KeptStore kept;
  StoreReader reader(kept.folder.path());
  ProjectReader project = reader.project();
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
    (void)writer.commit("nothing",
                        [](ProjectState&) { return std::optional<std::string>("done"); });
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
