// Tests of recorded sessions that are taken into a store.
#include "tests/ports/store/project.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

TEST_CASE("a recorded session is imported once, whole or not at all") {
  const TemporaryDirectory folder;
  Database database = open_for_writing(folder.path());
  const auto import = [&](bool commits) {
    return import_messages(database, wire_test::session_stream(kAlpha, 5), commits).at(kAlpha.id);
  };
  CHECK(import(false).keyframes == 5);
  CHECK(StoreReader(folder.path()).sessions().empty());
  CHECK(import(true).keyframes == 5);
  const ImportedSession again = import(true);
  CHECK(again.keyframes == 0);
  CHECK(again.repeated == 5);
  StoreReader reader(folder.path());
  REQUIRE(reader.sessions().size() == 1);
  wire_test::check_whole(reader.read(reader.sessions()[0]), kAlpha, 5);
  CHECK(reader.check().empty());

  // What is damaged is replaced, what is sound stays.
  database.run("UPDATE keyframes SET bytes = x'0102' WHERE sequence = 3");
  CHECK_FALSE(reader.check().empty());
  const ImportedSession repaired = import(true);
  CHECK(repaired.replaced == 1);
  CHECK(repaired.repeated == 4);
  CHECK(repaired.differing == 0);
  CHECK(reader.check().empty());
  wire_test::check_whole(reader.read(reader.sessions()[0]), kAlpha, 5);
}

TEST_CASE("a recording that lacks pieces is imported with the summaries of these keyframes") {
  const TemporaryDirectory folder;
  Database database = open_for_writing(folder.path());
  auto recorded = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0));
  for (const auto& other : {most_of(kAlpha.id, 1), most_of(kBeta.id, 0)}) {
    recorded.insert(recorded.end(), other.begin(), other.end());
  }
  const auto sessions = import_messages(database, recorded);
  CHECK(sessions.at(kAlpha.id).keyframes == 1);
  CHECK(sessions.at(kBeta.id).keyframes == 0);
  StoreReader reader(folder.path());
  REQUIRE(reader.sessions().size() == 2);
  CHECK(reader.read(reader.sessions()[0]).summaries.at(0).sequence == 1);
  CHECK(reader.sessions()[1].summaries == 1);
  CHECK(reader.check().empty());

  // The keyframe alone where another recording has it whole.
  const auto whole = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1));
  CHECK(import_messages(database, whole).at(kAlpha.id).keyframes == 1);
  CHECK(reader.sessions()[0].summaries == 0);
  CHECK(reader.sessions()[0].keyframes == 2);
  CHECK(import_messages(database, recorded).at(kAlpha.id).repeated == 1);
  CHECK(reader.sessions()[0].summaries == 0);
  CHECK(reader.check().empty());
}
