// Tables of known positions in a store.
#pragma once

#include <cstdint>

#include "ports/store/database.hpp"
#include "ports/store/project.hpp"

namespace unimapper::store {

/// Stores the positions of a statement that has a row.
void keep_positions(Database& database, const StoredStatement& statement);
/// Stores positions and georeference of a result that has a row.
void keep_positions(Database& database, std::int64_t id, const MapResult& result);
/// Reads the positions of the statements in effect. Throws StoreError for what is damaged.
void read_positions(Database& database, ProjectState& state);
/// Reads positions and georeference of a result. Throws StoreError for what is damaged.
void read_positions(Database& database, std::int64_t id, MapResult& result);

}  // namespace unimapper::store
