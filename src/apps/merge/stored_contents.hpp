// Sessions of stores whose cells are read when they are needed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>

#include "ports/store/keyframe_reader.hpp"
#include "ports/store/store_reader.hpp"
#include "src/merge/sessions/keyframe_cache.hpp"

namespace unimapper::apps {

/// Reads sessions without cells and images; those of all sessions that were needed last are kept
/// under one limit. Not thread safe; what it reads is.
class StoredContents {
 public:
  /// `max_bytes`: of keyframes that are kept.
  explicit StoredContents(std::uint64_t max_bytes) : cache_(max_bytes) {}

  /// A session of the store in `folder`, which `reader` reads. Throws StoreError.
  SessionData read(const std::filesystem::path& folder, store::StoreReader& reader,
                   const store::SessionListing& session);

  /// Reads what has arrived in a session of the store since it was read; where it is empty, all.
  /// Throws StoreError.
  void read_on(const std::filesystem::path& folder, store::StoreReader& reader,
               const store::SessionListing& session, SessionData& data);

 private:
  merge::KeyframeCache cache_;
  std::map<std::filesystem::path, std::shared_ptr<store::KeyframeReader>> readers_;
};

}  // namespace unimapper::apps
