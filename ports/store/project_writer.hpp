// Writer of a stored project: one change, one transaction, one epoch.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "ports/store/database.hpp"
#include "ports/store/loop_outcome_table.hpp"
#include "ports/store/project_reader.hpp"
#include "ports/store/store_file.hpp"

namespace unimapper::store {

/// Changes a project. Holds the store's lock: a base and a writer exclude each other, readers do
/// not notice. Not thread safe; all functions throw StoreError.
class ProjectWriter {
 public:
  /// Opens the store in `folder`, made if absent and `may_make`. `holder`: who others are told
  /// writes to the store.
  ProjectWriter(const std::filesystem::path& folder, const std::string& holder,
                bool may_make = false);

  /// What a change does to the project, and its outcome in words; nothing: there is no change, and
  /// no epoch. Called within the transaction; statements with `id` 0 are stored as new ones.
  using Change = std::function<std::optional<std::string>(ProjectState&)>;

  /// Makes an epoch of a change; returns its outcome, nothing where nothing changed. The state that
  /// `change` gets is the latest one with the sessions that have arrived since. If it throws,
  /// nothing is changed.
  std::optional<Epoch> commit(const std::string& command, const Change& change);

  /// The latest state with the sessions that have arrived since its epoch.
  [[nodiscard]] ProjectState current();
  /// Stores the result of a merge, within `commit`; returns its number.
  std::int64_t keep(const MapResult& result);

  /// Outcomes of loop verification, to be kept within a `Transaction` of their own.
  LoopOutcomeTable& outcomes() { return outcomes_; }
  /// The database, for what is stored within `commit`.
  Database& database() { return database_; }
  /// Reader of what is stored.
  ProjectReader& reader() { return reader_; }

 private:
  void keep(StoredStatement& statement);
  void keep(const ProjectState& state);

  StoreLock lock_;
  Database database_;
  ProjectReader reader_;
  LoopOutcomeTable outcomes_;
};

}  // namespace unimapper::store
