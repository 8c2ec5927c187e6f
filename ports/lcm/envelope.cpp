#include "ports/lcm/envelope.hpp"

#include <unimapper_wire/authenticated_t.hpp>

namespace unimapper::lcm_port {

using unimapper_wire::authenticated_t;
using wire::BigEndianReader;
using wire::BigEndianWriter;

bool is_envelope(Bytes datagram) {
  return BigEndianReader(datagram).get<std::int64_t>() == authenticated_t::getHash();
}

std::optional<Envelope> read_envelope(Bytes datagram) {
  BigEndianReader in(datagram);
  if (in.get<std::int64_t>() != authenticated_t::getHash()) return std::nullopt;
  if (in.get<std::int32_t>() != authenticated_t::SCHEMA_VERSION) return std::nullopt;
  Envelope envelope;
  envelope.robot = in.get<std::uint32_t>();
  envelope.boot.high = in.get<std::uint64_t>();
  envelope.boot.low = in.get<std::uint64_t>();
  envelope.number = in.get<std::uint64_t>();
  envelope.message = in.get_bytes(in.get<std::uint32_t>());
  const std::size_t signed_bytes = in.position();
  envelope.code = in.get_bytes(kCodeBytes);
  if (!in.ok() || in.remaining() != 0) return std::nullopt;
  envelope.signed_bytes = datagram.first(signed_bytes);
  return envelope;
}

std::vector<std::uint8_t> write_envelope(const Envelope& envelope) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kEnvelopeBytes + envelope.message.size());
  BigEndianWriter out(bytes);
  out.put(authenticated_t::getHash());
  out.put(std::int32_t{authenticated_t::SCHEMA_VERSION});
  out.put(envelope.robot);
  out.put(envelope.boot.high);
  out.put(envelope.boot.low);
  out.put(envelope.number);
  out.put(static_cast<std::uint32_t>(envelope.message.size()));
  out.put(envelope.message);
  return bytes;
}

std::optional<std::uint32_t> robot_of(Bytes message) {
  // Every type starts with its fingerprint, its schema version and the robot.
  BigEndianReader in(message);
  in.skip(8 + 4);
  const auto robot = in.get<std::uint32_t>();
  return in.ok() ? std::optional(robot) : std::nullopt;
}

}  // namespace unimapper::lcm_port
