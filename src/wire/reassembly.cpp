#include "unimapper/wire/reassembly.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::wire {

namespace {

/// What a piece costs beyond its data: a map node and an allocation of its own. Without it, a
/// flood of one-byte pieces would count as nothing.
constexpr std::int64_t kPieceOverheadBytes = 128;

/// Pieces of one index that differ: the real one and some forged ones.
constexpr std::size_t kMaxVariants = 4;

/// Combinations of such pieces that are tried when one more has arrived.
constexpr int kMaxCombinations = 16;

/// A longer summary is not looked for: joining it again with every piece would cost time.
constexpr std::size_t kLongestSummaryBytes = 65536;

std::int64_t bytes_of(const std::vector<std::uint8_t>& piece) {
  return static_cast<std::int64_t>(piece.size()) + kPieceOverheadBytes;
}

}  // namespace

Reassembly::Result Reassembly::add(ChunkMessage&& chunk, bool known) {
  if (chunk.total_bytes > limits_.max_keyframe_bytes) return {Outcome::kTooLarge, {}, {}};
  const Head head{chunk.session, chunk.sequence, chunk.count, chunk.total_bytes,
                  chunk.payload_crc32};
  const auto [entry, is_new] = pending_.try_emplace(head);
  Pending& pending = entry->second;
  if (is_new) ++robots_[head.session.robot].keyframes;
  pending.last_touched = ++clock_;
  pending.known = pending.known || known;
  std::vector<Data>& variants = pending.pieces[chunk.index];
  const auto same = std::find(variants.begin(), variants.end(), chunk.data);
  const bool is_here = same != variants.end();
  if (is_here) {
    std::rotate(same, same + 1, variants.end());
    if (pending.pieces.size() < head.count) return {Outcome::kDuplicate, {}, {}};
  } else if (variants.size() == kMaxVariants) {
    // A flood must not shut the real piece out, which may be the last to come.
    count_bytes(head, pending, -bytes_of(variants.front()));
    variants.erase(variants.begin());
  }
  if (!is_here) {
    count_bytes(head, pending, bytes_of(chunk.data));
    variants.push_back(std::move(chunk.data));
  }
  Result result;
  if (pending.pieces.size() == head.count) {
    result.payload = join(head, pending, chunk.index);
    result.outcome = result.payload.empty() ? Outcome::kDamaged : Outcome::kComplete;
  } else if (!is_here) {
    result.summary = take_summary(pending);
  }
  if (result.outcome == Outcome::kComplete) {
    erase(entry);
  } else {
    make_room_of_robot(head);
    make_room(head);
  }
  return result;
}

/// The combination that the checksum confirms, or nothing. Those of the pieces that came last are
/// tried first, so that a keyframe which is resent undisturbed is seen through any number of forged
/// pieces. Combinations without the newest piece were tried when the ones before it came.
Reassembly::Data Reassembly::join(const Head& head, const Pending& pending, std::uint32_t newest) {
  std::vector<std::size_t> chosen(head.count, 0);  // counted from the last
  for (int i = 0; i < kMaxCombinations; ++i) {
    Data payload;
    // Pieces whose sizes belong to different cuts can be complete in number only.
    for (const auto& [index, variants] : pending.pieces) {
      const Data& data = variants[variants.size() - 1 - chosen[index]];
      payload.insert(payload.end(), data.begin(), data.end());
    }
    if (payload.size() == head.total_bytes && crc32(payload) == head.payload_crc32) return payload;
    // The next combination, counted up from the first piece.
    auto piece = pending.pieces.begin();
    for (; piece != pending.pieces.end(); ++piece) {
      if (piece->first == newest) continue;
      std::size_t& choice = chosen[piece->first];
      choice = choice + 1 < piece->second.size() ? choice + 1 : 0;
      if (choice > 0) break;
    }
    if (piece == pending.pieces.end()) break;
  }
  return {};
}

