// Outcomes of loop verification in a store.
#pragma once

#include <cstdint>
#include <optional>

#include "ports/store/database.hpp"
#include "ports/store/project.hpp"

namespace unimapper::store {

/// What an outcome depends on.
struct LoopKey {
  KeyframeRow query;              ///< the keyframe that was searched for
  KeyframeRow match;              ///< the keyframe that was found
  Pose proposed;                  ///< the query's frame to the match's, exactly
  std::uint64_t fingerprint = 0;  ///< of everything else
};

/// Finds and keeps outcomes. No part of any epoch: outcomes are the same whatever people say.
class LoopOutcomeTable {
 public:
  /// For reading the table must exist. Throws StoreError, as all functions do.
  explicit LoopOutcomeTable(const Database& database);

  /// Nothing if it is not there, or is damaged.
  std::optional<LoopResult> find(const LoopKey& key);
  /// Keeps an outcome, within a transaction of the caller's; one that is there stays.
  void keep(const LoopKey& key, const LoopResult& outcome);

 private:
  Statement find_;
  Statement insert_;
};

/// Checksum of what a row holds beside its key.
std::int64_t checksum_of(std::span<const std::uint8_t> pose,
                         std::span<const std::uint8_t> information, double overlap, bool accepted,
                         const std::string& reason);

}  // namespace unimapper::store
