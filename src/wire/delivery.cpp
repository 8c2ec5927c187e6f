#include "unimapper/wire/delivery.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

namespace unimapper::wire {

namespace {

/// Of so many pieces one belongs to the oldest keyframe: it arrives some day, however many new
/// ones there are.
constexpr std::uint64_t kBackfillShare = 4;

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

void Outbox::add(std::uint32_t sequence, std::uint32_t pieces) {
  Item& item = items_[sequence];
  item.due.assign(pieces, true);
  item.due_count = pieces;
  item.next = 0;
  due_.insert(sequence);
}

void Outbox::add_sent(std::uint32_t sequence, std::uint32_t pieces) {
  Item& item = items_[sequence];
  item = {};
  item.due.assign(pieces, false);
  item.was_sent = true;
  item.last_sent_ns = std::numeric_limits<std::int64_t>::min() / 2;
  due_.erase(sequence);
}

void Outbox::forget(std::uint32_t sequence) {
  items_.erase(sequence);
  due_.erase(sequence);
}

std::optional<Outbox::Piece> Outbox::next() const {
  if (due_.empty()) return std::nullopt;
  const bool backfill = pieces_sent_ % kBackfillShare == kBackfillShare - 1;
  const std::uint32_t sequence = backfill ? *due_.begin() : *due_.rbegin();
  return Piece{sequence, items_.at(sequence).next};
}

bool Outbox::sent(const Piece& piece, std::int64_t now_ns) {
  ++pieces_sent_;
  Item& item = items_.at(piece.sequence);
  item.last_sent_ns = now_ns;
  item.due[piece.index] = false;
  --item.due_count;
  while (item.next < item.due.size() && !item.due[item.next]) ++item.next;
  if (item.due_count > 0) return false;
  item.was_sent = true;
  due_.erase(piece.sequence);
  return true;
}

std::vector<std::uint32_t> Outbox::take(const StoredMessage& message, std::int64_t now_ns) {
  std::vector<std::uint32_t> stored;
  for (auto& [sequence, item] : items_) {
    const Said said = said_of(message, sequence);
    if (said == Said::kStored) stored.push_back(sequence);
    const bool waits = item.due_count == 0 && now_ns - item.last_sent_ns >= resend_after_ns_;
    if (said == Said::kMissing && waits) resend(sequence, item, message);
  }
  for (const std::uint32_t sequence : stored) forget(sequence);
  return stored;
}

/// The pieces that are missing; all of them if the base does not say, or means other pieces.
void Outbox::resend(std::uint32_t sequence, Item& item, const StoredMessage& message) {
  const auto pieces = item.due.size();
  item.due.assign(pieces, true);
  for (const IncompleteKeyframe& keyframe : message.incomplete) {
    const bool fits = keyframe.sequence == sequence && keyframe.missing.size() == pieces;
    if (fits) item.due = keyframe.missing;
  }
  item.due_count = static_cast<std::uint32_t>(std::count(item.due.begin(), item.due.end(), true));
  if (item.due_count == 0) return;
  item.next = static_cast<std::uint32_t>(
      std::distance(item.due.begin(), std::find(item.due.begin(), item.due.end(), true)));
  due_.insert(sequence);
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
