// Bytes of random keyframes, and a receiver's counters in a storm of messages
#include "expected_text.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"
#include "tilted_town.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "wire_words.hpp"

using namespace unimapper;
using namespace unimapper::regression;
using namespace unimapper::wire;
namespace stream = unimapper::wire::wire_test;
using stream::random_record;

namespace {

/// A random keyframe with values at and beyond what the wire can hold.
KeyframeRecord extreme_record(std::uint64_t seed) {
  KeyframeRecord record = random_record(seed, 120);
  stream::Random random(mix_bits(seed + 1000));
  const float extremes[] = {0.0F,
                            -0.0F,
                            0.005F,
                            -0.005F,
                            0.0049999F,
                            327.67F,
                            327.675F,
                            -327.68F,
                            -327.685F,
                            1e9F,
                            -1e30F,
                            2.5599F,
                            std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN()};
  const auto any = [&] { return extremes[random.below(14)]; };
  const std::uint16_t points[] = {0, 1, 254, 255, 256, 65535};
  for (int i = 0; i < 60; ++i) {
    // One by one: compilers evaluate arguments in different orders.
    FineCell cell{};
    cell.position.x() = any();
    cell.position.y() = any();
    cell.position.z() = any();
    cell.points = points[random.below(6)];
    cell.ground = static_cast<std::uint8_t>(random.below(2));
    (i % 2 == 0 ? record.static_cells : record.dynamic_cells).push_back(cell);
  }
  const float millimetres[] = {0.0005F, 0.00049F, -0.0005F, 32.7675F, -32.768F, 150.5F, 1e7F};
  for (int i = 0; i < 30; ++i) {
    Keypoint keypoint{};
    for (int axis = 0; axis < 3; ++axis) keypoint.position(axis) = millimetres[random.below(7)];
    keypoint.normal = Eigen::Vector3f::Zero();
    keypoint.normal(static_cast<int>(random.below(3))) = random.below(2) == 0 ? 1.0F : -1.0F;
    if (i % 10 == 9) keypoint.normal.setZero();
    keypoint.occupancy = i % 3 == 0 ? ~std::uint64_t{0} : random.bits();
    keypoint.strength = i % 4 == 0 ? std::uint16_t{65535} : std::uint16_t{0};
    record.keypoints.push_back(keypoint);
  }
  if (seed % 2 == 0) record.sequence = std::numeric_limits<std::uint32_t>::max();
  record.points_in = std::numeric_limits<std::uint64_t>::max();
  // Poses of the same bits everywhere: the bytes hold all of them.
  const auto any_pose = [&] {
    const auto x = static_cast<std::int64_t>(random.below(60)) - 30;
    const auto y = static_cast<std::int64_t>(random.below(60)) - 30;
    const auto z = static_cast<std::int64_t>(random.below(200)) - 100;
    Pose pose;
    pose.rotation = whole_rotation(70, x, y, z);
    for (int axis = 0; axis < 3; ++axis) {
      pose.translation(axis) = (static_cast<double>(random.below(2000000)) - 1e6) / 512.0;
    }
    return pose;
  };
  record.T_odometry_keyframe = any_pose();
  for (KeyframeScan& scan : record.scans) scan.T_odometry_sensor = any_pose();
  return record;
}

std::string record_text(const KeyframeRecord& record) {
  std::string text =
      line_of("keyframe", record.session.robot, wire::to_text(record.session.boot), record.sequence,
              "reference", record.reference_scan, record.T_odometry_keyframe, up_text(record.up),
              "points", record.points_in, record.points_dynamic, "left out", record.left_out) +
      "  static " + cells_text(record.static_cells) + "\n  dynamic " +
      cells_text(record.dynamic_cells) + "\n";
  text += keypoints_text(record.keypoints);
  for (const CodedImage& image : record.images) {
    text += line_of("  image", image.scan, image.code.size(), checksum(image.code));
  }
  for (const KeyframeScan& scan : record.scans) {
    text += line_of("  scan", scan.scan_index, scan.stamp_ns, scan.T_odometry_sensor);
  }
  return text;
}

std::string receiver_text(const Receiver& receiver) {
  std::string text = counters_text(receiver.counters());
  for (const SessionProgress& one : receiver.progress()) {
    text += line_of("  progress", one.info.name, one.info.sensor, one.ended ? "ended" : "running",
                    one.whole ? "whole" : "not whole", one.announced, one.received,
                    one.health ? "scans " + count(one.health->scans) : "no health");
  }
  return text;
}

}  // namespace

