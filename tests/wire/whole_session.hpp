// Check of a session that arrived without a gap.
#pragma once

#include "tests/test.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::wire::wire_test {

/// All keyframes arrived, in order, with the bytes they were sent with.
inline void check_whole(const SessionData& data, const SessionInfo& info, std::size_t keyframes) {
  CHECK(data.info.name == info.name);
  CHECK(data.info.sensor == info.sensor);
  CHECK(data.info.id == info.id);
  CHECK(data.complete);
  CHECK(data.keyframes_missing == 0);
  CHECK(data.keyframes_damaged == 0);
  REQUIRE(data.keyframes.size() == keyframes);
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    CHECK(data.keyframes[i].sequence == i);
    CHECK(encode_keyframe(data.keyframes[i]) == encode_keyframe(keyframe_of(info.id, i)));
  }
}

}  // namespace unimapper::wire::wire_test
