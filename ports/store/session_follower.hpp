// Reader of sessions that grow while it looks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/store_reader.hpp"
#include "unimapper/core/ids.hpp"

namespace unimapper::store {

/// How far a session of a store is.
struct SessionExtent {
  std::int64_t row = 0;         ///< its number in the store, in order of arrival
  SessionId id;                 ///< its identity
  std::string name;             ///< as announced; its numbers until then
  bool ended = false;           ///< its end was announced
  std::uint64_t keyframes = 0;  ///< stored whole
  std::int64_t newest = -1;     ///< highest sequence of these, -1 without one
};

/// Looks again and again at what a base stores, beside it, in another thread or process. Holds no
/// transaction open between calls. Not thread safe; all functions throw StoreError.
class SessionFollower {
 public:
  explicit SessionFollower(const std::filesystem::path& folder);

  /// Whether anything was committed since the call before; true the first time. O(1).
  bool has_changed();
  /// Sessions with a keyframe in order of arrival. O(sessions).
  std::vector<SessionExtent> sessions();
  /// Number of the latest epoch of the store's project; 0 without one. O(log epochs).
  std::int64_t epoch();
  /// The sequence from which on the session had so many keyframes then, or of its first one if it
  /// had fewer. O(count).
  std::int64_t start_of_newest(const SessionExtent& session, std::size_t count);
  /// At most so many keyframes of the session from that sequence on, ascending. O(bytes).
  std::vector<StoredKeyframe> keyframes(std::int64_t row, std::int64_t first, std::size_t most);

 private:
  Database database_;
  std::int64_t version_ = -1;
};

}  // namespace unimapper::store