TEST_CASE("bytes of keyframes with extreme values, as before on every platform", "[regression]") {
  std::string text;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const KeyframeRecord record = extreme_record(seed);
    const std::vector<std::uint8_t> bytes = encode_keyframe(record);
    const DecodedKeyframe decoded = decode_keyframe(bytes);
    REQUIRE(decoded.record);
    CHECK(encode_keyframe(*decoded.record) == bytes);
    text += line_of("bytes", bytes.size(), checksum(bytes)) + record_text(*decoded.record);
  }
  check_expected("wire_bytes", text);
}

TEST_CASE("a storm of messages, as before on every platform", "[regression]") {
  std::string text;
  for (std::uint64_t storm = 0; storm < 5; ++storm) {
    stream::Random random(mix_bits(storm));
    ReceiverLimits limits;
    limits.max_sessions = 4;
    limits.max_keyframe_bytes = 6000;
    limits.max_pending_keyframes = storm % 2 == 0 ? 30 : 9;
    limits.max_pending_bytes = 60000;
    limits.max_stored_bytes = 220000;
    std::vector<stream::Message> messages;
    for (std::uint32_t s = 0; s < 6; ++s) {
      const SessionInfo info{{s, 100 + s},
                             s < 2 ? std::string("twin") : "robot-" + std::to_string(s),
                             s % 2 == 0 ? "os1-64" : "avia"};
      messages.push_back(stream::session_message(info, SessionState::kStarted, 0));
      for (std::uint32_t sequence = 0; sequence < 7; ++sequence) {
        const std::uint32_t cells = random.below(4) == 0 ? 900 : 150;
        const EncodedKeyframe keyframe =
            stream::encode_for_sending(stream::keyframe_of(info.id, sequence, cells));
        for (stream::Message& message : stream::pieces_of(keyframe)) {
          auto& piece = std::get<ChunkMessage>(message);
          const std::uint32_t dice = random.below(60);
          if (dice == 0) continue;                   // lost
          if (dice == 1) messages.push_back(piece);  // sent twice
          if (dice == 2)
            piece.data[random.below(static_cast<std::uint32_t>(piece.data.size()))] ^=
                1U;                                 // damaged
          if (dice == 3) piece.payload_crc32 += 1;  // of no keyframe
          messages.push_back(std::move(message));
        }
        if (sequence == 4) {
          HealthMessage health;
          health.session = info.id;
          health.scans = 100 * s + sequence;
          messages.emplace_back(health);
        }
      }
      SessionInfo other = info;
      if (s == 3) other.sensor = "another";
      messages.push_back(stream::session_message(other, SessionState::kEnded, 9, s == 2 ? 2 : 0));
    }
    // Each is overtaken by at most 25 others.
    for (std::size_t i = messages.size(); i > 1; --i) {
      const auto reach = static_cast<std::uint32_t>(std::min<std::size_t>(i, 25));
      std::swap(messages[i - 1], messages[i - 1 - random.below(reach)]);
    }
    Receiver receiver(limits);
    stream::feed(receiver, messages);
    receiver.count_malformed();
    receiver.count_foreign();
    text += line_of("storm", storm, "of", messages.size()) + receiver_text(receiver);
    for (const SessionData& session : receiver.take_sessions()) {
      text += join("session", session.info.name, session.complete ? "complete" : "incomplete",
                   "missing", session.keyframes_missing, "damaged", session.keyframes_damaged,
                   "keyframes");
      for (const KeyframeRecord& keyframe : session.keyframes)
        text += " " + count(keyframe.sequence);
      text += "\n";
    }
    text += receiver_text(receiver);
  }
  check_expected("wire_storm", text);
}
