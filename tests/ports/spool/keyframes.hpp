// Keyframes and folders for tests of the spool.
#pragma once

#include "ports/spool/spool.hpp"
#include "tests/test.hpp"

namespace unimapper::spool::spool_test {

inline const SessionInfo kMonday{{7, 11}, "monday", "os2-128"};
inline const SessionInfo kTuesday{{7, 12}, "tuesday", "os2-128"};

inline constexpr std::chrono::milliseconds kPatience{20000};

/// Bytes that no other keyframe of a test has.
inline EncodedKeyframe keyframe_of(const SessionInfo& info, std::uint32_t sequence,
                                   std::size_t bytes = 2000) {
  EncodedKeyframe keyframe{info.id, sequence, 1000 + sequence, std::vector<std::uint8_t>(bytes)};
  std::uint32_t state = sequence * 2654435761U + static_cast<std::uint32_t>(info.id.robot) +
                        static_cast<std::uint32_t>(info.name.size());
  for (std::uint8_t& byte : keyframe.bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24U);
  }
  return keyframe;
}

/// A spool of the smallest size.
inline SpoolOptions small() {
  SpoolOptions options;
  options.bytes = kSmallestSpoolBytes;
  options.segment_bytes = 100000;
  options.retry_period = std::chrono::milliseconds(10);
  return options;
}

inline void add(Spool& spool, const SessionInfo& info, std::uint32_t begin, std::uint32_t end,
                std::size_t bytes = 2000) {
  for (std::uint32_t i = begin; i < end; ++i) spool.add(info, keyframe_of(info, i, bytes));
}

/// Whether the spool reads back what was added.
inline bool has_equal(Spool& spool, const SessionInfo& info, std::uint32_t sequence,
                      std::size_t bytes = 2000) {
  const auto found = spool.read(info.id, sequence);
  const EncodedKeyframe added = keyframe_of(info, sequence, bytes);
  return found && found->session == info.id && found->sequence == sequence &&
         found->stamp_ns == added.stamp_ns && found->bytes == added.bytes;
}

inline std::vector<std::filesystem::path> segments_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".spool") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

inline std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void write_content(const std::filesystem::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << content;
}

}  // namespace unimapper::spool::spool_test
