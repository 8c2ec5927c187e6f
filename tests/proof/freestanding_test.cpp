// Proof that the pipeline runs freestanding.
//
// Every onboard header and the whole pipeline in a program without exceptions, RTTI and libstdc++,
// linked against the C library alone.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "unimapper/onboard/pipeline.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

#if defined(__cpp_exceptions) || defined(__cpp_rtti)
#error "this file is to be compiled with -fno-exceptions -fno-rtti"
#endif

int main() {
  using namespace unimapper;
  PipelineConfig config = preset(SensorKind::kVlp16);
  config.loop_search.max_places = 10;
  const std::size_t bytes = Pipeline::required_bytes(config);
  auto* const block = static_cast<std::byte*>(std::aligned_alloc(64, bytes));
  auto pipeline = Pipeline::create(config, {block, bytes});
  if (!pipeline.ok()) return std::puts(pipeline.error().message), 1;

  // The inside of a round tower.
  static float scan[4000][3];
  for (int i = 0; i < 4000; ++i) {
    const float turn = 0.0157F * static_cast<float>(i);
    scan[i][0] = 10.0F * std::cos(turn);
    scan[i][1] = 10.0F * std::sin(turn);
    scan[i][2] = 0.5F * static_cast<float>(i / 400) - 1.0F;
  }
  unsigned keyframes = 0;
  for (std::int64_t i = 0; i < 30; ++i) {
    const PointView view = PointView::xyz(scan, 4000, sizeof scan[0]);
    if (pipeline.value()->add_scan(view, Pose{}, i).keyframe_ready) ++keyframes;
  }
  const std::size_t cells = pipeline.value()->keyframe().static_cells.size();
  const std::size_t scratch_bytes = wire::KeyframeEncoder::required_bytes(config.voxel.max_cells);
  auto* const scratch = static_cast<std::byte*>(std::aligned_alloc(64, scratch_bytes));
  auto encoder = wire::KeyframeEncoder::create(config.voxel.max_cells, {scratch, scratch_bytes});
  static std::uint8_t bytes_out[1U << 20U];
  const wire::EncodeResult encoded =
      encoder->encode(pipeline.value()->keyframe(), {1, 2}, bytes_out);
  std::printf("%u keyframes, %zu static cells in the last, %zu bytes\n", keyframes, cells,
              encoded.bytes);
  std::free(scratch);
  std::free(block);
  return keyframes == 3 && cells > 100 && encoded.error.code == ErrorCode::kOk ? 0 : 1;
}
