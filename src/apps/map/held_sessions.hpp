// Sessions of a store that stay in memory while they grow.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "ports/store/store_reader.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::apps {

/// Keyframes without cells and images, which are read on demand and kept under a limit. Sessions
/// are in the order in which they came to be held, ready for a merge. Not thread safe.
class HeldSessions {
 public:
  /// `max_bytes`: of keyframes that are kept whole. Throws store::StoreError.
  HeldSessions(std::filesystem::path store, std::uint64_t max_bytes)
      : store_(std::move(store)), reader_(store_), contents_(max_bytes) {}

  /// Whether all that is held is in these rows; otherwise others must be held anew.
  [[nodiscard]] bool are_in(const std::vector<std::int64_t>& rows) const;
  /// Reads what has arrived in these rows. Throws store::StoreError; what was read until then stays
  /// sound. O(sessions + keyframes of those that have grown + bytes that are new).
  void refresh(const std::vector<std::int64_t>& rows);

  /// Stays where it is.
  [[nodiscard]] const std::vector<SessionData>& sessions() const { return sessions_; }
  /// Of the sessions in the store.
  [[nodiscard]] const std::vector<std::int64_t>& rows() const { return rows_; }

 private:
  /// What was known of a session when it was read last.
  struct Read {
    std::size_t index = 0;  ///< among the sessions
    std::uint64_t keyframes = 0;
    std::uint64_t summaries = 0;
    bool is_whole = false;     ///< it was read to its end
    bool is_levelled = false;  ///< keyframes were levelled, by what others know of up
  };
  void read(const store::SessionListing& listing);

  std::filesystem::path store_;
  store::StoreReader reader_;
  StoredContents contents_;
  std::vector<SessionData> sessions_;
  std::vector<std::int64_t> rows_;
  std::map<std::int64_t, Read> read_;  ///< by row
};

}  // namespace unimapper::apps
