// Keyframes that a worker keeps on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ports/store/store_file.hpp"
#include "unimapper/core/ids.hpp"

namespace unimapper::apps {

/// The name of a keyframe's bytes: identity, checksum and size.
std::string keyframe_name(const SessionId& session, std::uint32_t sequence,
                          std::span<const std::uint8_t> bytes);
/// Whether the bytes may be those of the name.
bool has_name(const std::string& name, std::span<const std::uint8_t> bytes);

/// Bytes by name, in a folder of its own and under a limit; those that were used longest ago go
/// first. What cannot be written is fetched again. Thread safe.
class KeyframeFiles {
 public:
  using Fetch = std::function<std::vector<std::uint8_t>(const std::string& name)>;

  /// `folder` is made if absent; empty: nothing is kept. Throws std::runtime_error, also where
  /// another worker uses it.
  KeyframeFiles(std::filesystem::path folder, std::uint64_t max_bytes);

  /// Bytes of a keyframe, fetched where they are not on disk. Throws std::runtime_error for what is
  /// no name of `keyframe_name`, and what `fetch` throws.
  std::vector<std::uint8_t> get(const std::string& name, const Fetch& fetch);

 private:
  void remove_oldest(std::uint64_t wanted);
  void keep(const std::string& name, std::span<const std::uint8_t> bytes);

  std::mutex guard_;
  std::optional<store::StoreLock> lock_;
  std::filesystem::path folder_;
  std::uint64_t max_bytes_;
  std::uint64_t bytes_ = 0;
};

}  // namespace unimapper::apps
