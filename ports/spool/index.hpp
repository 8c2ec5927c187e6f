// Index of what a spool has on disk: segments, sessions and what was acknowledged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "ports/spool/segment.hpp"
#include "ports/spool/sequence_set.hpp"

namespace unimapper::spool {

/// Where a keyframe's bytes lie.
struct Place {
  std::uint64_t segment = 0;  ///< number of the segment
  std::uint64_t offset = 0;   ///< of the first byte
  std::uint32_t bytes = 0;    ///< how many there are
  std::uint32_t crc32 = 0;    ///< over them
  std::int64_t stamp_ns = 0;  ///< of the keyframe
};

/// A session of which anything is known.
struct IndexedSession {
  SessionInfo info;                        ///< as its latest keyframe says
  std::map<std::uint32_t, Place> on_disk;  ///< by sequence
  SequenceSet acknowledged;                ///< stored at a base
  bool ended = false;                      ///< a base confirmed its end
};

/// Keyframes that went with a segment.
struct Removed {
  std::uint64_t acknowledged = 0;  ///< a base has them
  std::uint64_t waiting = 0;       ///< nobody has them any more
};

/// What was found in a folder.
struct Found {
  std::uint64_t segments_skipped = 0;  ///< of another version, damaged at the front, unreadable
  std::uint64_t faults = 0;            ///< stretches of other segments that are no record
};

/// Segments, sessions and places of keyframes. Not thread safe; the caller removes files.
class Index {
 public:
  /// Reads all segments of a folder, oldest first.
  Found read(const std::filesystem::path& folder);
  /// Takes over what another index knows of acknowledgements and ends.
  void take_acknowledgements(const Index& other);

  /// A new segment, numbered above all others.
  std::uint64_t begin_segment();
  /// Bytes that a segment has now.
  void set_bytes(std::uint64_t segment, std::uint64_t bytes);
  /// A keyframe that is on disk.
  void add(const SessionInfo& info, std::uint32_t sequence, const Place& place,
           std::int64_t written_s);
  /// Numbers of a session that a base has stored.
  void acknowledge(const SessionId& session, wire::SequenceRange range);
  /// The end of a session was confirmed.
  void end(const SessionId& session);
  /// Forgets a segment and the keyframes in it.
  Removed remove_segment(std::uint64_t segment);
  /// Forgets a keyframe that turned out to be damaged.
  void remove_keyframe(const SessionId& session, std::uint32_t sequence);
  /// Forgets a session of which nothing is on disk.
  void forget_if_empty(const SessionId& session);

  /// Where a keyframe is, if it is on disk.
  [[nodiscard]] std::optional<Place> find(const SessionId& session, std::uint32_t sequence) const;
  /// All sessions.
  [[nodiscard]] const std::map<SessionId, IndexedSession>& sessions() const { return sessions_; }
  /// The oldest segment but `current` in which everything is acknowledged.
  [[nodiscard]] std::optional<std::uint64_t> oldest_acknowledged(std::uint64_t current) const;
  /// The oldest segment but `current`.
  [[nodiscard]] std::optional<std::uint64_t> oldest(std::uint64_t current) const;
  /// The oldest segment but `current` whose newest keyframe was written before `second`.
  [[nodiscard]] std::optional<std::uint64_t> older_than(std::int64_t second,
                                                        std::uint64_t current) const;
  /// Disk space of all segments.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Keyframes on disk.
  [[nodiscard]] std::uint64_t keyframes() const;
  /// Bytes of those on disk that no base has acknowledged. O(1).
  [[nodiscard]] std::uint64_t waiting_bytes() const { return waiting_bytes_; }

 private:
  struct Key {
    SessionId session;
    std::uint32_t sequence = 0;
  };
  struct Segment {
    std::uint64_t bytes = 0;
    std::int64_t newest_s = 0;
    std::vector<Key> keyframes;
  };

  void take_from_disk(IndexedSession& session, std::map<std::uint32_t, Place>::iterator place);
  void read_segment(const std::filesystem::path& file, std::uint64_t number, Found& found);
  [[nodiscard]] bool is_acknowledged(std::uint64_t number, const Segment& segment) const;

  std::map<std::uint64_t, Segment> segments_;
  std::map<SessionId, IndexedSession> sessions_;
  std::uint64_t last_segment_ = 0;
  std::uint64_t waiting_bytes_ = 0;
};

}  // namespace unimapper::spool
