#include "src/apps/picture/image.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <stdexcept>

namespace unimapper::apps {
namespace {

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0F, 1.0F) * 255.0F + 0.5F);
}

}  // namespace

std::string hex(const Rgb& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", to_byte(color.red), to_byte(color.green),
                     to_byte(color.blue));
}

std::vector<std::uint8_t> encode_png(const Image& image) {
  std::vector<std::uint8_t> raw;
  raw.reserve(image.width() * image.height() * 3);
  for (std::size_t y = 0; y < image.height(); ++y) {
    for (std::size_t x = 0; x < image.width(); ++x) {
      const Rgb& pixel = image.at(x, y);
      raw.push_back(to_byte(pixel.red));
      raw.push_back(to_byte(pixel.green));
      raw.push_back(to_byte(pixel.blue));
    }
  }
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width());
  header.height = static_cast<png_uint_32>(image.height());
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = 0;
  if (png_image_write_to_memory(&header, nullptr, &bytes, 0, raw.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("a picture cannot be encoded: ") + header.message);
  }
  std::vector<std::uint8_t> png(bytes);
  if (png_image_write_to_memory(&header, png.data(), &bytes, 0, raw.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("a picture cannot be encoded: ") + header.message);
  }
  png.resize(bytes);
  return png;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    std::uint32_t group = std::uint32_t{bytes[i]} << 16U;
    if (left > 1) group |= std::uint32_t{bytes[i + 1]} << 8U;
    if (left > 2) group |= bytes[i + 2];
    text += kDigits[group >> 18U & 63U];
    text += kDigits[group >> 12U & 63U];
    text += left > 1 ? kDigits[group >> 6U & 63U] : '=';
    text += left > 2 ? kDigits[group & 63U] : '=';
  }
  return text;
}

}  // namespace unimapper::apps
