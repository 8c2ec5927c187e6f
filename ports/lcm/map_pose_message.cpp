// LCM encoding of a robot's place in the base's map.
#include <algorithm>
#include <cmath>
#include <unimapper_wire/map_pose_t.hpp>

#include "ports/lcm/generated_codec.hpp"
#include "ports/lcm/message_text.hpp"
#include "ports/lcm/messages.hpp"

namespace unimapper::lcm_port {

using wire::MapPoseState;
using MapPoseWire = unimapper_wire::map_pose_t;

namespace {

/// From the fingerprint to the metres since a loop; the reason and the checksum follow.
constexpr std::size_t kBytesBeforeReason =
    8 + 4 + 4 + 16 + 8 + 4 + 8 + 1 + (3 + 4 + 21) * 8 + 4 + 8;
constexpr double kFarthest_m = 1e8;  // as keyframes' poses
constexpr double kUnitTolerance = 1e-6;

bool map_pose_adds_up(Bytes bytes) {
  wire::BigEndianReader in(bytes);
  in.skip(kBytesBeforeReason);
  skip_text(in, wire::kMaxMapPoseReasonBytes);
  in.skip(kChecksumBytes);
  return in.ok() && in.remaining() == 0;
}

Eigen::Quaterniond quaternion_in(const MapPoseWire& in) {
  return {in.quaternion[3], in.quaternion[0], in.quaternion[1], in.quaternion[2]};
}

/// Finite, and no farther from the origin than any keyframe may be.
bool pose_is_possible(const MapPoseWire& in) {
  const bool is_near =
      std::all_of(std::begin(in.translation), std::end(in.translation),
                  [](double coordinate) { return std::abs(coordinate) <= kFarthest_m; });
  return is_near && std::abs(quaternion_in(in).norm() - 1.0) <= kUnitTolerance;
}

/// Finite, and no variance negative.
bool covariance_is_possible(const MapPoseWire& in) {
  const bool is_finite = std::all_of(std::begin(in.covariance), std::end(in.covariance),
                                     [](double entry) { return std::isfinite(entry); });
  if (!is_finite) return false;
  std::size_t diagonal = 0;
  for (std::size_t left = 6; left > 0; diagonal += left--) {
    if (in.covariance[diagonal] < 0.0) return false;
  }
  return true;
}

bool map_pose_is_possible(const MapPoseWire& in) {
  return in.epoch >= 1 && in.state >= MapPoseWire::NOT_YET && in.state <= MapPoseWire::LOCALISED &&
         pose_is_possible(in) && covariance_is_possible(in) && std::isfinite(in.since_loop_m) &&
         in.since_loop_m >= 0.0 && is_text(in.reason, wire::kMaxMapPoseReasonBytes);
}

}  // namespace

std::vector<std::uint8_t> encode(const MapPoseMessage& message) {
  MapPoseWire out;
  put_id(message.session, out);
  out.epoch = message.epoch;
  out.sequence = static_cast<std::int32_t>(message.sequence);
  out.stamp_ns = message.stamp_ns;
  out.state = static_cast<std::int8_t>(message.state);
  const Eigen::Quaterniond q = message.T_map_odometry.quaternion();
  for (int i = 0; i < 3; ++i) out.translation[i] = message.T_map_odometry.translation[i];
  for (int i = 0; i < 4; ++i) out.quaternion[i] = q.coeffs()[i];
  std::copy(message.covariance.begin(), message.covariance.end(), std::begin(out.covariance));
  out.loops = static_cast<std::int32_t>(message.loops);
  out.since_loop_m = message.since_loop_m;
  out.reason = to_text(message.reason, wire::kMaxMapPoseReasonBytes);
  return encode_generated(out);
}

std::optional<MapPoseMessage> decode_map_pose(Bytes bytes) {
  MapPoseWire in;
  if (!map_pose_adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  if (!map_pose_is_possible(in)) return std::nullopt;
  MapPoseMessage message;
  message.session = id_of(in);
  message.epoch = in.epoch;
  message.sequence = static_cast<std::uint32_t>(in.sequence);
  message.stamp_ns = in.stamp_ns;
  message.state = static_cast<MapPoseState>(in.state);
  message.T_map_odometry = {quaternion_in(in),
                            {in.translation[0], in.translation[1], in.translation[2]}};
  std::copy(std::begin(in.covariance), std::end(in.covariance), message.covariance.begin());
  message.loops = static_cast<std::uint32_t>(in.loops);
  message.since_loop_m = in.since_loop_m;
  message.reason = std::move(in.reason);
  return message;
}

}  // namespace unimapper::lcm_port
