// Keyframes that are read on demand.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Reads a keyframe of one session, whole, by its sequence. Called from several threads at once;
/// throws where it cannot.
using ReadKeyframe = std::function<KeyframeRecord(std::uint32_t sequence)>;

/// Contents of one session.
class ReadContents : public KeyframeContents {
 public:
  /// Takes a whole keyframe that has been read anyway and is not turned any more, unless another
  /// one would have to be forgotten for it.
  virtual void offer(KeyframeRecord whole) = 0;
};

/// Cells and images of keyframes that were needed last. What is in use stays beyond the limit.
class KeyframeCache {
 public:
  /// `max_bytes`: of the keyframes that are kept.
  explicit KeyframeCache(std::uint64_t max_bytes);

  /// Contents of one session, under the limit of this cache, which they keep alive.
  [[nodiscard]] std::shared_ptr<ReadContents> contents(ReadKeyframe read);

 private:
  class State;
  class OfSession;
  std::shared_ptr<State> state_;
  std::uint32_t sessions_ = 0;
};

/// Takes cells and images out of a keyframe that is read on demand from then on.
void drop_contents(KeyframeRecord& keyframe);

/// Bytes that a keyframe takes in memory. O(images).
[[nodiscard]] std::uint64_t bytes_of(const KeyframeRecord& keyframe);

}  // namespace unimapper::merge
