// Reader of a stored project: its epochs, what people said, results of merges.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/project.hpp"

namespace unimapper::store {

/// Reads the project in a store's database, which must outlive it. A store of an earlier schema
/// has none: no epoch and no session in it. All functions throw StoreError, also for what is
/// damaged.
class ProjectReader {
 public:
  explicit ProjectReader(Database& database);

  /// All epochs, ascending.
  [[nodiscard]] std::vector<Epoch> epochs();
  /// The project as of the latest epoch.
  [[nodiscard]] ProjectState current();
  /// The project as of an epoch. Throws StoreError if there is none of that number.
  [[nodiscard]] ProjectState at(std::int64_t number);
  /// The result of a merge.
  [[nodiscard]] MapResult result(std::int64_t id);
  /// Checks every invariant (docs/design/store.md), in words what is wrong.
  [[nodiscard]] std::vector<std::string> check();

 private:
  Database& database_;
  bool has_project_;
};

}  // namespace unimapper::store
