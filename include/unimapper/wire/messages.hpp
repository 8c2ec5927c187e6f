// Messages between robot and base station, whatever carries them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::wire {

/// By how much the base's clock is ahead of the robot's.
struct ClockOffset {
  std::int64_t base_minus_robot_ns = 0;  ///< add it to the robot's time to get the base's
  std::int64_t uncertainty_ns = 0;       ///< the offset is wrong by at most so much
  std::uint32_t steps = 0;               ///< how often either clock was set since the start
};

/// From the robot: asks the base what has arrived so far, and for its time.
struct ProbeMessage {
  SessionId session;                   ///< whose
  std::uint32_t number = 0;            ///< from 1, one more with each probe of the session
  std::int64_t robot_time_ns = 0;      ///< when it was sent, Unix time by the robot's clock
  std::uint64_t bytes_per_second = 0;  ///< at which the robot sends keyframes
  std::optional<ClockOffset> clock;    ///< what is known of the clocks so far
};

/// Windows are never smaller: one datagram of the largest size.
inline constexpr std::uint64_t kSmallestWindow = 65536;

/// From the base: the answer to a probe.
struct ReceiptMessage {
  SessionId session;              ///< whose probe it answers
  std::uint64_t base = 0;         ///< random number of the base's start
  std::uint32_t number = 0;       ///< of the probe
  std::int64_t base_time_ns = 0;  ///< when the probe arrived, Unix time, base's clock
  std::int64_t held_ns = 0;       ///< from then until this was sent
  std::uint64_t pieces = 0;       ///< of the session, arrived before the probe
  std::uint64_t window_bytes = kSmallestWindow;  ///< pieces the robot may have on the way
};

/// When a probe arrived, by the base's clocks.
struct ProbeArrival {
  std::int64_t steady_ns = 0;  ///< of any steady clock
  std::int64_t unix_ns = 0;    ///< Unix time
};

/// How far a base is with the place of a robot; as `merge::LocalisationState`.
enum class MapPoseState : std::int8_t { kNotYet = 0, kAmbiguous = 1, kLocalised = 2 };

inline constexpr std::size_t kMaxMapPoseReasonBytes = 200;

/// From the base: where a robot is in the base's map. Of the robot's own poses it makes such in
/// the map: T_map_sensor = T_map_odometry * T_odometry_sensor.
struct MapPoseMessage {
  SessionId session;           ///< whose place
  std::int64_t epoch = 1;      ///< of the store's map, from 1; the frame is that epoch's map frame
  std::uint32_t sequence = 0;  ///< of the newest keyframe that the answer rests on
  std::int64_t stamp_ns = 0;   ///< of the reference scan of keyframe `sequence`
  MapPoseState state = MapPoseState::kNotYet;  ///< the pose holds only if localised
  Pose T_map_odometry;                         ///< odometry frame to map frame, metres
  /// Of T_map_keyframe = T_map_odometry * T_odometry_keyframe of keyframe `sequence`. Upper
  /// triangle, row by row: translation along the axes of the map (square metres), then the rotation
  /// vector in the keyframe's frame (square radians).
  std::array<double, 21> covariance{};
  std::uint32_t loops = 0;    ///< that support the pose
  double since_loop_m = 0.0;  ///< metres by odometry alone since the latest of them
  std::string reason;  ///< why it is not localised, empty otherwise; printable ASCII, at most
                       ///< `kMaxMapPoseReasonBytes`
};

/// Standard deviation of the keyframe's position along the map's three axes together, metres.
[[nodiscard]] inline double position_sigma_m(const MapPoseMessage& at) {
  constexpr std::size_t kX = 0;
  constexpr std::size_t kY = 6;
  constexpr std::size_t kZ = 11;
  return std::sqrt(at.covariance[kX] + at.covariance[kY] + at.covariance[kZ]);
}

enum class SessionState : std::int8_t { kStarted = 0, kRunning = 1, kEnded = 2 };

/// Who sends and how far it is.
struct SessionMessage {
  SessionInfo info;                             ///< identity and names of the session
  SessionState state = SessionState::kStarted;  ///< how far it is
  std::uint64_t keyframes = 0;                  ///< made so far
  std::uint64_t keyframes_dropped = 0;          ///< keyframes made that were never sent
};

/// One piece of an encoded keyframe.
struct ChunkMessage {
  SessionId session;                ///< the session it belongs to
  std::uint32_t sequence = 0;       ///< of the keyframe within its session
  std::uint32_t index = 0;          ///< of this piece
  std::uint32_t count = 0;          ///< pieces of the keyframe
  std::uint32_t total_bytes = 0;    ///< of the keyframe
  std::uint32_t payload_crc32 = 0;  ///< of the keyframe
  std::vector<std::uint8_t> data;   ///< bytes of the piece
};

/// The container of a health message that is the robot's spool: bytes that no base has stored, of
/// those that the spool may hold.
inline constexpr std::string_view kSpoolContainer = "spool";

/// How the pipeline is doing since its start.
struct HealthMessage {
  /// Time of one pipeline stage per keyframe.
  struct Stage {
    std::string name;     ///< of the stage
    float p50_ms = 0.0F;  ///< median
    float p99_ms = 0.0F;  ///< 99th percentile
    float max_ms = 0.0F;  ///< largest
  };
  /// What was dropped, by cause.
  struct Drop {
    std::string cause;        ///< name of the cause
    std::uint64_t count = 0;  ///< how much was dropped
  };
  /// How full a container of fixed capacity was at most.
  struct Container {
    std::string name;            ///< of the container
    std::uint64_t used = 0;      ///< elements in use at most
    std::uint64_t capacity = 0;  ///< elements there is room for
  };
  SessionId session;                  ///< the session it belongs to
  std::uint64_t scans = 0;            ///< handed to the pipeline
  std::uint64_t keyframes = 0;        ///< closed
  std::uint64_t points_in = 0;        ///< handed to the pipeline
  std::uint64_t bytes_sent = 0;       ///< by the publisher
  std::uint64_t deadline_misses = 0;  ///< keyframes that took longer than they may
  std::vector<Stage> stages;          ///< at most 64, as all lists
  std::vector<Drop> drops;            ///< at most 64
  std::vector<Container> containers;  ///< at most 64
  /// Of the robot's clock, as the base heard last in a probe; not part of the message.
  std::optional<ClockOffset> clock;
};

/// True for names that are safe as file names: 1 to 64 letters, digits, '.', '_' or '-', the
/// first of them no dot.
bool is_session_name(std::string_view name);
/// 32 hexadecimal digits, the highest first.
std::string to_text(const BootId& boot);
/// The nearest session name: every other character becomes '_'.
std::string to_session_name(std::string_view text);

/// False if no keyframe has such a piece: every piece but the last holds the same number of bytes,
/// and together they hold them all.
bool is_possible(const ChunkMessage& piece);

}  // namespace unimapper::wire
