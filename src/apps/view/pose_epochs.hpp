// Epochs in which the poses of sessions changed last.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <tuple>
#include <vector>

#include "ports/store/project_reader.hpp"

namespace unimapper::apps {

/// Follows the epochs of a store, in the order of their numbers: an undo moves poses, too. Results
/// are told apart by checksums, which are read once. Thread safe.
class PoseEpochs {
 public:
  /// By row of the sessions that the map of epoch `number` has poses of: the latest epoch up to it
  /// whose poses differ from those of the one before. `epochs`: all, ascending. Throws
  /// store::StoreError. O(sessions) for each epoch since the oldest of these.
  [[nodiscard]] std::map<std::int64_t, std::int64_t> last_changed(
      store::ProjectReader& project, const std::vector<store::Epoch>& epochs, std::int64_t number);

 private:
  using Checksums = std::map<std::int64_t, std::int64_t>;  ///< by row of the session
  const Checksums& checksums_of(store::ProjectReader& project, const store::Epoch& epoch);

  std::mutex mutex_;
  /// By epoch, result and when it was made: a base replaces its own epoch.
  std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t>, Checksums> known_;
};

}  // namespace unimapper::apps