/// The summary, if the pieces at the front hold it and it was not taken before. Of pieces that
/// differ the last one counts.
Reassembly::Data Reassembly::take_summary(Pending& pending) {
  Data front;
  std::uint32_t next = 0;
  for (auto piece = pending.pieces.begin();
       !pending.summary_taken && piece != pending.pieces.end() && piece->first == next; ++piece) {
    ++next;
    const Data& data = piece->second.back();
    front.insert(front.end(), data.begin(), data.end());
    if (front.size() < kSummaryHeadBytes) continue;
    const auto bytes = summary_bytes(front);
    pending.summary_taken = !bytes || *bytes > kLongestSummaryBytes;
    if (pending.summary_taken || front.size() < *bytes) continue;
    pending.summary_taken = true;
    front.resize(*bytes);
    return front;
  }
  return {};
}

std::vector<IncompleteKeyframe> Reassembly::incomplete(const SessionId& session) const {
  std::vector<IncompleteKeyframe> all;
  std::size_t bits = 0;
  for (auto entry = pending_.lower_bound(Head{session, 0, 0, 0, 0});
       entry != pending_.end() && entry->first.session == session; ++entry) {
    const auto& [head, pending] = *entry;
    // Where every index is here but the checksum fails, nobody knows which piece is wrong.
    const bool says_something = pending.pieces.size() < head.count;
    if (!says_something || all.size() == kMaxIncomplete || bits + head.count > kMaxMissingBits) {
      continue;
    }
    bits += head.count;
    IncompleteKeyframe& keyframe = all.emplace_back();
    keyframe.sequence = head.sequence;
    keyframe.missing.assign(head.count, true);
    for (const auto& piece : pending.pieces) keyframe.missing[piece.first] = false;
  }
  return all;
}

void Reassembly::forget(const SessionId& session, std::uint32_t sequence) {
  auto entry = pending_.lower_bound(Head{session, sequence, 0, 0, 0});
  while (entry != pending_.end() && entry->first.session == session &&
         entry->first.sequence == sequence) {
    const auto next = std::next(entry);
    erase(entry);
    entry = next;
  }
}

void Reassembly::count_bytes(const Head& head, Pending& pending, std::int64_t bytes) {
  const auto change = static_cast<std::uint64_t>(bytes);
  pending.bytes += change;
  pending_bytes_ += change;
  robots_[head.session.robot].bytes += change;
}

void Reassembly::erase(Table::iterator entry) {
  pending_bytes_ -= entry->second.bytes;
  const auto robot = robots_.find(entry->first.session.robot);
  robot->second.bytes -= entry->second.bytes;
  if (--robot->second.keyframes == 0) robots_.erase(robot);
  pending_.erase(entry);
}

/// A robot beyond its own limits loses what has waited longest.
void Reassembly::make_room_of_robot(const Head& keep) {
  const std::uint32_t robot = keep.session.robot;
  for (auto held = robots_.find(robot);
       held != robots_.end() && (held->second.keyframes > limits_.robot.pending_keyframes ||
                                 held->second.bytes > limits_.robot.pending_bytes);
       held = robots_.find(robot)) {
    auto victim = pending_.end();
    for (auto entry = pending_.begin(); entry != pending_.end(); ++entry) {
      const bool is_kept = entry->first == keep && held->second.keyframes > 1;
      if (entry->first.session.robot != robot || is_kept) continue;
      const bool is_older =
          victim == pending_.end() || entry->second.last_touched < victim->second.last_touched;
      if (is_older) victim = entry;
    }
    erase(victim);
    ++given_up_;
  }
}

void Reassembly::make_room(const Head& keep) {
  while (pending_.size() > limits_.max_pending_keyframes ||
         pending_bytes_ > limits_.max_pending_bytes) {
    // Of robots that are known and of others: how much they hold.
    std::map<std::pair<bool, std::uint32_t>, std::uint64_t> held;
    for (const auto& [head, pending] : pending_) {
      held[{pending.known, head.session.robot}] += pending.bytes;
    }
    auto victim = pending_.end();
    const auto rank = [&held](Table::const_iterator entry) {
      const bool known = entry->second.known;
      return std::tuple(known, UINT64_MAX - held.at({known, entry->first.session.robot}),
                        entry->second.last_touched);
    };
    for (auto entry = pending_.begin(); entry != pending_.end(); ++entry) {
      if (entry->first == keep && pending_.size() > 1) continue;
      if (victim == pending_.end() || rank(entry) < rank(victim)) victim = entry;
    }
    erase(victim);
    ++given_up_;
  }
}

}  // namespace unimapper::wire
