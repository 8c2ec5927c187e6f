// Encoding and decoding that all generated messages share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port {

inline constexpr std::size_t kChecksumBytes = 4;

/// Encodes and fills in the checksum, which every message ends with.
template <typename Generated>
std::vector<std::uint8_t> encode_generated(Generated& message) {
  message.crc32 = 0;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bytes.resize(bytes.size() - kChecksumBytes);
  wire::BigEndianWriter(bytes).put(wire::crc32(bytes));
  return bytes;
}

inline bool is_intact(wire::Bytes bytes) {
  if (bytes.size() < kChecksumBytes) return false;
  const wire::Bytes content = bytes.first(bytes.size() - kChecksumBytes);
  return wire::BigEndianReader(bytes.last(kChecksumBytes)).get<std::uint32_t>() ==
         wire::crc32(content);
}

/// Decodes bytes whose lengths are known to add up: lcm-gen's decoders trust the lengths they
/// read and would allocate whatever a forged message asks for.
template <typename Generated>
bool decode_generated(wire::Bytes bytes, Generated& message) {
  return is_intact(bytes) &&
         message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
             static_cast<int>(bytes.size()) &&
         message.schema_version == Generated::SCHEMA_VERSION;
}

/// The identity that every generated message carries.
template <typename Generated>
SessionId id_of(const Generated& in) {
  return {static_cast<std::uint32_t>(in.robot),
          {static_cast<std::uint64_t>(in.boot_high), static_cast<std::uint64_t>(in.boot_low)}};
}

template <typename Generated>
void put_id(const SessionId& id, Generated& out) {
  out.schema_version = Generated::SCHEMA_VERSION;
  out.robot = static_cast<std::int32_t>(id.robot);
  out.boot_high = static_cast<std::int64_t>(id.boot.high);
  out.boot_low = static_cast<std::int64_t>(id.boot.low);
}

}  // namespace unimapper::lcm_port
