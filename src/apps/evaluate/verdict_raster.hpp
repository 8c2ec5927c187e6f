// Pixels that show what became of the points under them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/apps/picture/image.hpp"

namespace unimapper::apps {

/// What became of a point, in the order in which one hides another: mistakes lie on top, so that a
/// single wrong point stays visible.
enum class Verdict : std::uint8_t {
  kNothing,   ///< no point
  kUnjudged,  ///< the truth says nothing of it
  kKept,      ///< static and kept
  kRemoved,   ///< dynamic and removed
  kLost,      ///< static and removed: false dynamic
  kMissed,    ///< dynamic and kept: false static
};

/// The verdict on a point whose label is `truth` and which the run labelled `predicted`.
[[nodiscard]] Verdict verdict_of(std::uint32_t truth, std::uint32_t predicted);

/// A picture that is filled point by point.
class VerdictRaster {
 public:
  VerdictRaster(std::size_t width, std::size_t height)
      : width_(width), height_(height), pixels_(width * height) {}

  /// Marks `width` x `height` pixels from (x, y), those outside left out. `tone` in [0, 1] is the
  /// brightness of points that are no mistake; the brightest of a pixel is shown.
  void mark(long x, long y, long width, long height, Verdict verdict, float tone);

  /// Brightens the background of a pixel where no point is.
  void hint(long x, long y);

  [[nodiscard]] Image paint() const;

 private:
  struct Pixel {
    Verdict verdict = Verdict::kNothing;
    std::uint8_t tone = 0;
  };
  std::size_t width_;
  std::size_t height_;
  std::vector<Pixel> pixels_;
};

}  // namespace unimapper::apps
