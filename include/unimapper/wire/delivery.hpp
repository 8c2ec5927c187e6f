// Delivery of keyframes over a link that loses datagrams: what the base has stored, what is resent.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "unimapper/core/ids.hpp"

namespace unimapper::wire {

/// A keyframe of which pieces have arrived, but not all.
struct IncompleteKeyframe {
  std::uint32_t sequence = 0;  ///< of the keyframe within its session
  std::vector<bool> missing;   ///< for each of its pieces
};

/// A run of sequence numbers.
struct SequenceRange {
  std::uint64_t begin = 0;  ///< the first
  std::uint64_t end = 0;    ///< one past the last
};

/// What the base has stored of one session. It speaks of the numbers below `below`, all of which
/// are stored, and of those in [first, until), of which `ranges` are.
struct StoredMessage {
  SessionId session;                  ///< whose keyframes
  bool ended = false;                 ///< the base takes the session to be over
  std::uint64_t below = 0;            ///< every keyframe below is stored
  std::uint64_t first = 0;            ///< first number that `ranges` tell about
  std::uint64_t until = 0;            ///< one past the last number that `ranges` tell about
  std::vector<SequenceRange> ranges;  ///< ascending, disjoint, at most `kMaxStoredRanges`
  /// Some incomplete keyframes, with at most `kMaxMissingBits`.
  std::vector<IncompleteKeyframe> incomplete;
};

/// Bounds that keep a `StoredMessage` within one datagram.
inline constexpr std::size_t kMaxStoredRanges = 128;
/// Pieces of all incomplete keyframes of a message together.
inline constexpr std::size_t kMaxMissingBits = 16384;
/// Incomplete keyframes of a message.
inline constexpr std::size_t kMaxIncomplete = 64;

/// Set of the sequence numbers that are stored, as runs: small where gaps are few.
class StoredSequences {
 public:
  /// False if the number was there. O(log runs).
  bool insert(std::uint32_t sequence);
  /// Whether the number is there. O(log runs).
  [[nodiscard]] bool contains(std::uint32_t sequence) const;
  /// How many numbers are in the set. O(1).
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// One past the highest number, 0 without any. O(1).
  [[nodiscard]] std::uint64_t end() const { return runs_.empty() ? 0 : runs_.rbegin()->second; }
  /// Fills in `below`, `first`, `until` and `ranges`. With more runs than fit, successive calls
  /// speak of successive runs, and start over after the last.
  void describe(StoredMessage& message);

 private:
  std::map<std::uint64_t, std::uint64_t> runs_;  ///< begin to end
  std::uint64_t count_ = 0;
  std::uint64_t next_ = 0;  ///< where the next description starts
};

/// Decides which pieces a sender sends next: the leading pieces of keyframes, which hold their
/// summaries, the newest first; then keyframes one after the other, first those that were sent and
/// lack some pieces, then the newest, and every fourth time the oldest.
/// Pieces that the base misses are sent again. Holds numbers, not bytes; no clock of its own: times
/// are the caller's, in nanoseconds of any steady clock.
class Outbox {
 public:
  /// One piece of a keyframe.
  struct Piece {
    std::uint32_t sequence = 0;  ///< of the keyframe
    std::uint32_t index = 0;     ///< of the piece
  };

  /// `resend_after_ns`: what was sent more recently may be on its way still, and is not resent.
  explicit Outbox(std::int64_t resend_after_ns) : resend_after_ns_(resend_after_ns) {}

  /// Sets after how long a piece is resent: another time for a slower or faster link.
  void set_resend_after(std::int64_t ns) { resend_after_ns_ = ns; }

  /// A keyframe to be sent, of so many pieces (at least 1), the first `leading` of which hold its
  /// summary.
  void add(std::uint32_t sequence, std::uint32_t pieces, std::uint32_t leading = 0);
  /// A keyframe that was sent whole before, at an earlier start: none of its pieces goes unless the
  /// base says that it misses them.
  void add_sent(std::uint32_t sequence, std::uint32_t pieces, std::uint32_t leading = 0);
  /// Forgets a keyframe, delivered or not.
  void forget(std::uint32_t sequence);
  /// The piece to be sent next, if any.
  [[nodiscard]] std::optional<Piece> next() const;
  /// The piece `next` was sent. True if it was the last one of its keyframe that was due.
  bool sent(const Piece& piece, std::int64_t now_ns);
  /// Takes what the base says of this session. Returns the keyframes that it has stored; they are
  /// forgotten.
  std::vector<std::uint32_t> take(const StoredMessage& message, std::int64_t now_ns);

  /// Keyframes that were sent or wait to be, and were not acknowledged.
  [[nodiscard]] std::size_t size() const { return items_.size(); }
  /// The oldest of them, if there is one.
  [[nodiscard]] std::optional<std::uint32_t> oldest() const;
  /// Whether any of its pieces is to be sent.
  [[nodiscard]] bool is_due(std::uint32_t sequence) const { return due_.contains(sequence); }
  /// Whether one of the next pieces may be of this keyframe, unless another is added.
  [[nodiscard]] bool may_be_next(std::uint32_t sequence) const;
  /// Whether every piece of this keyframe was sent at least once.
  [[nodiscard]] bool was_sent(std::uint32_t sequence) const;

 private:
  struct Item {
    std::vector<bool> due;  ///< for each piece
    std::uint32_t due_count = 0;
    std::uint32_t next = 0;         ///< no piece before it is due
    std::uint32_t leading = 0;      ///< pieces of the summary; 0 once the base has it
    std::uint32_t leading_due = 0;  ///< pieces of the summary that are to be sent
    std::uint32_t summary_tries = 0;
    std::int64_t summary_sent_ns = 0;
    bool was_sent = false;
    std::int64_t last_sent_ns = 0;
  };

  [[nodiscard]] std::uint32_t next_keyframe() const;
  void set_due(std::uint32_t sequence, Item& item, std::vector<bool> due);
  void resend(std::uint32_t sequence, Item& item, const StoredMessage& message);
  void resend_summary(std::uint32_t sequence, Item& item, const StoredMessage& message,
                      std::int64_t now_ns);

  std::int64_t resend_after_ns_;
  std::map<std::uint32_t, Item> items_;
  std::set<std::uint32_t> due_;           ///< items with pieces to be sent
  std::set<std::uint32_t> leading_due_;   ///< items with leading pieces to be sent
  std::set<std::uint32_t> nearly_there_;  ///< items that lack only some pieces, which are due
  std::optional<std::uint32_t> current_;  ///< being sent
  std::uint32_t leading_sent_ = 0;        ///< in a row
  std::uint64_t begun_ = 0;               ///< keyframes that were `current_`
};

}  // namespace unimapper::wire
