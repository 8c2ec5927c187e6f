#include "ports/lcm/sending.hpp"

#include <stdexcept>
#include <string>

#include "ports/lcm/messages.hpp"

namespace unimapper::lcm_port {

namespace {

std::uint32_t piece_bytes(std::uint32_t datagram_bytes) {
  if (datagram_bytes < kSmallestDatagramBytes || datagram_bytes > kLargestDatagramBytes) {
    throw std::invalid_argument("a datagram needs " + std::to_string(kSmallestDatagramBytes) +
                                " to " + std::to_string(kLargestDatagramBytes) + " bytes, not " +
                                std::to_string(datagram_bytes));
  }
  return datagram_bytes - kDatagramOverheadBytes;
}

}  // namespace

std::uint32_t count_messages(std::size_t keyframe_bytes, std::uint32_t datagram_bytes) {
  const std::size_t piece = piece_bytes(datagram_bytes);
  return static_cast<std::uint32_t>((keyframe_bytes + piece - 1) / piece);
}

std::uint32_t count_leading_messages(wire::Bytes keyframe, std::uint32_t datagram_bytes) {
  return wire::count_leading_pieces(keyframe, piece_bytes(datagram_bytes));
}

std::vector<std::vector<std::uint8_t>> cut_into_messages(const EncodedKeyframe& keyframe,
                                                         std::uint32_t datagram_bytes) {
  const auto pieces = wire::cut_into_pieces(keyframe, piece_bytes(datagram_bytes));
  std::vector<std::vector<std::uint8_t>> messages;
  messages.reserve(pieces.size());
  for (const ChunkMessage& piece : pieces) messages.push_back(encode(piece));
  return messages;
}

}  // namespace unimapper::lcm_port
