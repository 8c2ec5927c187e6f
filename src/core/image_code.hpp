// Compression of free-space images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "unimapper/core/image_projection.hpp"

namespace unimapper {

/// Most pixels of an image that is accepted from outside.
inline constexpr std::size_t kMaxImagePixels = std::size_t{1} << 20U;

/// True if images of this shape can be worked with: finite angles in their order, and at most
/// `kMaxImagePixels` pixels.
[[nodiscard]] bool is_image_shape(const RangeImageShape& shape) noexcept;

/// Most bytes the code of so many pixels takes.
[[nodiscard]] constexpr std::size_t max_image_code(std::size_t pixels) noexcept {
  return 2 * pixels + 1;
}

/// Writes the code of an image's pixels (1/128 m, row by row) to `code` and returns how many bytes
/// it takes, at most `max_image_code`. If that is more than `code` holds, what does not fit is not
/// written. Ranges are rounded down to steps of 1 %, so nothing becomes free that was not. Every
/// image has one code. O(pixels).
[[nodiscard]] std::size_t encode_image(std::span<const std::uint16_t> pixels,
                                       std::span<std::uint8_t> code) noexcept;

/// Where the bytes of a code go, one at a time.
struct ImageCodeSink {
  void (*put)(void* context, std::uint8_t byte) noexcept;  ///< takes the next byte
  void* context;                                           ///< first argument of `put`
};

/// Hands the code of an image's pixels to `sink`, byte by byte: a writer needs no memory for it.
/// O(pixels).
void encode_image(std::span<const std::uint16_t> pixels, const ImageCodeSink& sink) noexcept;

/// Whether `code` is what `encode_image` makes of an image of so many pixels. O(bytes of `code`).
[[nodiscard]] bool is_image_code(std::span<const std::uint8_t> code, std::size_t pixels) noexcept;

/// Reads as many pixels as `pixels` holds. False if `code` is not what `encode_image` makes of
/// them. O(pixels).
[[nodiscard]] bool decode_image(std::span<const std::uint8_t> code,
                                std::span<std::uint16_t> pixels) noexcept;

}  // namespace unimapper
