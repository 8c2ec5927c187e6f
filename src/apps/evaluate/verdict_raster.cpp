#include "src/apps/evaluate/verdict_raster.hpp"

#include <algorithm>
#include <cmath>

#include "src/apps/picture/palette.hpp"
#include "unimapper/evaluate/dynamic.hpp"

namespace unimapper::apps {
namespace {

// Few tones compress well, and nobody tells more apart.
constexpr float kTones = 12.0F;
constexpr Rgb kGrey = {0.80F, 0.84F, 0.90F};

Rgb color_of(Verdict verdict, float tone) {
  switch (verdict) {
    case Verdict::kUnjudged:
      return kGrey * (0.12F + 0.18F * tone);
    case Verdict::kKept:
      return kGrey * (0.25F + 0.65F * tone);
    case Verdict::kRemoved:
      return kRemovedColor;
    case Verdict::kLost:
      return kLostColor;
    case Verdict::kMissed:
      return kMissedColor;
    case Verdict::kNothing:
      break;
  }
  return mix(kPictureBackground, kGrey, 0.25F * tone);
}

}  // namespace

Verdict verdict_of(std::uint32_t truth, std::uint32_t predicted) {
  const bool removed = evaluate::is_removed(predicted);
  switch (evaluate::truth_of(truth)) {
    case evaluate::Truth::kStatic:
      return removed ? Verdict::kLost : Verdict::kKept;
    case evaluate::Truth::kDynamic:
      return removed ? Verdict::kRemoved : Verdict::kMissed;
    case evaluate::Truth::kIgnored:
      break;
  }
  return Verdict::kUnjudged;
}

void VerdictRaster::mark(long x, long y, long width, long height, Verdict verdict, float tone) {
  const auto step = static_cast<std::uint8_t>(std::lround(kTones * std::clamp(tone, 0.0F, 1.0F)));
  const long x_end = std::min(x + width, static_cast<long>(width_));
  const long y_end = std::min(y + height, static_cast<long>(height_));
  for (long py = std::max(y, 0L); py < y_end; ++py) {
    for (long px = std::max(x, 0L); px < x_end; ++px) {
      Pixel& pixel = pixels_[static_cast<std::size_t>(py) * width_ + static_cast<std::size_t>(px)];
      if (verdict < pixel.verdict) continue;
      if (verdict > pixel.verdict) pixel.tone = 0;
      pixel.verdict = verdict;
      pixel.tone = std::max(pixel.tone, step);
    }
  }
}

void VerdictRaster::hint(long x, long y) { mark(x, y, 1, 1, Verdict::kNothing, 1.0F); }

Image VerdictRaster::paint() const {
  Image image(width_, height_, kPictureBackground);
  for (std::size_t y = 0; y < height_; ++y) {
    for (std::size_t x = 0; x < width_; ++x) {
      const Pixel& pixel = pixels_[y * width_ + x];
      image.at(x, y) = color_of(pixel.verdict, static_cast<float>(pixel.tone) / kTones);
    }
  }
  return image;
}

}  // namespace unimapper::apps
