#include "unimapper/wire/pieces.hpp"

#include <algorithm>
#include <stdexcept>

#include "unimapper/wire/checksum.hpp"

namespace unimapper::wire {

std::vector<ChunkMessage> cut_into_pieces(const EncodedKeyframe& keyframe,
                                          std::uint32_t piece_bytes) {
  if (piece_bytes == 0) throw std::invalid_argument("a piece needs at least one byte");
  const std::size_t total = keyframe.bytes.size();
  const std::size_t count = (total + piece_bytes - 1) / piece_bytes;
  const std::uint32_t checksum = crc32(keyframe.bytes);
  std::vector<ChunkMessage> pieces(count);
  for (std::size_t i = 0; i < count; ++i) {
    ChunkMessage& piece = pieces[i];
    piece.session = keyframe.session;
    piece.sequence = keyframe.sequence;
    piece.index = static_cast<std::uint32_t>(i);
    piece.count = static_cast<std::uint32_t>(count);
    piece.total_bytes = static_cast<std::uint32_t>(total);
    piece.payload_crc32 = checksum;
    const std::size_t first = i * piece_bytes;
    const Bytes data = Bytes(keyframe.bytes).subspan(first);
    const Bytes own = data.first(std::min<std::size_t>(piece_bytes, data.size()));
    piece.data.assign(own.begin(), own.end());
  }
  return pieces;
}

}  // namespace unimapper::wire
