#include "ports/shared_memory/content_reader.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::shared_memory {

namespace {

constexpr std::size_t kMaxStride = 4096;

/// The fixed part of a message, if its head says that it is one of this kind and its bytes are
/// there. Nothing is read twice: whoever writes meanwhile cannot change what was checked.
template <typename Fixed>
bool read_fixed(std::span<const std::byte> message, ContentKind kind, Fixed& fixed) noexcept {
  if (message.size() < sizeof fixed) return false;
  std::memcpy(&fixed, message.data(), sizeof fixed);
  const ContentHead& head = fixed.head;
  return head.magic == kContentMagic && head.kind == static_cast<std::uint16_t>(kind) &&
         head.version == kContentVersion && head.bytes >= sizeof fixed &&
         head.bytes <= message.size();
}

/// The elements of a section, if it lies within the message and behind its fixed part.
template <typename Element>
bool read_section(std::span<const std::byte> message, const Section& section, std::size_t begin,
                  Elements<Element>& elements) noexcept {
  if (section.stride < sizeof(Element) || section.stride > kMaxStride) return false;
  if (section.offset < begin || section.offset % 8 != 0) return false;
  const std::uint64_t end =
      std::uint64_t{section.offset} + std::uint64_t{section.count} * section.stride;
  if (end > message.size()) return false;
  elements = {message.data() + section.offset, section.count, section.stride};
  return true;
}

bool is_finite(const double (&numbers)[12]) noexcept {
  return std::all_of(numbers, numbers + 12, [](double number) { return std::isfinite(number); });
}

}  // namespace

Pose pose_of(const double (&numbers)[12]) noexcept {
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      pose.rotation(row, column) = numbers[3 * row + column];
    }
    pose.translation[row] = numbers[9 + row];
  }
  return pose;
}

std::optional<KeyframeMessage> read_keyframe(std::span<const std::byte> message) noexcept {
  KeyframeMessage keyframe;
  const SharedKeyframe& fixed = keyframe.fixed;
  if (!read_fixed(message, ContentKind::kKeyframe, keyframe.fixed)) return std::nullopt;
  const auto bytes = message.first(static_cast<std::size_t>(fixed.head.bytes));
  const std::size_t begin = sizeof fixed;
  const bool inside = read_section(bytes, fixed.scans, begin, keyframe.scans) &&
                      read_section(bytes, fixed.static_cells, begin, keyframe.static_cells) &&
                      read_section(bytes, fixed.dynamic_cells, begin, keyframe.dynamic_cells) &&
                      read_section(bytes, fixed.keypoints, begin, keyframe.keypoints) &&
                      read_section(bytes, fixed.planes, begin, keyframe.planes) &&
                      read_section(bytes, fixed.loops, begin, keyframe.loops);
  if (!inside || fixed.reference_scan >= keyframe.scans.size()) return std::nullopt;
  for (const SharedScan scan : keyframe.scans) {
    if (!is_finite(scan.T_odometry_sensor)) return std::nullopt;
  }
  for (const SharedLoop loop : keyframe.loops) {
    if (!is_finite(loop.T_match_query)) return std::nullopt;
  }
  keyframe.T_odometry_keyframe = pose_of(fixed.T_odometry_keyframe);
  if (!keyframe.T_odometry_keyframe.is_rigid()) return std::nullopt;
  return keyframe;
}

std::optional<LabelsMessage> read_labels(std::span<const std::byte> message) noexcept {
  LabelsMessage labels;
  if (!read_fixed(message, ContentKind::kLabels, labels.fixed)) return std::nullopt;
  const auto bytes = message.first(static_cast<std::size_t>(labels.fixed.head.bytes));
  if (!read_section(bytes, labels.fixed.labels, sizeof labels.fixed, labels.labels)) {
    return std::nullopt;
  }
  return labels;
}

std::optional<SharedHealth> read_health(std::span<const std::byte> message) noexcept {
  SharedHealth health = {};
  if (!read_fixed(message, ContentKind::kHealth, health)) return std::nullopt;
  return health;
}

}  // namespace unimapper::shared_memory
