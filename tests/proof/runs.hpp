// Scans, encoder and buffers of the proofs, allocated before what is measured.
#pragma once

#include <cstdint>
#include <vector>

#include "run.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

namespace unimapper::test {

/// Scans of a wall and of what moves past it, ten a second.
inline std::vector<LabelledScan> scans_of_street(int count) {
  Scene scene;
  scene.boxes = {standing_box({8.0, 6.0, 1.5}, {6.0, 0.3, 1.5}),
                 moving_box({8.0, -4.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
  std::vector<LabelledScan> scans;
  for (int i = 0; i < count; ++i) scans.push_back(scene.scan(sensor_at(0, 0), 0.1 * i));
  return scans;
}

/// Reads the labels of all scans of the pipeline's keyframe.
inline void read_labels(OwnedPipeline& pipeline, std::vector<PointLabel>& labels) {
  for (std::size_t s = 0; s < pipeline->keyframe().scans.size(); ++s) pipeline->labels(s, labels);
}

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
