// Reader of stored sessions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/project_reader.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::store {

/// A session of a store, without its keyframes.
struct SessionListing {
  std::int64_t row = 0;                 ///< its number in the store, in order of arrival
  SessionInfo info;                     ///< names; "-2", "-3", ... where a name occurs again
  bool ended = false;                   ///< its end was announced
  std::uint64_t announced = 0;          ///< keyframes made, as far as known
  std::uint64_t dropped_by_sender = 0;  ///< keyframes made that the robot never sent
  std::uint64_t keyframes = 0;          ///< keyframes stored whole
  std::uint64_t summaries = 0;          ///< keyframes of which only the summary is stored
  std::uint64_t bytes = 0;              ///< bytes of the keyframes stored whole, as encoded
  std::int64_t first_stored_s = 0;      ///< when its first keyframe was stored, Unix time
  std::int64_t first_stamp_ns = 0;      ///< of the first keyframe stored
  std::int64_t last_stamp_ns = 0;       ///< of the last keyframe stored
  std::uint64_t health_rows = 0;        ///< of the history of its health

  /// Keyframes that were made and are not stored.
  [[nodiscard]] std::uint64_t missing() const {
    return announced - (announced < keyframes ? announced : keyframes);
  }
};

/// A keyframe as it is stored.
struct StoredKeyframe {
  std::uint32_t sequence = 0;       ///< of the keyframe within its session
  std::vector<std::uint8_t> bytes;  ///< as the robot encoded it
  bool is_sound = false;            ///< its checksum is the one it was stored with
};

/// What a query of keyframes begins with whose rows `keyframe_in` reads.
inline constexpr std::string_view kSelectKeyframes = "SELECT sequence, crc32, bytes FROM keyframes";
/// The keyframe in a query's present row. O(bytes). Throws StoreError.
StoredKeyframe keyframe_in(const Statement& rows);

/// Reads a store, also while a base writes to it. Not thread safe; all functions throw StoreError.
class StoreReader {
 public:
  explicit StoreReader(const std::filesystem::path& folder);

  /// All sessions of which something is stored, in order of arrival.
  std::vector<SessionListing> sessions();
  /// Hands over a session's keyframes in ascending sequence, one at a time.
  void for_each_keyframe(const SessionListing& session,
                         const std::function<void(StoredKeyframe&&)>& take);
  /// A session with its keyframes and summaries decoded; those that are damaged are left out,
  /// keyframes counted. `each` may take parts out of a keyframe before the next one is read.
  SessionData read(const SessionListing& session,
                   const std::function<void(KeyframeRecord&)>& each = {});
  /// Reads on in a session that was read before. Keyframes already in `data` are not read again,
  /// all summaries are. O(keyframes + bytes that are new).
  void read_on(const SessionListing& session, SessionData& data,
               const std::function<void(KeyframeRecord&)>& each = {});
  /// The project in the store; this reader must outlive it.
  ProjectReader project() { return ProjectReader(database_); }
  /// Checks the whole database, every checksum and the project, in words what is wrong. O(size of
  /// the store).
  std::vector<std::string> check();

 private:
  bool read_keyframe(std::int64_t session, std::uint32_t sequence, SessionData& data,
                     const std::function<void(KeyframeRecord&)>& each);
  void read_summaries(const SessionListing& session, SessionData& data);

  Database database_;
};

}  // namespace unimapper::store
