#include "ports/lcm/messages.hpp"

#include <algorithm>
#include <stdexcept>
#include <unimapper_wire/chunk_t.hpp>
#include <unimapper_wire/health_t.hpp>
#include <unimapper_wire/session_t.hpp>
#include <unimapper_wire/stored_t.hpp>

#include "ports/lcm/generated_codec.hpp"
#include "ports/lcm/message_text.hpp"

namespace unimapper::lcm_port {

using wire::BigEndianReader;
using wire::is_possible;
using wire::is_session_name;

namespace {

constexpr std::size_t kMaxTextBytes = 64;
constexpr std::uint32_t kMaxListEntries = 64;
constexpr std::size_t kFingerprintBytes = 8;

/// Schema version, robot and boot id, with which every message goes on.
constexpr std::size_t kIdentityBytes = 4 + 4 + 16;

std::uint32_t get_list_length(BigEndianReader& in) {
  const auto length = in.get<std::uint32_t>();
  if (length > kMaxListEntries) in.skip(UINT64_MAX);
  return std::min(length, kMaxListEntries);
}

void skip_texts(BigEndianReader& in, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) skip_text(in, kMaxTextBytes);
}

bool ends_here(const BigEndianReader& in) { return in.ok() && in.remaining() == 0; }

bool session_adds_up(Bytes bytes) {
  BigEndianReader in(bytes);
  in.skip(kFingerprintBytes + kIdentityBytes);
  skip_texts(in, 2);
  in.skip(1 + 8 + 8 + kChecksumBytes);
  return ends_here(in);
}

bool chunk_adds_up(Bytes bytes) {
  BigEndianReader in(bytes);
  in.skip(kFingerprintBytes + kIdentityBytes + 5 * 4);
  in.skip(in.get<std::uint32_t>());
  in.skip(kChecksumBytes);
  return ends_here(in);
}

bool health_adds_up(Bytes bytes) {
  BigEndianReader in(bytes);
  in.skip(kFingerprintBytes + kIdentityBytes + 5 * 8);
  const std::uint32_t stages = get_list_length(in);
  skip_texts(in, stages);
  in.skip(std::uint64_t{3} * 4 * stages);
  const std::uint32_t causes = get_list_length(in);
  skip_texts(in, causes);
  in.skip(std::uint64_t{8} * causes);
  const std::uint32_t containers = get_list_length(in);
  skip_texts(in, containers);
  in.skip(std::uint64_t{2} * 8 * containers);
  in.skip(kChecksumBytes);
  return ends_here(in);
}

bool stored_adds_up(Bytes bytes) {
  BigEndianReader in(bytes);
  in.skip(kFingerprintBytes + kIdentityBytes + 1 + 3 * 8);
  in.skip(std::uint64_t{2} * 8 * in.get<std::uint32_t>());
  in.skip(std::uint64_t{2} * 4 * in.get<std::uint32_t>());
  in.skip(in.get<std::uint32_t>());
  in.skip(kChecksumBytes);
  return ends_here(in);
}

std::size_t bitmap_bytes(std::size_t bits) { return (bits + 7) / 8; }

/// Takes a keyframe's bits off the front of `bits`; empty if there are not so many, or bits that
/// stand for no piece.
std::vector<bool> take_bitmap(Bytes& bits, std::size_t pieces) {
  const std::size_t bytes = bitmap_bytes(pieces);
  if (pieces > wire::kMaxMissingBits || bytes > bits.size()) return {};
  std::vector<bool> bitmap(bytes * 8);
  for (std::size_t i = 0; i < bitmap.size(); ++i) bitmap[i] = (bits[i / 8] >> (i % 8) & 1U) != 0;
  bits = bits.subspan(bytes);
  const bool clean = std::find(bitmap.begin() + static_cast<std::ptrdiff_t>(pieces), bitmap.end(),
                               true) == bitmap.end();
  bitmap.resize(pieces);
  return clean ? bitmap : std::vector<bool>{};
}

bool ranges_are_possible(const unimapper_wire::stored_t& in) {
  std::int64_t last = in.first;
  for (std::size_t i = 0; i < in.begin.size(); ++i) {
    if (in.begin[i] < last || in.end[i] <= in.begin[i]) return false;
    last = in.end[i];
  }
  return last <= in.until;
}

}  // namespace

