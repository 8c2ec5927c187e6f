// Writer of encoded keyframes, for the robot's views and the base station's records.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "cell_code.hpp"
#include "cell_key.hpp"
#include "image_bytes.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

namespace unimapper::wire {

/// Everything that becomes bytes.
struct WriterInput {
  const KeyframeContent& keyframe;  ///< all but the planes of its `place`
  SessionId session;
  std::uint64_t left_out = 0;                ///< before the keyframe came here
  std::span<const PlanePatch> planes;        ///< records of older senders
  std::span<const CodedImage> coded_images;  ///< instead of the keyframe's own images
};

/// Memory the writer works in.
struct WriterScratch {
  CellKeyScratch keys;
  CellCode* code;      ///< not null
  ImageBytes* images;  ///< not null
};

/// Edge of the cells in millimetres, as it travels: 0 if it is none that a keyframe may have.
std::uint16_t cell_size_mm(float cell_size_m) noexcept;

/// Why no keyframe has so many images of this shape and full-weight range, or null.
const char* image_head_fault(std::size_t images, const RangeImageShape& shape,
                             float full_weight_range_m) noexcept;

/// Why a keyframe cannot be encoded, or null. O(scans).
const char* keyframe_fault(const KeyframeContent& keyframe) noexcept;

/// The one writer. The keyframe has passed `keyframe_fault`.
EncodeResult write_keyframe(const WriterInput& input, const WriterScratch& scratch,
                            std::span<std::uint8_t> out) noexcept;

}  // namespace unimapper::wire
