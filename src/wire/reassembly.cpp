#include "unimapper/wire/reassembly.hpp"

#include <algorithm>
#include <utility>

#include "unimapper/wire/checksum.hpp"

namespace unimapper::wire {

namespace {

/// What a piece costs beyond its data: a map node and an allocation of its own. Without it, a
/// flood of one-byte pieces would count as nothing.
constexpr std::uint64_t kPieceOverheadBytes = 128;

}  // namespace

Reassembly::Result Reassembly::add(ChunkMessage&& chunk) {
  if (chunk.total_bytes > limits_.max_keyframe_bytes) return {Outcome::kTooLarge, {}};
  const Head head{chunk.session, chunk.sequence, chunk.count, chunk.total_bytes,
                  chunk.payload_crc32};
  Pending& pending = pending_[head];
  pending.last_touched = ++clock_;
  const std::uint64_t bytes = chunk.data.size() + kPieceOverheadBytes;
  if (!pending.pieces.emplace(chunk.index, std::move(chunk.data)).second) {
    return {Outcome::kDuplicate, {}};
  }
  pending.bytes += bytes;
  pending_bytes_ += bytes;
  if (pending.pieces.size() < head.count) {
    make_room(head);
    return {Outcome::kWaiting, {}};
  }
  Result result;
  // Pieces whose sizes belong to different cuts can be complete in number only.
  for (const auto& [index, data] : pending.pieces) {
    result.payload.insert(result.payload.end(), data.begin(), data.end());
  }
  erase(pending_.find(head));
  const bool whole =
      result.payload.size() == head.total_bytes && crc32(result.payload) == head.payload_crc32;
  result.outcome = whole ? Outcome::kComplete : Outcome::kDamaged;
  return result;
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

void Reassembly::erase(Table::iterator entry) {
  pending_bytes_ -= entry->second.bytes;
  pending_.erase(entry);
}

void Reassembly::make_room(const Head& keep) {
  while (pending_.size() > limits_.max_pending_keyframes ||
         pending_bytes_ > limits_.max_pending_bytes) {
    auto oldest = pending_.end();
    for (auto entry = pending_.begin(); entry != pending_.end(); ++entry) {
      const bool older =
          oldest == pending_.end() || entry->second.last_touched < oldest->second.last_touched;
      if (older && !(entry->first == keep && pending_.size() > 1)) oldest = entry;
    }
    erase(oldest);
    ++given_up_;
  }
}

}  // namespace unimapper::wire
