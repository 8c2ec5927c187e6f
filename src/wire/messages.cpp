#include "unimapper/wire/messages.hpp"

#include <algorithm>
#include <cctype>

namespace unimapper::wire {

namespace {

constexpr std::size_t kMaxNameBytes = 64;

bool is_name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
}

}  // namespace

bool is_session_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), is_name_character);
}

std::string to_text(const BootId& boot) {
  constexpr std::string_view kHexadecimal = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t half : {boot.high, boot.low}) {
    for (unsigned shift = 64; shift > 0;) text += kHexadecimal[half >> (shift -= 4U) & 0xFU];
  }
  return text;
}

std::string to_session_name(std::string_view text) {
  std::string name(text.substr(0, kMaxNameBytes));
  if (name.empty()) name = "session";
  for (char& c : name) c = is_name_character(c) ? c : '_';
  if (name.front() == '.') name.front() = '_';
  return name;
}

bool is_possible(const ChunkMessage& piece) {
  if (piece.count == 0 || piece.index >= piece.count || piece.data.empty()) return false;
  const std::uint64_t bytes = piece.data.size();
  if (piece.index + 1 == piece.count) {
    // The others hold at least as much, so the total is bounded from both sides.
    return piece.count == 1 ? piece.total_bytes == bytes
                            : piece.total_bytes >= bytes * piece.count &&
                                  (piece.total_bytes - bytes) % (piece.count - 1) == 0;
  }
  return bytes * (piece.count - 1) < piece.total_bytes && piece.total_bytes <= bytes * piece.count;
}

}  // namespace unimapper::wire
