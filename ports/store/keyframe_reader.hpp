// Reader of single keyframes of a store.
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <vector>

#include "ports/store/database.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::store {

/// Reads keyframes of a store in any order, also while a base writes to it. Thread safe.
class KeyframeReader {
 public:
  /// Throws StoreError.
  explicit KeyframeReader(const std::filesystem::path& folder);

  /// A keyframe of the session in a row. O(bytes). Throws StoreError for one that is not stored or
  /// is damaged.
  [[nodiscard]] KeyframeRecord read(std::int64_t session, std::uint32_t sequence);
  /// Its bytes as the robot encoded it. Throws as `read`.
  [[nodiscard]] std::vector<std::uint8_t> bytes(std::int64_t session, std::uint32_t sequence);

 private:
  /// Empty for one that is not stored or is damaged.
  std::vector<std::uint8_t> sound_bytes(std::int64_t session, std::uint32_t sequence);
  [[noreturn]] void refuse(std::int64_t session, std::uint32_t sequence) const;

  std::mutex guard_;
  Database database_;
  Statement select_;
};

}  // namespace unimapper::store
