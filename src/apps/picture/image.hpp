// Image in memory and its PNG and base64 encodings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace unimapper::apps {

/// A colour, channels in [0, 1].
struct Rgb {
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;

  friend Rgb operator*(const Rgb& c, float f) { return {c.red * f, c.green * f, c.blue * f}; }
  friend Rgb operator+(const Rgb& a, const Rgb& b) {
    return {a.red + b.red, a.green + b.green, a.blue + b.blue};
  }
};

/// `a` for t = 0, `b` for t = 1.
[[nodiscard]] inline Rgb mix(const Rgb& a, const Rgb& b, float t) { return a * (1.0F - t) + b * t; }

/// "#rrggbb".
[[nodiscard]] std::string hex(const Rgb& color);

/// Rows from top to bottom.
class Image {
 public:
  Image(std::size_t width, std::size_t height, const Rgb& background)
      : width_(width), height_(height), pixels_(width * height, background) {}
  [[nodiscard]] std::size_t width() const { return width_; }
  [[nodiscard]] std::size_t height() const { return height_; }
  Rgb& at(std::size_t x, std::size_t y) { return pixels_[y * width_ + x]; }
  [[nodiscard]] const Rgb& at(std::size_t x, std::size_t y) const {
    return pixels_[y * width_ + x];
  }

 private:
  std::size_t width_;
  std::size_t height_;
  std::vector<Rgb> pixels_;
};

/// The picture as a PNG file, 8 bits a channel. Throws std::runtime_error when libpng refuses.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Image& image);

/// Base64 of `bytes`, padded.
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace unimapper::apps
