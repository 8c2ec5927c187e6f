#include "unimapper/wire/pieces.hpp"

#include <algorithm>
#include <stdexcept>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::wire {

namespace {

/// With 128 keypoints.
constexpr std::size_t kUsualSummaryBytes = 3618;

/// A summary in a larger piece would take much of its keyframe along: after an outage a base would
/// be sent more incomplete keyframes at once than it keeps.
constexpr std::uint32_t kLargestLeadingPiece = 4096;

std::uint32_t pieces_of(std::size_t bytes, std::uint32_t piece_bytes) {
  return static_cast<std::uint32_t>((bytes + piece_bytes - 1) / piece_bytes);
}

}  // namespace

std::vector<ChunkMessage> cut_into_pieces(const EncodedKeyframe& keyframe,
                                          std::uint32_t piece_bytes) {
  if (piece_bytes == 0) throw std::invalid_argument("a piece needs at least one byte");
  const std::size_t total = keyframe.bytes.size();
  const std::uint32_t count = pieces_of(total, piece_bytes);
  const std::uint32_t checksum = crc32(keyframe.bytes);
  std::vector<ChunkMessage> pieces(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    ChunkMessage& piece = pieces[i];
    piece.session = keyframe.session;
    piece.sequence = keyframe.sequence;
    piece.index = i;
    piece.count = count;
    piece.total_bytes = static_cast<std::uint32_t>(total);
    piece.payload_crc32 = checksum;
    const std::size_t first = std::size_t{i} * piece_bytes;
    const Bytes data = Bytes(keyframe.bytes).subspan(first);
    const Bytes own = data.first(std::min<std::size_t>(piece_bytes, data.size()));
    piece.data.assign(own.begin(), own.end());
  }
  return pieces;
}

std::uint32_t count_leading_pieces(Bytes keyframe, std::uint32_t piece_bytes) {
  if (piece_bytes > kLargestLeadingPiece) return 0;
  if (keyframe.empty()) return pieces_of(kUsualSummaryBytes, piece_bytes);
  const auto bytes = summary_bytes(keyframe);
  return bytes ? pieces_of(*bytes, piece_bytes) : 0;
}

}  // namespace unimapper::wire
