#include "src/apps/map/loop_statement.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "ports/store/store_reader.hpp"
#include "src/apps/map/project_merge.hpp"
#include "src/apps/map/stored_sessions.hpp"

namespace unimapper::apps {
namespace {

using store::ProjectState;
using store::StatementKind;
using store::StoredStatement;

const char* text_of(LoopStatement said) {
  switch (said) {
    case LoopStatement::kRight:
      return "is right";
    case LoopStatement::kWrong:
      return "is wrong";
    case LoopStatement::kNotYet:
      break;
  }
  return "is undecided";
}

/// Takes a person's word into the statements, in place of what was said of the same two keyframes.
void say(const StatedLoop& loop, LoopStatement said, ProjectState& state) {
  std::erase_if(state.statements, [&](const StoredStatement& other) {
    const bool is_of_a_loop =
        other.kind == StatementKind::kLink || other.kind == StatementKind::kForbidden;
    return is_of_a_loop &&
           std::minmax(other.match, other.query) == std::minmax(loop.match, loop.query);
  });
  if (said == LoopStatement::kNotYet) return;
  StoredStatement statement;
  statement.kind = said == LoopStatement::kRight ? StatementKind::kLink : StatementKind::kForbidden;
  statement.match = loop.match;
  statement.query = loop.query;
  if (said == LoopStatement::kRight) statement.T_match_query = loop.T_match_query;
  state.statements.push_back(statement);
}

}  // namespace

store::Epoch decide_on_loop(store::ProjectWriter& writer, const std::filesystem::path& store,
                            const StatedLoop& loop, LoopStatement said,
                            const merge::MergeConfig& config) {
  const SessionNames names(store::StoreReader(store).sessions());
  const std::string words =
      "loop " + names.text(loop.query) + " " + names.text(loop.match) + " " + text_of(said);
  ProjectState wanted = writer.current();
  say(loop, said, wanted);
  const ProjectMerge merge = merge_stored(writer, store, wanted, config, {});
  const auto epoch = writer.commit(words, [&](ProjectState& state) {
    say(loop, said, state);
    state.epoch.result = writer.keep(merge.stored);
    return std::optional(merge.outcome);
  });
  return *epoch;
}

std::optional<store::Epoch> go_back(store::ProjectWriter& writer, std::int64_t number) {
  const ProjectState before = writer.reader().current();
  if (before.epoch.number == 0) throw std::runtime_error("there is nothing to undo");
  const std::int64_t to = number > 0 ? number : before.epoch.parent;
  const ProjectState target = to == 0 ? ProjectState{} : writer.reader().at(to);
  if (to == 0 && before.sessions.empty() && before.statements.empty()) {
    throw std::runtime_error("there is nothing to undo");
  }
  return writer.commit("undo", [&](ProjectState& state) {
    std::vector<std::int64_t> sessions = target.sessions;
    for (const std::int64_t session : state.sessions) {
      if (session > before.epoch.known_sessions) sessions.push_back(session);
    }
    state.sessions = std::move(sessions);
    state.statements = target.statements;
    state.crs = target.crs;
    state.epoch.result = target.epoch.result;
    state.epoch.parent = target.epoch.parent;
    return std::optional("went back to epoch " + std::to_string(to));
  });
}

}  // namespace unimapper::apps
