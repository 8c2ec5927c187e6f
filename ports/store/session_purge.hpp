// Removal of sessions from a store for good.
#pragma once

#include <cstdint>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/project.hpp"

namespace unimapper::store {

/// Takes a session and what was said of it out of a state. Its map stays unless it shows the
/// session.
void take_out(std::int64_t session, ProjectState& state);

/// Removes all that is stored of sessions, within a transaction in which epoch `number`, which has
/// none of them, was written. Results that no epoch shows any more are left to the caller. Throws
/// StoreError.
void purge_sessions(Database& database, const std::vector<std::int64_t>& sessions,
                    std::int64_t number);

}  // namespace unimapper::store
