// Reassembly of keyframes from their pieces in bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "unimapper/wire/delivery.hpp"
#include "unimapper/wire/messages.hpp"
#include "unimapper/wire/robot_quotas.hpp"

namespace unimapper::wire {

/// Bounds on what a stream, honest or forged, can make a receiver hold.
struct ReceiverLimits {
  std::uint32_t max_sessions = 64;                ///< sessions followed at once
  std::uint32_t max_keyframe_bytes = 64U << 20U;  ///< larger keyframes are refused
  /// Memory of cells and images of a keyframe while it is decoded; one of more counts as damaged.
  /// Room for four million cells. Forged bytes can announce 64 times their size.
  std::uint64_t max_record_bytes = 64U << 20U;
  std::uint32_t max_pending_keyframes = 64;       ///< incomplete, over all sessions
  std::uint64_t max_pending_bytes = 256U << 20U;  ///< held for incomplete keyframes
  std::uint64_t max_stored_bytes = 16ULL << 30U;  ///< held for decoded keyframes
  std::uint32_t max_damaged = 100000;             ///< damaged numbers remembered of a session
  RobotLimits robot;                              ///< of each robot by itself
};

/// Collects pieces until a keyframe is whole. Pieces may come in any order, more than once, and
/// interleaved over any number of keyframes. Memory follows the bytes that arrived, never a
/// length that was announced. Pieces belong together only if their whole heads agree, so a
/// piece with a forged head starts a keyframe of its own. Where pieces with one head and index
/// differ, all are kept and tried, so one with an overheard head cannot spoil a real keyframe
/// either. When there are too many, the robot that holds most loses the keyframe that has waited
/// longest for a piece; robots of which nothing whole has arrived yet lose theirs first. A robot
/// beyond its own limits loses its own.
class Reassembly {
 public:
  /// What became of a piece.
  enum class Outcome : std::uint8_t {
    kWaiting,    ///< pieces are still missing
    kDuplicate,  ///< this piece was there already
    kTooLarge,   ///< the keyframe exceeds `max_keyframe_bytes`
    kDamaged,    ///< every piece is here, but the checksum fails; another piece may mend it
    kComplete,
  };
  /// Outcome for one piece, and the keyframe it completed.
  struct Result {
    Outcome outcome = Outcome::kWaiting;  ///< what became of the piece
    std::vector<std::uint8_t> payload;    ///< if complete
    /// The keyframe's summary, once, if other pieces are still missing. Only the checksums of its
    /// pieces have been checked.
    std::vector<std::uint8_t> summary;
  };

  explicit Reassembly(const ReceiverLimits& limits) : limits_(limits) {}

  /// Takes one possible piece (`is_possible`). `known`: its session has whole keyframes already.
  Result add(ChunkMessage&& chunk, bool known);
  /// Forgets everything about a keyframe, because it has arrived.
  void forget(const SessionId& session, std::uint32_t sequence);

  /// What is missing of a session's keyframes, as much as a message holds.
  [[nodiscard]] std::vector<IncompleteKeyframe> incomplete(const SessionId& session) const;
  /// Keyframes of which pieces are missing.
  [[nodiscard]] std::size_t pending_keyframes() const { return pending_.size(); }
  /// Bytes held for them.
  [[nodiscard]] std::uint64_t pending_bytes() const { return pending_bytes_; }
  /// Incomplete keyframes evicted because the memory limit was reached.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  /// Session and sequence first, so that what concerns one keyframe lies together.
  struct Head {
    SessionId session;
    std::uint32_t sequence = 0;
    std::uint32_t count = 0;
    std::uint32_t total_bytes = 0;
    std::uint32_t payload_crc32 = 0;
    friend auto operator<=>(const Head&, const Head&) = default;
  };
  using Data = std::vector<std::uint8_t>;
  struct Pending {
    std::map<std::uint32_t, std::vector<Data>> pieces;  ///< by index, all that differ
    std::uint64_t bytes = 0;
    std::uint64_t last_touched = 0;
    bool known = false;
    bool summary_taken = false;  ///< the summary was taken, or there is none
  };
  using Table = std::map<Head, Pending>;

  static Data join(const Head& head, const Pending& pending, std::uint32_t newest);
  static Data take_summary(Pending& pending);

  /// What is held of one robot's.
  struct Held {
    std::uint32_t keyframes = 0;
    std::uint64_t bytes = 0;
  };

  void erase(Table::iterator entry);
  void count_bytes(const Head& head, Pending& pending, std::int64_t bytes);
  void make_room(const Head& keep);
  void make_room_of_robot(const Head& keep);

  ReceiverLimits limits_;
  Table pending_;
  std::map<std::uint32_t, Held> robots_;
  std::uint64_t pending_bytes_ = 0;
  std::uint64_t clock_ = 0;
  std::uint64_t given_up_ = 0;
};

}  // namespace unimapper::wire
