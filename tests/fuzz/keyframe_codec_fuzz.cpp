// Fuzz target of the keyframe decoder: accepted bytes are their own canonical encoding.
#include <cstdint>
#include <vector>

#include "tests/fuzz/fuzz.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper::wire;
using unimapper::fuzz::require;

/// The summary says what the keyframe says.
void check_summary(Bytes bytes, const unimapper::KeyframeRecord& whole) {
  const DecodedKeyframe summary = decode_summary(bytes.first(summary_bytes(bytes).value()));
  require(summary.record && summary.record->is_summary);
  require(summary.record->session == whole.session && summary.record->sequence == whole.sequence);
  require(summary.record->keypoints.size() == whole.keypoints.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes{data, size};
  (void)decode_summary(bytes);
  const DecodedKeyframe decoded = decode_keyframe(bytes);
  require(decoded.record.has_value() == decoded.error.empty());
  if (!decoded.record) return 0;
  require(encode_keyframe(*decoded.record) == std::vector<std::uint8_t>(data, data + size));
  check_summary(bytes, *decoded.record);
  return 0;
}
