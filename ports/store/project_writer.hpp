// Writer of a stored project: one change, one transaction, one epoch.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/loop_outcome_table.hpp"
#include "ports/store/placement_outcome_table.hpp"
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
  /// Opens the store in `folder` for a process that holds the lock already, for as long as it does.
  ProjectWriter(const std::filesystem::path& folder, const StoreLock& held);

  /// What a change does to the project, and its outcome in words; nothing: there is no change, and
  /// no epoch. Called within the transaction; statements with `id` 0 are stored as new ones.
  using Change = std::function<std::optional<std::string>(ProjectState&)>;

  /// Makes an epoch of a change; returns its outcome, nothing where nothing changed. The state that
  /// `change` gets is the latest one with the sessions that have arrived since. If it throws,
  /// nothing is changed.
  std::optional<Epoch> commit(const std::string& command, const Change& change);
  /// Makes a change that takes the place of the latest epoch, as long as that is the one of this
  /// number: for a base, whose merges while it receives are one epoch and not thousands. A result
  /// that no epoch shows any more is removed. Otherwise as `commit`.
  std::optional<Epoch> replace(std::int64_t number, const Change& change);

  /// Removes sessions, by row, for good in one transaction: their keyframes, summaries, health,
  /// what was said of them, outcomes of their loops, and whatever earlier epochs that show them
  /// have; of these only number and words stay. The map of the latest epoch stays if it has none of
  /// them. `give_back_space` makes the file smaller.
  Epoch purge(const std::string& command, const std::string& outcome,
              const std::vector<std::int64_t>& sessions);
  /// Gives pages of the file that nothing uses back to the file system. Whoever is killed in it
  /// leaves the store as it was. O(size of the store); takes as much room on the disk meanwhile.
  void give_back_space();

  /// The latest state with the sessions that have arrived since its epoch.
  [[nodiscard]] ProjectState current();
  /// Stores the result of a merge, within `commit`; returns its number.
  std::int64_t keep(const MapResult& result);

  /// Outcomes of loop verification, to be kept within a `Transaction` of their own.
  LoopOutcomeTable& outcomes() { return outcomes_; }
  /// Evidence about placements, to be kept within a `Transaction` of its own.
  PlacementOutcomeTable& placements() { return placements_; }
  /// The database, for what is stored within `commit`.
  Database& database() { return database_; }
  /// Reader of what is stored.
  ProjectReader& reader() { return reader_; }

 private:
  void keep(StoredStatement& statement);
  void keep(const ProjectState& state);
  std::optional<Epoch> finish(ProjectState& state, std::int64_t number, const Change& change);
  void remove_epoch(std::int64_t number);
  void remove_unused_results();

  std::optional<StoreLock> lock_;  ///< nothing: the process holds it
  Database database_;
  ProjectReader reader_;
  LoopOutcomeTable outcomes_;
  PlacementOutcomeTable placements_;
};

}  // namespace unimapper::store
