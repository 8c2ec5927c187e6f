// LCM encoding of probes and receipts.
#include <unimapper_wire/probe_t.hpp>
#include <unimapper_wire/receipt_t.hpp>

#include "ports/lcm/generated_codec.hpp"
#include "ports/lcm/messages.hpp"

namespace unimapper::lcm_port {

namespace {

/// Both have one length: the fingerprint, 4 bytes for the schema and the robot each, and fields.
constexpr std::size_t kProbeBytes = 8 + 4 + 4 + 16 + 4 + 4 * 8 + 4 + kChecksumBytes;
constexpr std::size_t kReceiptBytes = 8 + 4 + 4 + 16 + 8 + 4 + 4 * 8 + kChecksumBytes;

/// Marks an offset that is not known.
constexpr std::int64_t kUnknown = -1;

}  // namespace

std::vector<std::uint8_t> encode(const ProbeMessage& message) {
  unimapper_wire::probe_t out;
  put_id(message.session, out);
  out.number = static_cast<std::int32_t>(message.number);
  out.robot_time_ns = message.robot_time_ns;
  out.bytes_per_second = static_cast<std::int64_t>(message.bytes_per_second);
  out.base_minus_robot_ns = message.clock ? message.clock->base_minus_robot_ns : 0;
  out.uncertainty_ns = message.clock ? message.clock->uncertainty_ns : kUnknown;
  out.clock_steps = message.clock ? static_cast<std::int32_t>(message.clock->steps) : 0;
  return encode_generated(out);
}

std::optional<ProbeMessage> decode_probe(Bytes bytes) {
  unimapper_wire::probe_t in;
  if (bytes.size() != kProbeBytes || !decode_generated(bytes, in)) return std::nullopt;
  if (in.bytes_per_second < 0 || in.uncertainty_ns < kUnknown) return std::nullopt;
  ProbeMessage message;
  message.session = id_of(in);
  message.number = static_cast<std::uint32_t>(in.number);
  message.robot_time_ns = in.robot_time_ns;
  message.bytes_per_second = static_cast<std::uint64_t>(in.bytes_per_second);
  if (in.uncertainty_ns != kUnknown) {
    message.clock = wire::ClockOffset{in.base_minus_robot_ns, in.uncertainty_ns,
                                      static_cast<std::uint32_t>(in.clock_steps)};
  }
  return message;
}

std::vector<std::uint8_t> encode(const ReceiptMessage& message) {
  unimapper_wire::receipt_t out;
  put_id(message.session, out);
  out.base = static_cast<std::int64_t>(message.base);
  out.number = static_cast<std::int32_t>(message.number);
  out.base_time_ns = message.base_time_ns;
  out.held_ns = message.held_ns;
  out.pieces = static_cast<std::int64_t>(message.pieces);
  out.window_bytes = static_cast<std::int64_t>(message.window_bytes);
  return encode_generated(out);
}

std::optional<ReceiptMessage> decode_receipt(Bytes bytes) {
  unimapper_wire::receipt_t in;
  if (bytes.size() != kReceiptBytes || !decode_generated(bytes, in)) return std::nullopt;
  const bool possible = in.held_ns >= 0 && in.pieces >= 0 &&
                        in.window_bytes >= static_cast<std::int64_t>(wire::kSmallestWindow);
  if (!possible) return std::nullopt;
  ReceiptMessage message;
  message.session = id_of(in);
  message.base = static_cast<std::uint64_t>(in.base);
  message.number = static_cast<std::uint32_t>(in.number);
  message.base_time_ns = in.base_time_ns;
  message.held_ns = in.held_ns;
  message.pieces = static_cast<std::uint64_t>(in.pieces);
  message.window_bytes = static_cast<std::uint64_t>(in.window_bytes);
  return message;
}

}  // namespace unimapper::lcm_port
