#include "ports/lcm/sending.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "ports/lcm/keyframe_codec.hpp"

namespace unimapper::wire {

EncodedKeyframe encode_for_sending(const KeyframeRecord& record) {
  EncodedKeyframe keyframe;
  keyframe.bytes = encode_keyframe(record);
  keyframe.session = record.session;
  keyframe.sequence = record.sequence;
  keyframe.stamp_ns = record.scans.back().stamp_ns;
  return keyframe;
}

std::vector<std::vector<std::uint8_t>> cut_into_messages(const EncodedKeyframe& keyframe,
                                                         std::uint32_t datagram_bytes) {
  if (datagram_bytes < kSmallestDatagramBytes || datagram_bytes > kLargestDatagramBytes) {
    throw std::invalid_argument("a datagram needs " + std::to_string(kSmallestDatagramBytes) +
                                " to " + std::to_string(kLargestDatagramBytes) + " bytes, not " +
                                std::to_string(datagram_bytes));
  }
  const std::size_t step = datagram_bytes - kDatagramOverheadBytes;
  const std::size_t total = keyframe.bytes.size();
  ChunkMessage chunk;
  chunk.session = keyframe.session;
  chunk.sequence = keyframe.sequence;
  chunk.count = static_cast<std::uint32_t>((total + step - 1) / step);
  chunk.total_bytes = static_cast<std::uint32_t>(total);
  chunk.payload_crc32 = crc32(keyframe.bytes);
  std::vector<std::vector<std::uint8_t>> messages;
  messages.reserve(chunk.count);
  for (; chunk.index < chunk.count; ++chunk.index) {
    const std::size_t first = chunk.index * step;
    const std::size_t last = std::min(first + step, total);
    chunk.data.assign(keyframe.bytes.begin() + static_cast<std::ptrdiff_t>(first),
                      keyframe.bytes.begin() + static_cast<std::ptrdiff_t>(last));
    messages.push_back(encode(chunk));
  }
  return messages;
}

}  // namespace unimapper::wire
