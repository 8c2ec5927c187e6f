// Reader of a stored project: its epochs, what people said, results of merges.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/project.hpp"

namespace unimapper::store {

/// Reads the project in a store's database, which must outlive it. All functions throw StoreError,
/// also for what is damaged.
class ProjectReader {
 public:
  explicit ProjectReader(Database& database);

  /// All epochs, ascending.
  [[nodiscard]] std::vector<Epoch> epochs();
  /// The project as of the latest epoch.
  [[nodiscard]] ProjectState current();
  /// The project as of the latest epoch with the sessions that have arrived since: as the next
  /// epoch begins.
  [[nodiscard]] ProjectState next();
  /// The project as of an epoch. Throws StoreError if there is none of that number, or if a session
  /// of it was removed for good.
  [[nodiscard]] ProjectState at(std::int64_t number);
  /// The result of a merge. Throws StoreError where anything of it is damaged.
  [[nodiscard]] MapResult result(std::int64_t id);
  /// Checksums of the poses of a result, by session: equal for equal poses, else almost surely not.
  /// Reads no pose. Empty if there is no such result.
  [[nodiscard]] std::map<std::int64_t, std::int64_t> pose_checksums(std::int64_t result);
  /// Checks every invariant (docs/design/store.md), in words what is wrong.
  [[nodiscard]] std::vector<std::string> check();

 private:
  Database& database_;
};

}  // namespace unimapper::store
