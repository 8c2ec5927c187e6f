// Keyframes and sessions of a store that are to be handed on, and marks of those that were.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/store_file.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::store {

/// A stored keyframe that was not handed on yet.
struct OutgoingKeyframe {
  std::int64_t session = 0;         ///< row of its session
  wire::KeyframeName name;          ///< its identity
  std::vector<std::uint8_t> bytes;  ///< as the robot encoded it
};

/// A stored session with a name and a keyframe.
struct OutgoingSession {
  std::int64_t row = 0;                   ///< its number in the store
  wire::SessionSummary summary;           ///< as it is stored; has names
  std::vector<std::uint8_t> handed_over;  ///< what was marked last, empty at first
};

/// Follows a store while a base writes to it, from another thread and with connections of its own.
/// What is handed on is marked in tables, so that neither a removal nor an import hides a keyframe.
/// A mark takes the right to write for about a millisecond and does not wait for the disk: what a
/// power failure takes back is handed on again. Not thread safe; all functions throw StoreError.
class Outbox {
 public:
  /// `held`: the store's lock, which must outlive it.
  Outbox(const std::filesystem::path& folder, const StoreLock& held);

  /// Keyframes after those that it returned before, in the order in which they were committed: so
  /// many, or so many bytes and one. Damaged ones are left out. O(bytes).
  std::vector<OutgoingKeyframe> next(std::size_t most, std::size_t most_bytes);
  /// Whether anything was committed since the call before; true the first time. O(1).
  bool has_changed();
  /// Begins again with the first keyframe without a mark. O(keyframes of the store).
  void start_over();
  /// Keyframes without a mark. O(sessions + marks).
  std::uint64_t unmarked();
  /// Keyframes left out since the last start, being damaged.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }
  /// All sessions with a name and a keyframe. O(sessions).
  std::vector<OutgoingSession> sessions();

  /// What was handed on.
  struct Marks {
    std::vector<OutgoingKeyframe> keyframes;  ///< their bytes do not matter
    std::vector<OutgoingSession> sessions;    ///< with what was handed on of them
  };
  /// Marks all or nothing.
  void mark(const Marks& marks);
  /// Forgets all marks: everything is handed on again.
  void forget_marks();

 private:
  Database reading_;
  Database writing_;
  std::int64_t version_ = -1;
  std::int64_t returned_ = 0;  ///< row of the last keyframe that was returned
  std::uint64_t damaged_ = 0;
};

}  // namespace unimapper::store
