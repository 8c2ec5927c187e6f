// Changes of a stored project: sessions that come in, statements of people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ports/store/project.hpp"
#include "ports/store/session_import.hpp"
#include "src/apps/map/map_options.hpp"

namespace unimapper::apps {

/// Prints what came of a change.
void say_epoch(const std::optional<store::Epoch>& epoch);

/// Takes a session that was imported into the project. What became of it, in words; nothing if it
/// was there already. Throws std::runtime_error if it is in the store with other content.
std::string take_in(store::ProjectState& state, const store::ImportedSession& session);

/// Stores statements in place of those that say something of the same; one epoch. `holder`: who
/// others are told writes to the store.
void state_it(const ProjectOptions& options, const std::string& holder, const std::string& command,
              const std::string& outcome, const std::vector<store::StoredStatement>& statements);

}  // namespace unimapper::apps
