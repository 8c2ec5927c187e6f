// Pipeline that owns its memory.
#pragma once

#include <cstddef>

#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper {

/// A `Pipeline` in a block of its own from the heap: the shortest way to a keyframe where there is
/// a heap at start-up. Allocates in the constructor and nowhere else; every call goes through `->`
/// to the pipeline and keeps its guarantees. Throws nothing: look at `ok()` first, as using a
/// pipeline that was refused stops the program. Not thread safe, neither copied nor moved.
class OwnedPipeline {
 public:
  explicit OwnedPipeline(const PipelineConfig& config) noexcept { create(config); }
  /// Passes the error of a refused configuration on, so that `preset(model)` needs no check.
  explicit OwnedPipeline(const Expected<PipelineConfig>& config) noexcept : error_(config.error()) {
    if (config.ok()) create(*config);
  }
  OwnedPipeline(const OwnedPipeline&) = delete;
  OwnedPipeline& operator=(const OwnedPipeline&) = delete;
  ~OwnedPipeline() = default;

  /// Whether there is a pipeline.
  [[nodiscard]] bool ok() const noexcept { return pipeline_ != nullptr; }
  explicit operator bool() const noexcept { return ok(); }
  /// `kOk`, or why there is no pipeline: an invalid configuration (`kInvalidConfig`), or the heap
  /// does not have `bytes()` (`kMemoryTooSmall`).
  [[nodiscard]] const Error& error() const noexcept { return error_; }

  /// Only where `ok()`.
  Pipeline& operator*() noexcept {
    UNIMAPPER_ASSERT(ok(), error_.message);
    return *pipeline_;
  }
  Pipeline* operator->() noexcept { return &**this; }

  /// Of the block: `Pipeline::required_bytes(config)`; 0 if the configuration is invalid.
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  void create(const PipelineConfig& config) noexcept {
    error_ = config.validate();
    if (!error_.ok()) return;
    bytes_ = Pipeline::required_bytes(config);
    block_ = MemoryBlock(bytes_);
    if (block_.data() == nullptr) {
      error_ = {ErrorCode::kMemoryTooSmall,
                "the heap does not have the memory the pipeline needs (Pipeline::required_bytes)"};
      return;
    }
    const Expected<Pipeline*> created = Pipeline::create(config, block_.span());
    error_ = created.error();
    if (created.ok()) pipeline_ = *created;
  }

  std::size_t bytes_ = 0;
  MemoryBlock block_;
  Pipeline* pipeline_ = nullptr;
  Error error_;
};

}  // namespace unimapper
