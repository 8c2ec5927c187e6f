// Colour palette shared by pictures, charts and legends.
#pragma once

#include <array>
#include <cstddef>

#include "src/apps/picture/image.hpp"

namespace unimapper::apps {

// Session colours avoid red and green, which mean dynamic, gone, found and new.
inline constexpr std::array<Rgb, 8> kSessionColors = {{{0.35F, 0.65F, 1.00F},
                                                       {1.00F, 0.69F, 0.25F},
                                                       {0.72F, 0.55F, 1.00F},
                                                       {0.25F, 0.84F, 0.82F},
                                                       {1.00F, 0.55F, 0.80F},
                                                       {0.86F, 0.86F, 0.36F},
                                                       {0.80F, 0.62F, 0.46F},
                                                       {0.55F, 0.62F, 0.80F}}};
inline constexpr Rgb kSharedColor = {0.86F, 0.88F, 0.92F};  ///< seen by several sessions
inline constexpr Rgb kDynamicColor = {1.00F, 0.24F, 0.27F};
inline constexpr Rgb kAcceptedColor = {0.24F, 0.90F, 0.45F};
inline constexpr Rgb kRefusedColor = {0.66F, 0.68F, 0.72F};
// Classification outcome of a point.
inline constexpr Rgb kRemovedColor = {0.25F, 0.55F, 1.00F};  ///< dynamic, and removed
inline constexpr Rgb kLostColor = {1.00F, 0.62F, 0.10F};     ///< static, but removed
inline constexpr Rgb kMissedColor = {1.00F, 0.12F, 0.16F};   ///< dynamic, but kept
inline constexpr Rgb kPictureBackground = {0.047F, 0.062F, 0.086F};

[[nodiscard]] inline const Rgb& session_color(std::size_t session) {
  return kSessionColors[session % kSessionColors.size()];
}

}  // namespace unimapper::apps
