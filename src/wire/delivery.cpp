#include "unimapper/wire/delivery.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

namespace unimapper::wire {

namespace {

/// Of so many keyframes that are begun one is the oldest: it arrives some day, however many new
/// ones there are.
constexpr std::uint64_t kBackfillShare = 4;

/// So many pieces of summaries go in a row while others are due: a link that is too thin for the
/// summaries still delivers keyframes. A summary takes as many with datagrams of 1,300 bytes.
constexpr std::uint32_t kLeadingInARow = 3;

/// A keyframe that was sent and of which a quarter or less is due again goes before others.
constexpr std::size_t kNearlyThere = 4;

/// A summary of which the base says nothing is sent so often: it may have it, and have dropped the
/// pieces since.
constexpr std::uint32_t kSummaryTries = 3;

constexpr std::uint64_t kAllSequences = std::uint64_t{1} << 32U;

/// What the message says of a number.
enum class Said : std::uint8_t { kNothing, kStored, kMissing };

Said said_of(const StoredMessage& message, std::uint32_t sequence) {
  if (sequence < message.below) return Said::kStored;
  if (sequence < message.first || sequence >= message.until) return Said::kNothing;
  // A sender with a day's backlog asks for every keyframe of it.
  const auto range =
      std::partition_point(message.ranges.begin(), message.ranges.end(),
                           [sequence](const auto& one) { return one.end <= sequence; });
  const bool stored = range != message.ranges.end() && range->begin <= sequence;
  return stored ? Said::kStored : Said::kMissing;
}

/// What the message says of a keyframe's pieces; null if nothing, or if it means other pieces.
const std::vector<bool>* missing_of(const StoredMessage& message, std::uint32_t sequence,
                                    std::size_t pieces) {
  for (const IncompleteKeyframe& keyframe : message.incomplete) {
    if (keyframe.sequence == sequence && keyframe.missing.size() == pieces) {
      return &keyframe.missing;
    }
  }
  return nullptr;
}

}  // namespace

bool StoredSequences::insert(std::uint32_t sequence) {
  if (contains(sequence)) return false;
  ++count_;
  std::uint64_t begin = sequence;
  std::uint64_t end = begin + 1;
  auto after = runs_.upper_bound(begin);
  if (after != runs_.end() && after->first == end) {
    end = after->second;
    after = runs_.erase(after);
  }
  if (after != runs_.begin() && std::prev(after)->second == begin) {
    std::prev(after)->second = end;
  } else {
    runs_.emplace(begin, end);
  }
  return true;
}

bool StoredSequences::contains(std::uint32_t sequence) const {
  const auto after = runs_.upper_bound(sequence);
  return after != runs_.begin() && std::prev(after)->second > sequence;
}

void StoredSequences::describe(StoredMessage& message) {
  const bool starts_at_zero = !runs_.empty() && runs_.begin()->first == 0;
  message.below = starts_at_zero ? runs_.begin()->second : 0;
  message.first = std::max(next_, message.below);
  message.ranges.clear();
  auto run = runs_.upper_bound(message.first);
  // The run that `first` lies in may have grown since the last call.
  if (run != runs_.begin() && std::prev(run)->second > message.first) --run;
  for (; run != runs_.end() && message.ranges.size() < kMaxStoredRanges; ++run) {
    message.ranges.push_back({std::max(run->first, message.first), run->second});
  }
  const bool all = run == runs_.end();
  message.until = all ? kAllSequences : message.ranges.back().end;
  next_ = all ? 0 : message.until;
}

void Outbox::set_due(std::uint32_t sequence, Item& item, std::vector<bool> due) {
  item.due = std::move(due);
  const auto begin = item.due.begin();
  const auto count = [](auto from, auto to) {
    return static_cast<std::uint32_t>(std::count(from, to, true));
  };
  item.due_count = count(begin, item.due.end());
  item.leading_due = count(begin, begin + item.leading);
  item.next =
      static_cast<std::uint32_t>(std::distance(begin, std::find(begin, item.due.end(), true)));
  item.due_count > 0 ? (void)due_.insert(sequence) : (void)due_.erase(sequence);
  item.leading_due > 0 ? (void)leading_due_.insert(sequence) : (void)leading_due_.erase(sequence);
  const bool is_nearly_there =
      item.was_sent && item.due_count > 0 && kNearlyThere * item.due_count <= item.due.size();
  is_nearly_there ? (void)nearly_there_.insert(sequence) : (void)nearly_there_.erase(sequence);
}

void Outbox::add(std::uint32_t sequence, std::uint32_t pieces, std::uint32_t leading) {
  Item& item = items_[sequence];
  item = {};
  item.leading = std::min(leading, pieces);
  set_due(sequence, item, std::vector<bool>(pieces, true));
}

void Outbox::add_sent(std::uint32_t sequence, std::uint32_t pieces, std::uint32_t leading) {
  Item& item = items_[sequence];
  item = {};
  item.leading = std::min(leading, pieces);
  item.was_sent = true;
  item.last_sent_ns = std::numeric_limits<std::int64_t>::min() / 2;
  set_due(sequence, item, std::vector<bool>(pieces, false));
}

void Outbox::forget(std::uint32_t sequence) {
  items_.erase(sequence);
  due_.erase(sequence);
  leading_due_.erase(sequence);
  nearly_there_.erase(sequence);
}

/// Apart from summaries. One keyframe after the other: what is begun and left costs the base memory
/// and, if it forgets it, the link twice. There is one that is due.
std::uint32_t Outbox::next_keyframe() const {
  if (!nearly_there_.empty()) return *nearly_there_.rbegin();
  if (current_ && due_.contains(*current_)) return *current_;
  return begun_ % kBackfillShare == kBackfillShare - 1 ? *due_.begin() : *due_.rbegin();
}

std::optional<Outbox::Piece> Outbox::next() const {
  if (due_.empty()) return std::nullopt;
  const bool takes_leading = !leading_due_.empty() && leading_sent_ < kLeadingInARow;
  const std::uint32_t sequence = takes_leading ? *leading_due_.rbegin() : next_keyframe();
  return Piece{sequence, items_.at(sequence).next};
}

bool Outbox::may_be_next(std::uint32_t sequence) const {
  if (due_.empty()) return false;
  return sequence == current_ || sequence == *due_.begin() || sequence == *due_.rbegin() ||
         (!leading_due_.empty() && sequence == *leading_due_.rbegin()) ||
         (!nearly_there_.empty() && sequence == *nearly_there_.rbegin());
}

bool Outbox::sent(const Piece& piece, std::int64_t now_ns) {
  Item& item = items_.at(piece.sequence);
  item.last_sent_ns = now_ns;
  if (piece.index < item.leading) {
    ++leading_sent_;
    if (--item.leading_due == 0) {
      leading_due_.erase(piece.sequence);
      item.summary_sent_ns = now_ns;
      ++item.summary_tries;
    }
  } else {
    leading_sent_ = 0;
    const bool goes_on = current_ && due_.contains(*current_);
    if (!goes_on && nearly_there_.empty()) {
      current_ = piece.sequence;
      ++begun_;
    }
  }
  item.due[piece.index] = false;
  --item.due_count;
  while (item.next < item.due.size() && !item.due[item.next]) ++item.next;
  if (item.due_count > 0) return false;
  item.was_sent = true;
  due_.erase(piece.sequence);
  nearly_there_.erase(piece.sequence);
  return true;
}

std::vector<std::uint32_t> Outbox::take(const StoredMessage& message, std::int64_t now_ns) {
  std::vector<std::uint32_t> stored;
  for (auto& [sequence, item] : items_) {
    const Said said = said_of(message, sequence);
    if (said == Said::kStored) stored.push_back(sequence);
    if (said != Said::kMissing) continue;
    if (item.due_count > 0) {
      resend_summary(sequence, item, message, now_ns);
    } else if (now_ns - item.last_sent_ns >= resend_after_ns_) {
      resend(sequence, item, message);
    }
  }
  for (const std::uint32_t sequence : stored) forget(sequence);
  return stored;
}

/// The pieces that are missing; all of them if the base does not say, or means other pieces.
void Outbox::resend(std::uint32_t sequence, Item& item, const StoredMessage& message) {
  const auto* missing = missing_of(message, sequence, item.due.size());
  set_due(sequence, item, missing != nullptr ? *missing : std::vector<bool>(item.due.size(), true));
}

/// Pieces of a summary, although others of the keyframe have not been sent yet.
void Outbox::resend_summary(std::uint32_t sequence, Item& item, const StoredMessage& message,
                            std::int64_t now_ns) {
  if (item.leading == 0 || item.leading_due > 0) return;
  const auto* missing = missing_of(message, sequence, item.due.size());
  std::vector<bool> due = item.due;
  if (missing != nullptr) {
    const auto end = missing->begin() + item.leading;
    if (std::find(missing->begin(), end, true) == end) {
      item.leading = 0;
      return;
    }
    if (now_ns - item.summary_sent_ns < resend_after_ns_) return;
    std::copy(missing->begin(), end, due.begin());
  } else {
    if (item.summary_tries >= kSummaryTries) return;
    if (now_ns - item.summary_sent_ns < resend_after_ns_ << item.summary_tries) return;
    std::fill_n(due.begin(), item.leading, true);
  }
  set_due(sequence, item, std::move(due));
}

std::optional<std::uint32_t> Outbox::oldest() const {
  if (items_.empty()) return std::nullopt;
  return items_.begin()->first;
}

bool Outbox::was_sent(std::uint32_t sequence) const {
  const auto item = items_.find(sequence);
  return item != items_.end() && item->second.was_sent;
}

}  // namespace unimapper::wire
