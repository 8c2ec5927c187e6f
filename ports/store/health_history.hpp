// History of the sessions' health in a store.
#pragma once

#include <cstdint>

#include "ports/store/database.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::store {

/// Rows kept of a session; after them the oldest is overwritten.
inline constexpr std::int64_t kHealthRows = 600;
/// One row for each such period, the latest message in it: 600 rows are ten hours.
inline constexpr std::int64_t kHealthPeriodSeconds = 60;

/// Writes health messages, within a transaction of the caller's.
class HealthHistory {
 public:
  explicit HealthHistory(const Database& database);
  /// Keeps a message; of a session that is not stored nothing. Throws StoreError.
  void keep(const wire::HealthMessage& health, std::int64_t now_s);

 private:
  Statement insert_;
};

}  // namespace unimapper::store
