// Context coding of the bytes of free-space images
#pragma once

#include <array>
#include <cstdint>

#include "range_coder.hpp"

namespace unimapper::wire {

/// The probabilities of the bytes of `encode_image`, each after the kind of byte before it.
class ImageBytes {
 public:
  /// Forgets everything: before the images of a keyframe.
  void reset() noexcept {
    for (auto& models : models_) models.fill({});
    start_image();
  }
  /// Forgets the byte before, but not what bytes are likely.
  void start_image() noexcept { context_ = kFirst; }

  /// Codes a byte and returns it; the decoder's argument has no meaning.
  template <typename Coder>
  std::uint8_t code(Coder& coder, std::uint8_t byte) noexcept {
    std::array<BitModel, 256>& models = models_[context_];
    std::uint32_t node = 1;
    for (unsigned bit = 8; bit-- > 0;) {
      node = node << 1U | (coder.code_doubtful(((byte >> bit) & 1U) != 0, models[node]) ? 1U : 0U);
    }
    const auto coded = static_cast<std::uint8_t>(node);
    context_ = context_ == kInLiteral ? std::size_t{kAfterLiteral} : context_after(coded);
    return coded;
  }

 private:
  enum Context : std::uint8_t {
    kFirst,
    kInLiteral,
    kAfterLiteral,
    kAfterSinglePixel,
    kAfterShortRun,
    kAfterRun,
    kAfterStep,  ///< first of 24, one for four values of the byte each
  };
  static constexpr std::size_t kContexts = kAfterStep + 24;

  static std::size_t context_after(std::uint8_t byte) noexcept {
    if (byte == 0) return kAfterSinglePixel;
    if (byte < 8) return kAfterShortRun;
    if (byte < 0x80) return kAfterRun;
    if (byte >= 0xE0) return kInLiteral;
    return kAfterStep + (byte - 0x80U) / 4;
  }

  std::array<std::array<BitModel, 256>, kContexts> models_;
  std::size_t context_ = kFirst;
};

}  // namespace unimapper::wire
