// Raster of classification outcomes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/apps/picture/image.hpp"

namespace unimapper::apps {

/// Classification outcome of a point, in drawing order: mistakes are drawn on top, so that a single
/// wrong point stays visible.
enum class Outcome : std::uint8_t {
  kEmpty,    ///< no point
  kIgnored,  ///< without ground truth
  kKept,     ///< static and kept
  kRemoved,  ///< dynamic and removed
  kLost,     ///< static and removed: false dynamic
  kMissed,   ///< dynamic and kept: false static
};

/// The outcome of a point whose true label is `truth` and which the run labelled `predicted`.
[[nodiscard]] Outcome outcome_of(std::uint32_t truth, std::uint32_t predicted);

/// Image that is filled point by point.
class OutcomeRaster {
 public:
  OutcomeRaster(std::size_t width, std::size_t height)
      : width_(width), height_(height), pixels_(width * height) {}

  /// Marks `width` x `height` pixels from (x, y), those outside left out. `tone` in [0, 1] is the
  /// brightness of points that are no mistake; the brightest of a pixel is shown.
  void mark(long x, long y, long width, long height, Outcome outcome, float tone);

  /// Brightens the background of a pixel where no point is.
  void hint(long x, long y);

  [[nodiscard]] Image paint() const;

 private:
  struct Pixel {
    Outcome outcome = Outcome::kEmpty;
    std::uint8_t tone = 0;
  };
  std::size_t width_;
  std::size_t height_;
  std::vector<Pixel> pixels_;
};

}  // namespace unimapper::apps
