// Evidence about placements of sessions in a store.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ports/store/database.hpp"

namespace unimapper::store {

/// What evidence depends on.
struct PlacementKey {
  std::int64_t query = 0;         ///< row of the session that is placed
  std::int64_t match = 0;         ///< row of the session it is placed in
  std::uint64_t fingerprint = 0;  ///< of everything else
};

/// What sensor data say, as `merge::PlacementEvidence` has it.
struct PlacementResult {
  std::uint64_t supporting = 0;     ///< keyframes beside each other that fit
  std::uint64_t contradicting = 0;  ///< keyframes beside each other that see different structure
  std::string aliasing;             ///< where else the query fits as well, in words
};

/// Finds and keeps evidence. No part of any epoch: it is the same whatever people say.
class PlacementOutcomeTable {
 public:
  /// The table must exist. Throws StoreError, as all functions do.
  explicit PlacementOutcomeTable(const Database& database);

  /// Nothing if it is not there, or is damaged.
  std::optional<PlacementResult> find(const PlacementKey& key);
  /// Keeps evidence, within a transaction of the caller's; what is there stays.
  void keep(const PlacementKey& key, const PlacementResult& evidence);

 private:
  Statement find_;
  Statement insert_;
};

/// Number of rows whose checksum is wrong; 0 without the table.
std::int64_t damaged_placement_outcomes(Database& database);

}  // namespace unimapper::store
