// Files of a store: their names, their lock, their schema.
#pragma once

#include <filesystem>
#include <string>

#include "ports/store/database.hpp"

namespace unimapper::store {

/// The schema this version writes; docs/design/store.md describes it.
inline constexpr int kSchemaVersion = 6;

/// Name of the database in a store's folder.
inline constexpr const char* kDatabaseName = "store.sqlite";

/// The database of the store in `folder`.
std::filesystem::path database_of(const std::filesystem::path& folder);

/// Whether `path` is a folder with a store's database in it, sound or not.
bool is_store(const std::filesystem::path& path);

/// Whether there is a store with tables, which is not so until who makes it has done so. Throws
/// StoreError for a file that is no store, that a newer version wrote, or that is damaged.
bool has_tables(const std::filesystem::path& folder);

/// The right to write to a store, held until destruction or the end of the process, however it
/// ends. Readers need none.
class StoreLock {
 public:
  /// Makes the folder if it is absent. `holder`: who will be said to hold it, e.g. "a base". Throws
  /// StoreError that names the holder and its process if another process holds the lock.
  StoreLock(const std::filesystem::path& folder, const std::string& holder);
  ~StoreLock();
  StoreLock(const StoreLock&) = delete;
  StoreLock& operator=(const StoreLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// Opens a store's database for writing; a new one gets its tables. Throws StoreError for a file
/// that is no store, that is of another schema, or that is damaged.
Database open_for_writing(const std::filesystem::path& folder);

/// Opens a store's database for reading. Throws StoreError as `open_for_writing` does, and for a
/// new database, which has no tables.
Database open_for_reading(const std::filesystem::path& folder);

}  // namespace unimapper::store
