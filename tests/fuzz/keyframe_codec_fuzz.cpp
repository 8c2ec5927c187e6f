// Fuzz target of the keyframe decoder: accepted bytes are their own canonical encoding.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "unimapper/wire/keyframe_codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace unimapper::wire;
  const DecodedKeyframe decoded = decode_keyframe({data, size});
  if (decoded.record.has_value() != decoded.error.empty()) std::abort();
  if (!decoded.record) return 0;
  const std::vector<std::uint8_t> again = encode_keyframe(*decoded.record);
  if (again != std::vector<std::uint8_t>(data, data + size)) std::abort();
  return 0;
}
