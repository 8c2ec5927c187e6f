// Oracle of messages in shared memory: an accepted message lies within its bytes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ports/shared_memory/content_reader.hpp"

namespace unimapper::test {

/// Reads every byte of every element; the number of elements. A sanitizer finds what is too far.
template <typename Element>
std::size_t visit(const shared_memory::Elements<Element>& elements, std::uint64_t& sum) {
  std::size_t count = 0;
  for (const Element element : elements) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(&element);
    for (std::size_t i = 0; i < sizeof element; ++i) sum = sum * 31 + bytes[i];
    ++count;
  }
  return count;
}

/// Whether a section lies within `bytes` and the reader says of it what it says of itself.
template <typename Element>
bool is_inside(const shared_memory::Section& section,
               const shared_memory::Elements<Element>& elements, std::size_t bytes) {
  const std::uint64_t end =
      std::uint64_t{section.offset} + std::uint64_t{section.stride} * section.count;
  std::uint64_t sum = 0;
  return elements.size() == section.count && end <= bytes && visit(elements, sum) == section.count;
}

/// Whether what was accepted keeps the reader's promises.
inline bool walk(const shared_memory::KeyframeMessage& keyframe,
                 std::span<const std::byte> message) {
  const shared_memory::SharedKeyframe& fixed = keyframe.fixed;
  bool finite = true;
  for (const shared_memory::SharedScan scan : keyframe.scans) {
    for (const double number : scan.T_odometry_sensor) finite = finite && std::isfinite(number);
  }
  return finite && fixed.head.bytes <= message.size() &&
         fixed.reference_scan < keyframe.scans.size() && keyframe.T_odometry_keyframe.is_rigid() &&
         is_inside(fixed.scans, keyframe.scans, message.size()) &&
         is_inside(fixed.static_cells, keyframe.static_cells, message.size()) &&
         is_inside(fixed.dynamic_cells, keyframe.dynamic_cells, message.size()) &&
         is_inside(fixed.keypoints, keyframe.keypoints, message.size()) &&
         is_inside(fixed.planes, keyframe.planes, message.size()) &&
         is_inside(fixed.loops, keyframe.loops, message.size());
}

}  // namespace unimapper::test
