// Fuzz target of the keyframe decoder: accepted bytes are their own canonical encoding.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper::wire;

/// The summary says what the keyframe says.
void check_summary(Bytes bytes, const unimapper::KeyframeRecord& whole) {
  const DecodedKeyframe summary = decode_summary(bytes.first(summary_bytes(bytes).value()));
  if (!summary.record || !summary.record->is_summary) std::abort();
  const bool same = summary.record->session == whole.session &&
                    summary.record->sequence == whole.sequence &&
                    summary.record->keypoints.size() == whole.keypoints.size();
  if (!same) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes{data, size};
  (void)decode_summary(bytes);
  const DecodedKeyframe decoded = decode_keyframe(bytes);
  if (decoded.record.has_value() != decoded.error.empty()) std::abort();
  if (!decoded.record) return 0;
  const std::vector<std::uint8_t> again = encode_keyframe(*decoded.record);
  if (again != std::vector<std::uint8_t>(data, data + size)) std::abort();
  check_summary(bytes, *decoded.record);
  return 0;
}
