// Strided view of a scan in the caller's memory.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace unimapper {

/// A strided view of float32 coordinates in the sensor frame, metres; nothing is copied.
/// `data` must stay valid during the call it is passed to. Points may be NaN or infinite:
/// they are skipped and counted.
struct PointView {
  const std::byte* data = nullptr;  ///< first byte of the first point
  std::size_t count = 0;            ///< points
  std::size_t stride = 0;           ///< bytes from one point to the next
  std::size_t offset_x = 0;         ///< bytes from the start of a point to its float32 x
  std::size_t offset_y = 4;         ///< bytes from the start of a point to its float32 y
  std::size_t offset_z = 8;         ///< bytes from the start of a point to its float32 z
  /// Intensity of each point, one byte; null: not known. Read by `PipelineConfig::intensity` only.
  const std::uint8_t* intensities = nullptr;
  std::size_t intensity_stride = 1;  ///< bytes from one intensity to the next

  /// A view of `count` points whose x, y, z are three consecutive floats, `stride_bytes` apart.
  static PointView xyz(const void* first, std::size_t count, std::size_t stride_bytes) noexcept {
    return {static_cast<const std::byte*>(first), count, stride_bytes, 0, 4, 8};
  }

  [[nodiscard]] Eigen::Vector3f operator[](std::size_t i) const noexcept {
    const std::byte* point = data + i * stride;
    return {load(point + offset_x), load(point + offset_y), load(point + offset_z)};
  }

 private:
  static float load(const std::byte* at) noexcept {
    float value;
    std::memcpy(&value, at, sizeof value);
    return value;
  }
};

/// Label of a point.
enum class PointLabel : std::uint8_t {
  kUnknown = 0,  ///< invalid: not finite, or out of range
  kStatic = 1,
  kDynamic = 2,
};

}  // namespace unimapper
