// Keyframes in a base's store as a robot's would be.
#pragma once

#include "ports/store/keyframe_store.hpp"
#include "tests/test.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::apps {

/// Stores a keyframe; it is on disk after the next commit.
inline void store_keyframe(store::KeyframeStore& kept, KeyframeRecord record) {
  std::vector<std::uint8_t> bytes = wire::encode_keyframe(record);
  REQUIRE(kept.keep(wire::ReceivedKeyframe{std::move(bytes), std::move(record)}) !=
          wire::KeyframeStorage::Taken::kNoRoom);
}

}  // namespace unimapper::apps
