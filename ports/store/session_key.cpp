#include "ports/store/session_key.hpp"

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

constexpr std::size_t kKeyBytes = 20;

}  // namespace

std::vector<std::uint8_t> to_key(const SessionId& id) {
  std::vector<std::uint8_t> key;
  wire::BigEndianWriter writer(key);
  writer.put(id.robot);
  writer.put(id.boot.high);
  writer.put(id.boot.low);
  return key;
}

std::optional<SessionId> from_key(std::span<const std::uint8_t> key) {
  if (key.size() != kKeyBytes) return std::nullopt;
  wire::BigEndianReader reader(key);
  SessionId id;
  id.robot = reader.get<std::uint32_t>();
  id.boot.high = reader.get<std::uint64_t>();
  id.boot.low = reader.get<std::uint64_t>();
  return id;
}

}  // namespace unimapper::store
