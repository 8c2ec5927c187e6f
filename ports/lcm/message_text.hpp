// Texts in messages: printable, and of bounded length.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <string>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port {

/// Passes over a string as LCM writes it: its length with the closing zero, then the bytes. Fails
/// `in` for more than `most` characters.
inline void skip_text(wire::BigEndianReader& in, std::size_t most) {
  const auto length = in.get<std::int32_t>();
  const bool plausible = length >= 1 && static_cast<std::size_t>(length) <= most + 1;
  in.skip(plausible ? static_cast<std::uint64_t>(length) : UINT64_MAX);
}

/// Printable ASCII, so that it can be shown without care.
inline bool is_text(const std::string& text, std::size_t most) {
  return text.size() <= most && std::all_of(text.begin(), text.end(), [](char c) {
           return std::isprint(static_cast<unsigned char>(c)) != 0;
         });
}

/// The nearest text of so many characters: others become '_'.
inline std::string to_text(std::string text, std::size_t most) {
  text.resize(std::min(text.size(), most));
  for (char& c : text) c = std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return text;
}

}  // namespace unimapper::lcm_port
