// Fuzz target of the receiver: it keeps its limits and its counts are consistent, a victim's
// keyframe arrives as it was sent, and a sender survives whatever it is told, also of its place in
// the base's map.
//
// Checksums and type fingerprints are corrected where the input says so, because random ones would
// be rejected at once.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unimapper_wire/chunk_t.hpp>
#include <unimapper_wire/health_t.hpp>
#include <unimapper_wire/map_pose_t.hpp>
#include <unimapper_wire/probe_t.hpp>
#include <unimapper_wire/receipt_t.hpp>
#include <unimapper_wire/session_t.hpp>
#include <unimapper_wire/stored_t.hpp>
#include <vector>

#include "ports/lcm/latest_map_pose.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/pacing.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper::wire;
using unimapper::SessionId;
using namespace unimapper::lcm_port;
using unimapper::fuzz::require;

/// Overwrites fingerprint and checksum with those a message of this type has.
void make_fit(std::vector<std::uint8_t>& message, std::int64_t fingerprint) {
  if (message.size() < 12) return;
  std::vector<std::uint8_t> head;
  BigEndianWriter(head).put(fingerprint);
  std::copy(head.begin(), head.end(), message.begin());
  message.resize(message.size() - 4);
  BigEndianWriter(message).put(crc32(message));
}

void send_whole(Receiver& receiver, std::vector<std::uint8_t> bytes, std::uint32_t sequence) {
  EncodedKeyframe keyframe;
  keyframe.sequence = sequence;
  keyframe.bytes = std::move(bytes);
  for (const auto& piece : cut_into_messages(keyframe, kSmallestDatagramBytes)) {
    receive(receiver, kKeyframeChannel, piece);
  }
}

const SessionId kVictim{7, {0x1122334455667788, 0x99AABBCCDDEEFF00}};

/// A robot keeps only possible places, the newest of its own.
void take_map_pose(LatestMapPose& kept, const std::vector<std::uint8_t>& message) {
  const auto before = kept.latest();
  kept.take(decode_map_pose(message), {});
  if (!kept.latest()) return;
  const MapPoseMessage& at = kept.latest()->message;
  require(at.session == kVictim && at.T_map_odometry.is_rigid() && position_sigma_m(at) >= 0.0);
  require(decode_map_pose(encode(at)).has_value());
  require(!before || at.epoch >= before->message.epoch);
}

/// More in one input find nothing that fewer do not, only slower.
constexpr int kMostMessages = 32;
constexpr int kMostWhole = 2;
constexpr std::size_t kRestOfMapPose = 256;

/// The first two keyframes of a robot, as pieces.
const std::vector<std::vector<std::uint8_t>>& victims_pieces(std::uint32_t sequence) {
  static const auto make = [](std::uint32_t number) {
    unimapper::KeyframeRecord record;
    record.session = kVictim;
    record.sequence = number;
    record.scans.resize(1);
    EncodedKeyframe keyframe{kVictim, number, 0, encode_keyframe(record)};
    return cut_into_messages(keyframe, kSmallestDatagramBytes);
  };
  static const std::array all{make(0), make(1)};
  return all.at(sequence);
}

void send_victims(Receiver& receiver, std::uint32_t sequence) {
  for (const auto& piece : victims_pieces(sequence)) receive(receiver, kKeyframeChannel, piece);
}

/// Whatever came before, what the robot sends again is taken; the first keyframe is there still.
void check_victim(Receiver& receiver) {
  send_victims(receiver, 1);
  const auto progress = receiver.progress();
  require(std::any_of(progress.begin(), progress.end(), [](const auto& session) {
    return session.info.id == kVictim && session.received >= 2;
  }));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReceiverLimits limits;
  limits.max_sessions = 4;
  limits.max_pending_keyframes = 4;
  limits.max_pending_bytes = 4096;
  limits.max_keyframe_bytes = 65536;
  Receiver receiver(limits);
  send_victims(receiver, 0);
  Outbox outbox(0);
  for (std::uint32_t sequence = 0; sequence < 8; ++sequence) {
    outbox.add(sequence, 9, sequence % 4);
  }
  Pacing pacing({1000.0, 50000.0, 20000.0});
  for (std::int64_t i = 1; i <= 8; ++i) {
    pacing.sent(100.0);
    (void)pacing.probe(i);
  }
  LatestMapPose map_pose(kVictim);
  // Each message: what to do with it, its length, its bytes.
  int whole = 0;
  int messages = 0;
  for (std::size_t at = 0; at + 2 < size && messages < kMostMessages; ++messages) {
    const std::uint8_t kind = data[at];
    const std::size_t length = std::min<std::size_t>(data[at + 1], size - at - 2);
    std::vector<std::uint8_t> message(data + at + 2, data + at + 2 + length);
    at += 2 + length;
    const bool fit = (kind & 8U) != 0;
    switch (kind & 7U) {
      case 0:
        if (fit) make_fit(message, unimapper_wire::session_t::getHash());
        receive(receiver, kSessionChannel, message);
        break;
      case 1:
        if (fit) make_fit(message, unimapper_wire::health_t::getHash());
        receive(receiver, kHealthChannel, message);
        break;
      case 2:
        if (!fit) {
          receive(receiver, "OTHER", message);
          break;
        }
        // Longer than a byte says: what follows is its end.
        message.insert(message.end(), data + at, data + std::min(size, at + kRestOfMapPose));
        make_fit(message, unimapper_wire::map_pose_t::getHash());
        take_map_pose(map_pose, message);
        break;
      case 3:
        // Whatever is left of the input as a keyframe in proper pieces.
        if (whole++ < kMostWhole) send_whole(receiver, {data + at, data + size}, kind >> 4U);
        break;
      case 4:
        if (fit) make_fit(message, unimapper_wire::stored_t::getHash());
        if (const auto stored = decode_stored(message)) (void)outbox.take(*stored, 1);
        for (int i = 0; i < 20 && outbox.next(); ++i) outbox.sent(*outbox.next(), 0);
        break;
      case 5:
        if (fit) make_fit(message, unimapper_wire::probe_t::getHash());
        if (const auto probe = decode_probe(message)) receiver.receive(*probe, ProbeArrival{1, 1});
        require(receiver.take_receipts(1, 1000000, 2).size() <= 8 * limits.max_sessions);
        break;
      case 6:
        if (fit) make_fit(message, unimapper_wire::receipt_t::getHash());
        if (const auto receipt = decode_receipt(message)) (void)pacing.take(*receipt, 100);
        pacing.advance(static_cast<std::int64_t>(at) * 1000000000);
        require(pacing.rate() >= 1000.0 && pacing.rate() <= 50000.0);
        break;
      default:
        if (fit) make_fit(message, unimapper_wire::chunk_t::getHash());
        receive(receiver, kKeyframeChannel, message);
    }
  }
  check_victim(receiver);
  const ReceiverCounters counters = receiver.counters();
  require(receiver.progress().size() <= limits.max_sessions);
  std::uint64_t keyframes = 0;
  for (const auto& session : receiver.take_sessions()) {
    keyframes += session.keyframes.size();
    require(is_session_name(session.info.name));
  }
  require(keyframes == counters.keyframes);
  return 0;
}
