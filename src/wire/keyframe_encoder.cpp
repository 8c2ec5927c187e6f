#include "unimapper/wire/keyframe_encoder.hpp"

#include <algorithm>
#include <new>

#include "keyframe_writer.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::wire {

namespace {

struct Layout {
  CellKey* keys;
  CellKey* spare;
  std::uint32_t* counts;
  CellCode* code;
  ImageBytes* images;

  Layout(Arena& arena, std::uint32_t max_cells) noexcept
      : keys(arena.allocate<CellKey>(max_cells)),
        spare(arena.allocate<CellKey>(max_cells)),
        counts(arena.allocate<std::uint32_t>(CellKeyScratch::kCounts)),
        code(arena.allocate<CellCode>(1)),
        images(arena.allocate<ImageBytes>(1)) {}
};

}  // namespace

std::size_t KeyframeEncoder::required_bytes(std::uint32_t max_cells) noexcept {
  Arena arena = Arena::measuring();
  (void)Layout(arena, max_cells);
  return arena.used();
}

Expected<KeyframeEncoder> KeyframeEncoder::create(std::uint32_t max_cells,
                                                  std::span<std::byte> memory) noexcept {
  if (memory.size() < required_bytes(max_cells)) {
    return Error{ErrorCode::kMemoryTooSmall,
                 "the scratch memory is smaller than KeyframeEncoder::required_bytes"};
  }
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
    return Error{ErrorCode::kMemoryMisaligned,
                 "the scratch memory must start on a 64-byte boundary"};
  }
  Arena arena(memory.data(), memory.size());
  const Layout layout(arena, max_cells);
  KeyframeEncoder encoder;
  encoder.keys_ = layout.keys;
  encoder.spare_keys_ = layout.spare;
  encoder.counts_ = layout.counts;
  encoder.code_ = new (layout.code) CellCode;
  encoder.images_ = new (layout.images) ImageBytes;
  encoder.max_cells_ = max_cells;
  return encoder;
}

EncodeResult KeyframeEncoder::encode(const KeyframeContent& keyframe, const SessionId& session,
                                     std::span<std::uint8_t> out) noexcept {
  EncodeResult result;
  if (counts_ == nullptr) {
    result.error = {ErrorCode::kMemoryTooSmall, "the encoder was not made by `create`"};
    return result;
  }
  if (const char* fault = keyframe_fault(keyframe)) {
    result.error = {ErrorCode::kInvalidKeyframe, fault};
    return result;
  }
  const WriterScratch scratch{
      {{keys_, max_cells_}, {spare_keys_, max_cells_}, {counts_, CellKeyScratch::kCounts}},
      code_,
      images_};
  return write_keyframe({keyframe, session, 0, {}, {}}, scratch, out);
}

}  // namespace unimapper::wire
