// LCM encoding of the messages between robot and base station.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/delivery.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

using wire::Bytes;
using wire::ChunkMessage;
using wire::HealthMessage;
using wire::MapPoseMessage;
using wire::ProbeMessage;
using wire::ReceiptMessage;
using wire::SessionMessage;
using wire::SessionState;
using wire::StoredMessage;

inline constexpr std::string_view kSessionChannel = "UNIMAPPER_SESSION";
inline constexpr std::string_view kKeyframeChannel = "UNIMAPPER_KEYFRAME";
inline constexpr std::string_view kHealthChannel = "UNIMAPPER_HEALTH";
inline constexpr std::string_view kProbeChannel = "UNIMAPPER_PROBE";
/// From the base to the robots.
inline constexpr std::string_view kStoredChannel = "UNIMAPPER_STORED";
inline constexpr std::string_view kReceiptChannel = "UNIMAPPER_RECEIPT";
inline constexpr std::string_view kMapPoseChannel = "UNIMAPPER_MAP_POSE";

/// LCM's encoding of a message. Session: throws std::invalid_argument for a name that
/// `is_session_name` rejects.
std::vector<std::uint8_t> encode(const SessionMessage& message);
std::vector<std::uint8_t> encode(const ChunkMessage& message);
std::vector<std::uint8_t> encode(const HealthMessage& message);
std::vector<std::uint8_t> encode(const StoredMessage& message);
std::vector<std::uint8_t> encode(const ProbeMessage& message);
std::vector<std::uint8_t> encode(const ReceiptMessage& message);
/// Of its reason, the first `kMaxMapPoseReasonBytes` characters.
std::vector<std::uint8_t> encode(const MapPoseMessage& message);

/// The message, or nothing if the bytes are none: wrong type or schema version, lengths that do
/// not add up, impossible values, a piece whose checksum fails. Never allocates more than the
/// bytes justify.
std::optional<SessionMessage> decode_session(Bytes bytes);
std::optional<ChunkMessage> decode_chunk(Bytes bytes);
std::optional<HealthMessage> decode_health(Bytes bytes);
std::optional<StoredMessage> decode_stored(Bytes bytes);
std::optional<ProbeMessage> decode_probe(Bytes bytes);
std::optional<ReceiptMessage> decode_receipt(Bytes bytes);
/// The rotation is of exactly unit length then.
std::optional<MapPoseMessage> decode_map_pose(Bytes bytes);

}  // namespace unimapper::lcm_port