std::vector<std::uint8_t> encode(const SessionMessage& message) {
  if (!is_session_name(message.info.name)) {
    throw std::invalid_argument("\"" + message.info.name + "\" cannot name a session");
  }
  unimapper_wire::session_t out;
  put_id(message.info.id, out);
  out.name = message.info.name;
  out.sensor = to_text(message.info.sensor, kMaxTextBytes);
  out.state = static_cast<std::int8_t>(message.state);
  out.keyframes = static_cast<std::int64_t>(message.keyframes);
  out.keyframes_dropped = static_cast<std::int64_t>(message.keyframes_dropped);
  return encode_generated(out);
}

std::optional<SessionMessage> decode_session(Bytes bytes) {
  unimapper_wire::session_t in;
  if (!session_adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  const bool possible = is_session_name(in.name) && is_text(in.sensor, kMaxTextBytes) &&
                        in.state >= in.STARTED && in.state <= in.ENDED && in.keyframes >= 0 &&
                        in.keyframes_dropped >= 0 && in.keyframes_dropped <= in.keyframes;
  if (!possible) return std::nullopt;
  SessionMessage message;
  message.info = {id_of(in), in.name, in.sensor};
  message.state = static_cast<SessionState>(in.state);
  message.keyframes = static_cast<std::uint64_t>(in.keyframes);
  message.keyframes_dropped = static_cast<std::uint64_t>(in.keyframes_dropped);
  return message;
}

std::vector<std::uint8_t> encode(const ChunkMessage& message) {
  unimapper_wire::chunk_t out;
  put_id(message.session, out);
  out.sequence = static_cast<std::int32_t>(message.sequence);
  out.index = static_cast<std::int32_t>(message.index);
  out.count = static_cast<std::int32_t>(message.count);
  out.total_bytes = static_cast<std::int32_t>(message.total_bytes);
  out.payload_crc32 = static_cast<std::int32_t>(message.payload_crc32);
  out.size = static_cast<std::int32_t>(message.data.size());
  out.data = message.data;
  return encode_generated(out);
}

std::optional<ChunkMessage> decode_chunk(Bytes bytes) {
  unimapper_wire::chunk_t in;
  if (!chunk_adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  ChunkMessage message;
  message.session = id_of(in);
  message.sequence = static_cast<std::uint32_t>(in.sequence);
  message.index = static_cast<std::uint32_t>(in.index);
  message.count = static_cast<std::uint32_t>(in.count);
  message.total_bytes = static_cast<std::uint32_t>(in.total_bytes);
  message.payload_crc32 = static_cast<std::uint32_t>(in.payload_crc32);
  message.data = std::move(in.data);
  return is_possible(message) ? std::optional(std::move(message)) : std::nullopt;
}

std::vector<std::uint8_t> encode(const HealthMessage& message) {
  unimapper_wire::health_t out;
  put_id(message.session, out);
  out.scans = static_cast<std::int64_t>(message.scans);
  out.keyframes = static_cast<std::int64_t>(message.keyframes);
  out.points_in = static_cast<std::int64_t>(message.points_in);
  out.bytes_sent = static_cast<std::int64_t>(message.bytes_sent);
  out.deadline_misses = static_cast<std::int64_t>(message.deadline_misses);
  for (const HealthMessage::Stage& stage : message.stages) {
    if (out.stage.size() == kMaxListEntries) break;
    out.stage.push_back(to_text(stage.name, kMaxTextBytes));
    out.p50_ms.push_back(stage.p50_ms);
    out.p99_ms.push_back(stage.p99_ms);
    out.max_ms.push_back(stage.max_ms);
  }
  for (const HealthMessage::Drop& drop : message.drops) {
    if (out.cause.size() == kMaxListEntries) break;
    out.cause.push_back(to_text(drop.cause, kMaxTextBytes));
    out.dropped.push_back(static_cast<std::int64_t>(drop.count));
  }
  for (const HealthMessage::Container& container : message.containers) {
    if (out.container.size() == kMaxListEntries) break;
    out.container.push_back(to_text(container.name, kMaxTextBytes));
    out.used.push_back(static_cast<std::int64_t>(container.used));
    out.capacity.push_back(static_cast<std::int64_t>(container.capacity));
  }
  out.stages = static_cast<std::int32_t>(out.stage.size());
  out.causes = static_cast<std::int32_t>(out.cause.size());
  out.containers = static_cast<std::int32_t>(out.container.size());
  return encode_generated(out);
}

std::optional<HealthMessage> decode_health(Bytes bytes) {
  unimapper_wire::health_t in;
  if (!health_adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  HealthMessage message;
  message.session = id_of(in);
  message.scans = static_cast<std::uint64_t>(in.scans);
  message.keyframes = static_cast<std::uint64_t>(in.keyframes);
  message.points_in = static_cast<std::uint64_t>(in.points_in);
  message.bytes_sent = static_cast<std::uint64_t>(in.bytes_sent);
  message.deadline_misses = static_cast<std::uint64_t>(in.deadline_misses);
  for (std::size_t i = 0; i < in.stage.size(); ++i) {
    if (!is_text(in.stage[i], kMaxTextBytes)) return std::nullopt;
    message.stages.push_back({in.stage[i], in.p50_ms[i], in.p99_ms[i], in.max_ms[i]});
  }
  for (std::size_t i = 0; i < in.cause.size(); ++i) {
    if (!is_text(in.cause[i], kMaxTextBytes)) return std::nullopt;
    message.drops.push_back({in.cause[i], static_cast<std::uint64_t>(in.dropped[i])});
  }
  for (std::size_t i = 0; i < in.container.size(); ++i) {
    if (!is_text(in.container[i], kMaxTextBytes)) return std::nullopt;
    message.containers.push_back({in.container[i], static_cast<std::uint64_t>(in.used[i]),
                                  static_cast<std::uint64_t>(in.capacity[i])});
  }
  return message;
}

std::vector<std::uint8_t> encode(const StoredMessage& message) {
  unimapper_wire::stored_t out;
  put_id(message.session, out);
  out.ended = message.ended ? 1 : 0;
  out.below = static_cast<std::int64_t>(message.below);
  out.first = static_cast<std::int64_t>(message.first);
  out.until = static_cast<std::int64_t>(message.until);
  for (const wire::SequenceRange& range : message.ranges) {
    out.begin.push_back(static_cast<std::int64_t>(range.begin));
    out.end.push_back(static_cast<std::int64_t>(range.end));
  }
  for (const wire::IncompleteKeyframe& keyframe : message.incomplete) {
    out.sequence.push_back(static_cast<std::int32_t>(keyframe.sequence));
    out.pieces.push_back(static_cast<std::int32_t>(keyframe.missing.size()));
    std::vector<std::uint8_t> bitmap(bitmap_bytes(keyframe.missing.size()));
    for (std::size_t i = 0; i < keyframe.missing.size(); ++i) {
      const unsigned bit = keyframe.missing[i] ? 1U : 0U;
      bitmap[i / 8] = static_cast<std::uint8_t>(bitmap[i / 8] | bit << (i % 8));
    }
    out.missing.insert(out.missing.end(), bitmap.begin(), bitmap.end());
  }
  out.ranges = static_cast<std::int32_t>(out.begin.size());
  out.incomplete = static_cast<std::int32_t>(out.sequence.size());
  out.missing_bytes = static_cast<std::int32_t>(out.missing.size());
  return encode_generated(out);
}

std::optional<StoredMessage> decode_stored(Bytes bytes) {
  unimapper_wire::stored_t in;
  if (!stored_adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  constexpr std::int64_t kAllSequences = std::int64_t{1} << 32U;
  const bool possible = (in.ended == 0 || in.ended == 1) && in.below >= 0 && in.below <= in.first &&
                        in.first <= in.until && in.until <= kAllSequences &&
                        in.begin.size() <= wire::kMaxStoredRanges && ranges_are_possible(in) &&
                        in.sequence.size() <= wire::kMaxIncomplete;
  if (!possible) return std::nullopt;
  StoredMessage message;
  message.session = id_of(in);
  message.ended = in.ended == 1;
  message.below = static_cast<std::uint64_t>(in.below);
  message.first = static_cast<std::uint64_t>(in.first);
  message.until = static_cast<std::uint64_t>(in.until);
  for (std::size_t i = 0; i < in.begin.size(); ++i) {
    message.ranges.push_back(
        {static_cast<std::uint64_t>(in.begin[i]), static_cast<std::uint64_t>(in.end[i])});
  }
  Bytes bits = in.missing;
  for (std::size_t i = 0; i < in.sequence.size(); ++i) {
    const auto pieces = static_cast<std::uint32_t>(in.pieces[i]);
    message.incomplete.push_back(
        {static_cast<std::uint32_t>(in.sequence[i]), take_bitmap(bits, pieces)});
    if (message.incomplete.back().missing.empty()) return std::nullopt;
  }
  return bits.empty() ? std::optional(std::move(message)) : std::nullopt;
}

}  // namespace unimapper::lcm_port
