// Keyframes, labels and health read out of shared memory, whatever the bytes are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "ports/shared_memory/contents.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::shared_memory {

/// Elements of a message where they lie, each copied when it is asked for. Stays within the message
/// whatever is written there meanwhile.
template <typename Element>
class Elements {
 public:
  Elements() = default;
  Elements(const std::byte* first, std::size_t count, std::size_t stride) noexcept
      : first_(first), count_(count), stride_(stride) {}

  /// Goes over the elements in order.
  class Iterator {
   public:
    /// At the element that begins at `at`.
    Iterator(const std::byte* at, std::size_t stride) noexcept : at_(at), stride_(stride) {}
    Element operator*() const noexcept {
      Element element;
      std::memcpy(&element, at_, sizeof element);
      return element;
    }
    Iterator& operator++() noexcept {
      at_ += stride_;
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const std::byte* at_;
    std::size_t stride_;
  };

  /// How many there are.
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// Whether there is none.
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// Element `index`, below `size()`.
  Element operator[](std::size_t index) const noexcept {
    return *Iterator(first_ + index * stride_, stride_);
  }
  /// The first element.
  [[nodiscard]] Iterator begin() const noexcept { return {first_, stride_}; }
  /// Behind the last one.
  [[nodiscard]] Iterator end() const noexcept { return {first_ + count_ * stride_, stride_}; }

 private:
  const std::byte* first_ = nullptr;
  std::size_t count_ = 0;
  std::size_t stride_ = sizeof(Element);
};

/// A keyframe in shared memory; to be used while its sample is held.
struct KeyframeMessage {
  SharedKeyframe fixed = {};           ///< a copy of the fixed part
  Pose T_odometry_keyframe;            ///< levelled keyframe frame to odometry frame, metres
  Elements<SharedScan> scans;          ///< at least one, in order of time
  Elements<SharedCell> static_cells;   ///< the map's contribution
  Elements<SharedCell> dynamic_cells;  ///< what was removed
  Elements<SharedKeypoint> keypoints;  ///< the descriptor
  Elements<SharedPlane> planes;        ///< planar voxels
  Elements<SharedLoop> loops;          ///< loop candidates, best first
};

/// Labels of a scan in shared memory; to be used while its sample is held.
struct LabelsMessage {
  SharedLabels fixed = {};        ///< a copy of the fixed part
  Elements<std::uint8_t> labels;  ///< a `PointLabel` for every point
};

/// The keyframe in `message`; nothing unless every section lies within it, every pose is finite and
/// the keyframe's is rigid, and the reference scan is there. Cells and keypoints are as the writer
/// wrote them. O(scans + loops).
[[nodiscard]] std::optional<KeyframeMessage> read_keyframe(
    std::span<const std::byte> message) noexcept;
/// The labels in `message`; nothing unless they lie within it.
[[nodiscard]] std::optional<LabelsMessage> read_labels(std::span<const std::byte> message) noexcept;
/// The health in `message`; nothing if it is none.
[[nodiscard]] std::optional<SharedHealth> read_health(std::span<const std::byte> message) noexcept;

/// A pose of 12 numbers: rotation row by row, then translation.
[[nodiscard]] Pose pose_of(const double (&numbers)[12]) noexcept;

}  // namespace unimapper::shared_memory
