// Layout of the C interface's handle, shared by its source files.
#pragma once

#include <cstddef>
#include <cstdint>

#include "ports/c/convert.hpp"
#include "ports/c/unimapper.h"
#include "unimapper/onboard/pipeline.hpp"

/// What the handle points to; the pipeline proper follows it in the same block.
struct alignas(UM_ALIGNMENT) um_pipeline {
  std::uint64_t magic;
  unimapper::PipelineConfig config;
  unimapper::Pipeline* core;
  std::byte* core_memory;
  std::size_t core_bytes;
  std::byte* ring_memory;
  std::size_t ring_bytes;
  std::uint32_t event_capacity;
  bool keyframe_ready;     // by the last call that may close one
  bool keyframe_finished;  // by the last call that may finish one
  const char* message;
  um_scan scans[unimapper::KeyframeConfig::kMaxScans];
  // LoopSearchConfig::max_results is at most 256; a keyframe that is not finished has none.
  um_loop loops[256];
  um_scan finished_scans[unimapper::KeyframeConfig::kMaxScans];
  um_health health;
};

namespace unimapper::c {

// "unimappr" and the layout's number.
inline constexpr std::uint64_t kMagic = 0x756e696d61707201ULL;

inline bool is_aligned(const void* pointer) noexcept {
  return reinterpret_cast<std::uintptr_t>(pointer) % UM_ALIGNMENT == 0;
}

inline bool is_pipeline(const um_pipeline* pipeline) noexcept {
  return pipeline != nullptr && is_aligned(pipeline) && pipeline->magic == kMagic;
}

/// Records what a call had to say.
inline um_status tell(um_pipeline& pipeline, const Error& error) noexcept {
  pipeline.message = error.message;
  return to_c(error.code);
}

inline um_status refuse(um_pipeline& pipeline, um_status status) noexcept {
  pipeline.message = um_status_text(status);
  return status;
}

}  // namespace unimapper::c
