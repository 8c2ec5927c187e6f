// Encoder and buffer of a pipeline's keyframes, allocated before what is measured.
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/pipeline.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

namespace unimapper::test {

class Encoding {
 public:
  explicit Encoding(const PipelineConfig& config)
      : memory_(wire::KeyframeEncoder::required_bytes(config.voxel.max_cells)),
        encoder_(wire::KeyframeEncoder::create(config.voxel.max_cells, memory_.span()).value()),
        buffer_(std::size_t{1} << 22U) {}

  /// Whether the keyframe became bytes.
  bool encode(const KeyframeView& keyframe) noexcept {
    const wire::EncodeResult result = encoder_.encode(keyframe, {1, 2}, buffer_);
    return result.error.code == ErrorCode::kOk && result.bytes > 100;
  }

 private:
  MemoryBlock memory_;
  wire::KeyframeEncoder encoder_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace unimapper::test
