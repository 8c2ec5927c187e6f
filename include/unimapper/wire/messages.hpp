// Messages between robot and base station, whatever carries them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/session_id.hpp"

namespace unimapper::wire {

enum class SessionState : std::int8_t { kStarted = 0, kRunning = 1, kEnded = 2 };

/// Who sends and how far it is.
struct SessionMessage {
  SessionInfo info;
  SessionState state = SessionState::kStarted;
  std::uint64_t keyframes = 0;          ///< made so far
  std::uint64_t keyframes_dropped = 0;  ///< of which never sent
};

/// One piece of an encoded keyframe.
struct ChunkMessage {
  SessionId session;
  std::uint32_t sequence = 0;       ///< of the keyframe within its session
  std::uint32_t index = 0;          ///< of this piece
  std::uint32_t count = 0;          ///< pieces of the keyframe
  std::uint32_t total_bytes = 0;    ///< of the keyframe
  std::uint32_t payload_crc32 = 0;  ///< of the keyframe
  std::vector<std::uint8_t> data;
};

/// How the pipeline is doing since its start.
struct HealthMessage {
  /// Time of one pipeline stage per keyframe.
  struct Stage {
    std::string name;
    float p50_ms = 0.0F;
    float p99_ms = 0.0F;
    float max_ms = 0.0F;
  };
  /// What was dropped, by cause.
  struct Drop {
    std::string cause;
    std::uint64_t count = 0;
  };
  /// How full a container of fixed capacity was at most.
  struct Container {
    std::string name;
    std::uint64_t used = 0;
    std::uint64_t capacity = 0;
  };
  /// Work given up for want of time.
  struct Shed {
    std::string what;
    std::uint64_t count = 0;
  };
  SessionId session;
  std::uint64_t scans = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t points_in = 0;
  std::uint64_t bytes_sent = 0;
  std::uint64_t deadline_misses = 0;  ///< keyframes that took longer than they may
  std::vector<Stage> stages;          ///< at most 64, as all lists
  std::vector<Drop> drops;
  std::vector<Container> containers;
  std::vector<Shed> sheds;
};

/// True for names that are safe as file names: 1 to 64 letters, digits, '.', '_' or '-', the
/// first of them no dot.
bool is_session_name(std::string_view name);
/// The nearest session name: every other character becomes '_'.
std::string to_session_name(std::string_view text);

/// False if no keyframe has such a piece: every piece but the last holds the same number of bytes,
/// and together they hold them all.
bool is_possible(const ChunkMessage& piece);

}  // namespace unimapper::wire
