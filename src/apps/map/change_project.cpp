// Changes of a stored project but for merges: sessions in and out, what people say, undo.
#include <algorithm>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <utility>

#include "ports/store/project_writer.hpp"
#include "ports/store/transaction.hpp"
#include "src/apps/map/loop_statement.hpp"
#include "src/apps/map/map_options.hpp"
#include "src/apps/map/project_merge.hpp"
#include "src/apps/map/statements.hpp"
#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/merge/run_store.hpp"
#include "src/apps/suggestion.hpp"

namespace unimapper::apps {
namespace {

namespace fs = std::filesystem;
using store::ProjectState;
using store::ProjectWriter;
using store::StatementKind;
using store::StoredStatement;

std::vector<store::SessionListing> listings(const fs::path& store) {
  return store::StoreReader(store).sessions();
}

void require_in_project(const ProjectState& state, std::int64_t row, const std::string& name) {
  const auto& sessions = state.sessions;
  if (std::find(sessions.begin(), sessions.end(), row) != sessions.end()) return;
  throw std::runtime_error("session " + name +
                           " is in the store, but not in the project; "
                           "`unimapper map add` takes its run in again");
}

/// A statement that says the same.
bool says(const StoredStatement& a, const StoredStatement& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == StatementKind::kReference) return true;
  if (a.kind == StatementKind::kApart) return a.match.session == b.match.session;
  if (a.kind == StatementKind::kPosition) {
    const bool are_files = a.positions.size() > 1 && b.positions.size() > 1;
    return a.match.session == b.match.session &&
           (are_files || (a.positions.size() == b.positions.size() &&
                          a.positions.front().sequence == b.positions.front().sequence));
  }
  return std::minmax(a.match, a.query) == std::minmax(b.match, b.query);
}

/// A statement about two keyframes that are stored.
StoredStatement statement_of(const ProjectOptions& options, const KeyframesOption& keyframes,
                             StatementKind kind) {
  StoredStatement statement;
  statement.kind = kind;
  store::StoreReader reader(options.store);
  const std::vector<store::SessionListing> sessions = reader.sessions();
  const SessionNames names(sessions);
  statement.query = names.keyframe(keyframes.query);
  statement.match = names.keyframe(keyframes.match);
  if (statement.query == statement.match) {
    throw std::runtime_error("these are one keyframe: " + keyframes.query);
  }
  for (const store::KeyframeRow& keyframe : {statement.query, statement.match}) {
    bool is_stored = false;
    for (const store::SessionListing& session : sessions) {
      if (session.row != keyframe.session) continue;
      reader.for_each_keyframe(session, [&](const store::StoredKeyframe& stored) {
        is_stored = is_stored || stored.sequence == keyframe.sequence;
      });
    }
    if (!is_stored) {
      throw std::runtime_error("there is no keyframe " + names.text(keyframe));
    }
  }
  return statement;
}

Pose pose_of(const std::vector<double>& numbers) {
  const Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (!(std::abs(q.norm() - 1.0) < 0.01)) {
    throw std::runtime_error("--pose: qx qy qz qw are no unit quaternion");
  }
  Pose pose(q, {numbers[0], numbers[1], numbers[2]});
  if (!pose.is_finite()) throw std::runtime_error("--pose: a number is not finite");
  return pose;
}

/// Whether the map of the project considered a loop of these keyframes.
bool has_considered(const fs::path& store, const StoredStatement& loop) {
  store::StoreReader reader(store);
  store::ProjectReader project = reader.project();
  const std::int64_t id = project.current().epoch.result;
  if (id == 0) return false;
  const std::vector<store::LoopResult> loops = project.result(id).loops;
  return std::any_of(loops.begin(), loops.end(), [&](const store::LoopResult& other) {
    return std::minmax(other.match, other.query) == std::minmax(loop.match, loop.query);
  });
}

}  // namespace

void say_epoch(const std::optional<store::Epoch>& epoch) {
  if (epoch) {
    std::cout << "epoch " << epoch->number << ": " << epoch->outcome << '\n';
  } else {
    std::cout << "nothing changed\n";
  }
}

std::string take_in(ProjectState& state, const store::ImportedSession& session) {
  if (session.differing > 0) {
    throw std::runtime_error(
        "session " + session.name + " is in the store with other content (" +
        std::to_string(session.differing) +
        " keyframes differ): the same recording processed in another way is no new session");
  }
  auto& sessions = state.sessions;
  const bool is_in = std::binary_search(sessions.begin(), sessions.end(), session.row);
  if (!is_in)
    sessions.insert(std::upper_bound(sessions.begin(), sessions.end(), session.row), session.row);
  if (is_in && session.keyframes + session.replaced == 0) {
    std::cout << "session " << session.name << " is there already\n";
    return {};
  }
  std::string text = session.name + " (" + std::to_string(session.keyframes) + " new keyframes";
  if (session.replaced > 0)
    text += ", " + std::to_string(session.replaced) + " damaged ones replaced";
  return text + ")";
}

void state_it(const ProjectOptions& options, const std::string& holder, const std::string& command,
              const std::string& outcome, const std::vector<StoredStatement>& statements) {
  ProjectWriter writer(options.store, holder);
  const SessionNames names(listings(options.store));
  say_epoch(writer.commit(command, [&](ProjectState& state) {
    for (const StoredStatement& statement : statements) {
      require_in_project(state, statement.match.session, names.name(statement.match.session));
      std::erase_if(state.statements,
                    [&](const StoredStatement& other) { return says(other, statement); });
      state.statements.push_back(statement);
    }
    return std::optional(outcome);
  }));
  std::cout << "it takes effect with the next merge\n";
}

