// Tests of what the check says of a project that changed on the disk.
#include "tests/ports/store/project.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

TEST_CASE("the check finds what breaks an invariant of the project") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)commit(writer, "say", [](ProjectState& state) {
      state.statements = {{0, StatementKind::kLink, {1, 0}, {2, 2}, pose_of(3)},
                          {0,
                           StatementKind::kPosition,
                           {1, 0},
                           {},
                           std::nullopt,
                           {{1, {1, 2, 3}, {0, 0, 0}, 1.0, 1.0}}}};
    });
    (void)commit(writer, small_result());
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
       {"UPDATE statements SET kind = 'apart' WHERE kind = 'position'",
        "is none of positions and has some"},
       {"UPDATE statement_positions SET sequence = 9", "is about a keyframe that is not there"},
       {"UPDATE statement_positions SET sigma_z = 0.0", "has a position that is none"},
       {"DELETE FROM statement_positions", "has no position"},
       {"UPDATE result_sessions SET state = 'merged'", "not one central session"},
       {"UPDATE result_sessions SET reason = ''", "is apart without a reason"},
       {"UPDATE result_sessions SET poses = zeroblob(length(poses))", "is damaged"},
       {"UPDATE result_sessions SET sequences = zeroblob(length(sequences))", "out of order"},
       {"UPDATE result_loops SET query_sequence = 3 WHERE number = 1", "a keyframe that is not in"},
       {"UPDATE result_loops SET reason = ''", "without a reason"},
       {"DELETE FROM keyframes WHERE sequence = 4; "
        "UPDATE sessions SET keyframes = keyframes - 1 WHERE id = 1",
        "a keyframe that is not stored"}}));
  INFO(change);
  // As a result of before checksums, which nothing else would find.
  CHECK_THAT(store.faults_after("UPDATE results SET crc32 = NULL; " + change), Contains(fault));
}

TEST_CASE("whatever of a result has changed on the disk, it is not used") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)commit(writer, small_result());
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
  const std::string faults = store.faults_after("UPDATE " + change);
  CHECK_THAT(faults, Contains("is damaged"));
  CHECK(std::count(faults.begin(), faults.end(), '\n') == 1);
  StoreReader reader(store.folder.path());
  CHECK_THROWS_WITH(reader.project().result(1), Contains("is damaged"));
}

TEST_CASE("the check finds a purged epoch that shows something") {
  const Received store;
  {
    ProjectWriter writer(store.folder.path(), "a test");
    (void)commit(writer, "first");
    (void)writer.purge("remove --purge beta", "removed for good beta", {2});
  }
  const auto [change, fault] = GENERATE(table<std::string, std::string>(
      {{"INSERT INTO epoch_sessions (epoch, session) VALUES (1, 1)", "still shows something"},
       {"UPDATE epochs SET purged_by = 1", "was purged by an earlier one"}}));
  CHECK_THAT(store.faults_after(change), Contains(fault));
}
