#include "image_code.hpp"

#include <algorithm>
#include <array>

namespace unimapper {
namespace {

// A pixel's level says how far it reaches: 0 means no range, and every level is 1 % farther than
// the one before. A byte is one of
//   0x00 + n (n < 0x80)  n + 1 pixels at the level of the pixel before
//   0x80 + n (n < 0x60)  one pixel, n - 48 levels above the one before
//   0xE0 + n, and a byte one pixel at level 256 n + byte
// The first pixel comes after level 0.
constexpr std::int32_t kDelta = 0x80;
constexpr std::int32_t kLiteral = 0xE0;
constexpr std::int32_t kMostBelow = 48;
constexpr std::size_t kLongestRun = 0x80;

constexpr std::int32_t kLevels = 779;
constexpr auto kRangeOfLevel = [] {
  std::array<std::uint16_t, kLevels> range{};
  std::uint32_t units = 31;  // a quarter of a metre
  for (std::size_t level = 1; level < kLevels; ++level) {
    units = std::max(units + 1, units * 101 / 100);
    range[level] = static_cast<std::uint16_t>(std::min(units, 65535U));
  }
  return range;
}();
static_assert(kRangeOfLevel[kLevels - 1] == 65535 && kRangeOfLevel[kLevels - 2] < 65535);

/// One past the highest level whose range is at most `range`, among the levels [from, to).
constexpr std::int32_t level_beyond(std::uint32_t range, std::int32_t from,
                                    std::int32_t to) noexcept {
  const auto* const beyond =
      std::upper_bound(kRangeOfLevel.begin() + from, kRangeOfLevel.begin() + to, range);
  return static_cast<std::int32_t>(beyond - kRangeOfLevel.begin());
}

/// Levels of the multiples of 256: where to search for what lies between two of them.
constexpr auto kLevelOfMultiple = [] {
  std::array<std::int16_t, 257> level{};
  for (std::uint32_t i = 0; i < level.size(); ++i) {
    level[i] = static_cast<std::int16_t>(level_beyond(256 * i, 0, kLevels) - 1);
  }
  return level;
}();

std::int32_t level_of(std::uint16_t range) noexcept {
  const std::size_t multiple = range / 256U;
  return level_beyond(range, kLevelOfMultiple[multiple], kLevelOfMultiple[multiple + 1] + 1) - 1;
}

/// Whether one byte can say that a pixel at `level` comes after one at `last`.
constexpr bool is_near(std::int32_t level, std::int32_t last) noexcept {
  const std::int32_t delta = level - last + kMostBelow;
  return level != 0 && last != 0 && delta >= 0 && delta < kLiteral - kDelta;
}

/// Calls `visit(first, count, level)` for every run of pixels in `code`. False, from the first
/// fault on, if `code` is not what `encode_image` makes of `pixels` pixels.
template <typename Visit>
bool read_code(std::span<const std::uint8_t> code, std::size_t pixels,
               const Visit& visit) noexcept {
  std::size_t filled = 0;
  std::int32_t last = 0;
  bool may_continue = true;  // what goes on with the same level belongs to the run before
  for (std::size_t at = 0; at < code.size(); ++at) {
    if (code[at] < kDelta) {
      const std::size_t run = std::size_t{code[at]} + 1;
      if (!may_continue || run > pixels - filled) return false;
      visit(filled, run, last);
      filled += run;
      may_continue = run == kLongestRun;
      continue;
    }
    std::int32_t level = last + code[at] - kDelta - kMostBelow;
    const bool one_byte = code[at] < kLiteral;
    if (!one_byte) {
      if (++at == code.size()) return false;
      level = (code[at - 1] - kLiteral) * 256 + code[at];
    }
    if (level < 0 || level >= kLevels || level == last) return false;
    if (is_near(level, last) != one_byte || filled == pixels) return false;
    visit(filled++, std::size_t{1}, level);
    last = level;
    may_continue = true;
  }
  return filled == pixels;
}

/// Hands the bytes of an image's code to `put`.
template <typename Put>
void write_code(std::span<const std::uint16_t> pixels, const Put& put) noexcept {
  std::int32_t last = 0;
  for (std::size_t i = 0; i < pixels.size();) {
    const std::uint32_t nearest = kRangeOfLevel[static_cast<std::size_t>(last)];
    const std::uint32_t beyond =
        last + 1 < kLevels ? kRangeOfLevel[static_cast<std::size_t>(last) + 1] : 65536U;
    const std::size_t limit = std::min(pixels.size(), i + kLongestRun);
    std::size_t end = i;
    while (end < limit && pixels[end] >= nearest && pixels[end] < beyond) ++end;
    if (end > i) {
      put(static_cast<std::int32_t>(end - i) - 1);
      i = end;
      continue;
    }
    const std::int32_t level = level_of(pixels[i]);
    if (is_near(level, last)) {
      put(kDelta + level - last + kMostBelow);
    } else {
      put(kLiteral + level / 256);
      put(level % 256);
    }
    last = level;
    ++i;
  }
}

}  // namespace

bool is_image_shape(const RangeImageShape& shape) noexcept {
  const float height_deg = shape.elevation_max_deg - shape.elevation_min_deg;
  const auto is_resolution = [](float degrees) { return degrees >= 0.05F && degrees <= 45.0F; };
  // Comparisons that NaN fails.
  const bool sane = shape.horizontal_fov_deg > 0.0F && shape.horizontal_fov_deg <= 360.0F &&
                    shape.elevation_min_deg >= -90.0F && shape.elevation_max_deg <= 90.0F &&
                    height_deg > 0.0F && is_resolution(shape.azimuth_resolution_deg) &&
                    is_resolution(shape.elevation_resolution_deg);
  return sane && ImageProjection(shape).pixels() <= kMaxImagePixels;
}

std::size_t encode_image(std::span<const std::uint16_t> pixels,
                         std::span<std::uint8_t> code) noexcept {
  std::size_t size = 0;
  write_code(pixels, [&](std::int32_t byte) {
    if (size < code.size()) code[size] = static_cast<std::uint8_t>(byte);
    ++size;
  });
  return size;
}

void encode_image(std::span<const std::uint16_t> pixels, const ImageCodeSink& sink) noexcept {
  write_code(pixels,
             [&](std::int32_t byte) { sink.put(sink.context, static_cast<std::uint8_t>(byte)); });
}

bool is_image_code(std::span<const std::uint8_t> code, std::size_t pixels) noexcept {
  return read_code(code, pixels, [](std::size_t, std::size_t, std::int32_t) {});
}

bool decode_image(std::span<const std::uint8_t> code, std::span<std::uint16_t> pixels) noexcept {
  return read_code(code, pixels.size(), [&](std::size_t at, std::size_t run, std::int32_t level) {
    std::fill_n(pixels.data() + at, run, kRangeOfLevel[static_cast<std::size_t>(level)]);
  });
}

}  // namespace unimapper
