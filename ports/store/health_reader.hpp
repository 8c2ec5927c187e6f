// Reader of the history of the sessions' health.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "database.hpp"

namespace unimapper::store {

/// A line of a health message: what it is about, and its figures.
struct HealthDetail {
  std::string kind;             ///< "stage", "drop", "container", "clock" or "stored"
  std::string name;             ///< the robot's own word; of a clock its offset in nanoseconds
  std::vector<double> figures;  ///< stage: p50, p99, max in ms; container: used, capacity; else one
};

/// The latest health message of a minute.
struct HealthRow {
  std::int64_t session = 0;           ///< row of its session
  std::int64_t received_s = 0;        ///< Unix time
  std::int64_t scans = 0;             ///< since the session began, as all counts
  std::int64_t keyframes = 0;         ///< made
  std::int64_t bytes_sent = 0;        ///< over the link
  std::int64_t deadline_misses = 0;   ///< of scans and keyframes
  std::vector<HealthDetail> details;  ///< in the order of the message
};

/// What is kept of messages that were received since then (Unix time), by session, then time.
/// O(rows). Throws StoreError.
[[nodiscard]] std::vector<HealthRow> read_health(const std::filesystem::path& folder,
                                                 std::int64_t since_s = 0);

}  // namespace unimapper::store
