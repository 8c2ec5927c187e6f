#include "ports/store/session_key.hpp"

namespace unimapper::store {

namespace {

constexpr std::size_t kRobotBytes = 4;
constexpr std::size_t kKeyBytes = 12;

}  // namespace

std::vector<std::uint8_t> to_key(const SessionId& id) {
  std::vector<std::uint8_t> key(kKeyBytes);
  for (std::size_t i = 0; i < kKeyBytes; ++i) {
    const bool is_robot = i < kRobotBytes;
    const std::uint64_t number = is_robot ? id.robot : id.session;
    key[i] = static_cast<std::uint8_t>(number >> (8 * (is_robot ? i : i - kRobotBytes)));
  }
  return key;
}

std::optional<SessionId> from_key(std::span<const std::uint8_t> key) {
  if (key.size() != kKeyBytes) return std::nullopt;
  SessionId id;
  for (std::size_t i = kKeyBytes; i-- > kRobotBytes;) id.session = id.session << 8U | key[i];
  for (std::size_t i = kRobotBytes; i-- > 0;) id.robot = id.robot << 8U | key[i];
  return id;
}

}  // namespace unimapper::store
