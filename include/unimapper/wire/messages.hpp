// Messages between robot and base station, whatever carries them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/session_id.hpp"
#include "unimapper/wire/link_report.hpp"

namespace unimapper::wire {

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
