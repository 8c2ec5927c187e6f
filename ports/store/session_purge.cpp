#include "ports/store/session_purge.hpp"

#include <string>

namespace unimapper::store {

namespace {

/// Earlier epochs that show the session keep their number and words alone.
void purge_epochs(Database& database, std::int64_t session, std::int64_t number) {
  Statement(database,
            "UPDATE epochs SET purged_by = ?1 WHERE purged_by IS NULL AND number < ?1 AND "
            "number IN (SELECT epoch FROM epoch_sessions WHERE session = ?2)")
      .bind(number, session)
      .run();
  database.run("UPDATE epochs SET result = NULL WHERE purged_by IS NOT NULL");
  for (const char* table : {"epoch_sessions", "epoch_statements"}) {
    database.run(std::string("DELETE FROM ") + table +
                 " WHERE epoch IN (SELECT number FROM epochs WHERE purged_by IS NOT NULL)");
  }
}

/// In the epochs that stay the session is not, so that what was said of it has no effect there.
void remove_statements(Database& database, std::int64_t session) {
  Statement(database,
            "DELETE FROM epoch_statements WHERE statement IN "
            "(SELECT id FROM statements WHERE match_session = ?1 OR query_session = ?1)")
      .bind(session)
      .run();
  for (const char* column : {"statement_positions WHERE statement", "statements WHERE id"}) {
    database.run(std::string("DELETE FROM ") + column +
                 " NOT IN (SELECT statement FROM epoch_statements)");
  }
}

/// The session's row stays: a session that arrives later must not get its number, which epochs
/// know. It is as of a session that has just begun.
void remove_contents(Database& database, std::int64_t session) {
  for (const char* rows :
       {"loop_outcomes WHERE ?1 IN (query_session, match_session)",
        "placement_outcomes WHERE ?1 IN (query_session, match_session)", "health WHERE session = ?",
        "summaries WHERE session = ?", "keyframes WHERE session = ?",
        "handed_on_keyframes WHERE session = ?", "handed_on_sessions WHERE session = ?"}) {
    Statement(database, std::string("DELETE FROM ") + rows).bind(session).run();
  }
  Statement(database,
            "UPDATE sessions SET ended = 0, announced = 0, dropped = 0, keyframes = 0, bytes = 0 "
            "WHERE id = ?")
      .bind(session)
      .run();
}

}  // namespace

void take_out(std::int64_t session, ProjectState& state) {
  // A result shows sessions of the project only.
  if (std::erase(state.sessions, session) > 0) state.epoch.result = 0;
  std::erase_if(state.statements, [session](const StoredStatement& statement) {
    return statement.match.session == session || statement.query.session == session;
  });
}

void purge_sessions(Database& database, const std::vector<std::int64_t>& sessions,
                    std::int64_t number) {
  for (const std::int64_t session : sessions) {
    purge_epochs(database, session, number);
    remove_statements(database, session);
  }
  for (const std::int64_t session : sessions) remove_contents(database, session);
}

}  // namespace unimapper::store