void create_project(const ProjectOptions& options) {
  if (store::is_store(options.store)) {
    throw std::runtime_error(options.store.string() + ": is a store already");
  }
  const ProjectWriter writer(options.store, "`unimapper map create`", true);
  std::cout << options.store.string() << " made\n";
}

void add_runs(const ProjectOptions& options, const std::vector<fs::path>& runs) {
  ProjectWriter writer(options.store, "`unimapper map add`");
  say_epoch(writer.commit("add " + joined({runs.begin(), runs.end()}),
                          [&](ProjectState& state) -> std::optional<std::string> {
                            std::vector<std::string> added;
                            for (const fs::path& run : runs) {
                              for (const auto& session :
                                   import_run(writer.database(), run).sessions) {
                                const std::string text = take_in(state, session);
                                if (!text.empty()) added.push_back(text);
                              }
                            }
                            if (added.empty()) return std::nullopt;
                            return "added " + joined(added);
                          }));
}

void remove_sessions(const ProjectOptions& options, const std::vector<std::string>& removed) {
  ProjectWriter writer(options.store, "`unimapper map remove`");
  const SessionNames names(listings(options.store));
  say_epoch(writer.commit("remove " + joined(removed), [&](ProjectState& state) {
    for (const std::string& name : removed) {
      const std::int64_t row = names.row(name);
      require_in_project(state, row, name);
      std::erase(state.sessions, row);
    }
    // The map still has them: there is none until the next merge.
    state.epoch.result = 0;
    return std::optional("removed " + joined(removed));
  }));
}

void purge_sessions(const ProjectOptions& options, const std::vector<std::string>& removed) {
  ProjectWriter writer(options.store, "`unimapper map remove --purge`");
  const SessionNames names(listings(options.store));
  std::vector<std::int64_t> rows;
  rows.reserve(removed.size());
  for (const std::string& name : removed) rows.push_back(names.row(name));
  say_epoch(writer.purge("remove --purge " + joined(removed), "removed for good " + joined(removed),
                         rows));
  try {
    writer.give_back_space();
  } catch (const store::StoreError& error) {
    std::cerr << "unimapper: warning: the room is left to later keyframes, not given back to the "
                 "disk: "
              << error.what() << '\n';
  }
}

void link_keyframes(const ProjectOptions& options, const KeyframesOption& keyframes) {
  StoredStatement statement = statement_of(options, keyframes, StatementKind::kLink);
  if (!keyframes.pose.empty()) statement.T_match_query = pose_of(keyframes.pose);
  const std::string text = keyframes.query + " " + keyframes.match;
  if (!keyframes.is_forced) {
    const std::string objection = objection_to(options.store, statement);
    if (!objection.empty()) {
      throw std::runtime_error("link " + text + ": " + objection +
                               ". Nothing is stored; --force stores it all the same");
    }
  }
  state_it(options, "`unimapper map link`", "link " + text,
           "linked " + text + (statement.T_match_query ? " at a pose" : ""), {statement});
}

void forbid_loop(const ProjectOptions& options, const KeyframesOption& keyframes) {
  const std::string text = keyframes.query + " " + keyframes.match;
  const StoredStatement statement = statement_of(options, keyframes, StatementKind::kForbidden);
  state_it(options, "`unimapper map forbid`", "forbid " + text, "forbade the loop " + text,
           {statement});
  if (!has_considered(options.store, statement)) {
    std::cout << "the map has no such loop so far; should a merge find it, it is refused\n";
  }
}

void pin_reference(const ProjectOptions& options, const std::string& session) {
  StoredStatement statement;
  statement.kind = StatementKind::kReference;
  statement.match.session = SessionNames(listings(options.store)).row(session);
  state_it(options, "`unimapper map pin`", "pin " + session, "reference session " + session,
           {statement});
}

void keep_apart(const ProjectOptions& options, const std::vector<std::string>& sessions) {
  const SessionNames names(listings(options.store));
  std::vector<StoredStatement> statements;
  for (const std::string& session : sessions) {
    StoredStatement& statement = statements.emplace_back();
    statement.kind = StatementKind::kApart;
    statement.match.session = names.row(session);
  }
  state_it(options, "`unimapper map apart`", "apart " + joined(sessions),
           "kept apart: " + joined(sessions), statements);
}

void withdraw_statements(const ProjectOptions& options, const std::vector<std::int64_t>& numbers) {
  ProjectWriter writer(options.store, "`unimapper map withdraw`");
  std::vector<std::string> words;
  words.reserve(numbers.size());
  for (const std::int64_t number : numbers) words.push_back(std::to_string(number));
  say_epoch(writer.commit("withdraw " + joined(words), [&](ProjectState& state) {
    for (const std::int64_t number : numbers) {
      const auto is_it = [number](const StoredStatement& s) { return s.id == number; };
      if (std::erase_if(state.statements, is_it) == 0) {
        throw std::runtime_error("there is no statement " + std::to_string(number) +
                                 "; `unimapper map show` numbers them");
      }
    }
    return std::optional("withdrew statement " + joined(words));
  }));
}

void undo_epoch(const ProjectOptions& options) {
  ProjectWriter writer(options.store, "`unimapper map undo`");
  say_epoch(go_back(writer, options.epoch));
  const ProjectState state = writer.current();
  if (state.statements.empty()) return;
  std::cout << "in effect there: " << state.statements.size()
            << (state.statements.size() == 1 ? " statement" : " statements")
            << " (`unimapper map show` lists them, `withdraw` takes them back)\n";
}

}  // namespace unimapper::apps
