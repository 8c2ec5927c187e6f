#include "src/apps/evaluate/outcome_raster.hpp"

#include <algorithm>
#include <cmath>

#include "src/apps/picture/palette.hpp"
#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {
namespace {

// Few tones compress well; more cannot be distinguished.
constexpr float kTones = 12.0F;
constexpr Rgb kGrey = {0.80F, 0.84F, 0.90F};

Rgb color_of(Outcome outcome, float tone) {
  switch (outcome) {
    case Outcome::kIgnored:
      return kGrey * (0.12F + 0.18F * tone);
    case Outcome::kKept:
      return kGrey * (0.25F + 0.65F * tone);
    case Outcome::kRemoved:
      return kRemovedColor;
    case Outcome::kLost:
      return kLostColor;
    case Outcome::kMissed:
      return kMissedColor;
    case Outcome::kEmpty:
      break;
  }
  return mix(kPictureBackground, kGrey, 0.25F * tone);
}

}  // namespace

Outcome outcome_of(std::uint32_t truth, std::uint32_t predicted) {
  const bool removed = evaluate::is_removed(predicted);
  switch (evaluate::truth_of(truth)) {
    case evaluate::Truth::kStatic:
      return removed ? Outcome::kLost : Outcome::kKept;
    case evaluate::Truth::kDynamic:
      return removed ? Outcome::kRemoved : Outcome::kMissed;
    case evaluate::Truth::kIgnored:
      break;
  }
  return Outcome::kIgnored;
}

void OutcomeRaster::mark(long x, long y, long width, long height, Outcome outcome, float tone) {
  const auto step = static_cast<std::uint8_t>(std::lround(kTones * std::clamp(tone, 0.0F, 1.0F)));
  const long x_end = std::min(x + width, static_cast<long>(width_));
  const long y_end = std::min(y + height, static_cast<long>(height_));
  for (long py = std::max(y, 0L); py < y_end; ++py) {
    for (long px = std::max(x, 0L); px < x_end; ++px) {
      Pixel& pixel = pixels_[static_cast<std::size_t>(py) * width_ + static_cast<std::size_t>(px)];
      if (outcome < pixel.outcome) continue;
      if (outcome > pixel.outcome) pixel.tone = 0;
      pixel.outcome = outcome;
      pixel.tone = std::max(pixel.tone, step);
    }
  }
}

void OutcomeRaster::hint(long x, long y) { mark(x, y, 1, 1, Outcome::kEmpty, 1.0F); }

Image OutcomeRaster::paint() const {
  Image image(width_, height_, kPictureBackground);
  for (std::size_t y = 0; y < height_; ++y) {
    for (std::size_t x = 0; x < width_; ++x) {
      const Pixel& pixel = pixels_[y * width_ + x];
      image.at(x, y) = color_of(pixel.outcome, static_cast<float>(pixel.tone) / kTones);
    }
  }
  return image;
}

}  // namespace unimapper::apps
