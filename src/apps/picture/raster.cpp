#include "src/apps/picture/raster.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "src/core/quantile.hpp"

namespace unimapper::apps {

Extent::Range Extent::range(int axis) const {
  constexpr double kAroundPathM = 65.0;
  Range all{-5.0, 5.0};
  if (!scenery_.empty()) {
    std::vector<float> values;
    values.reserve(scenery_.size());
    for (const Eigen::Vector2f& p : scenery_) values.push_back(p[axis]);
    all.from = static_cast<double>(unimapper::quantile(std::span(values), 0.002));
    all.to = static_cast<double>(unimapper::quantile(std::span(values), 0.998));
  }
  if (path_.empty()) return all;
  Range path{path_.front()[axis], path_.front()[axis]};
  for (const Eigen::Vector2d& p : path_) {
    path.from = std::min(path.from, p[axis]);
    path.to = std::max(path.to, p[axis]);
  }
  return {std::min(path.from, std::max(all.from, path.from - kAroundPathM)),
          std::max(path.to, std::min(all.to, path.to + kAroundPathM))};
}

Frame Extent::fit(std::size_t max_pixels, double min_metres_per_pixel) const {
  Range x = range(0);
  Range y = range(1);
  const double margin = 0.015 * std::max(x.to - x.from, y.to - y.from) + 1.0;
  x = {x.from - margin, x.to + margin};
  y = {y.from - margin, y.to + margin};
  Frame frame;
  frame.min_x = x.from;
  frame.max_y = y.to;
  frame.metres_per_pixel =
      std::max(std::max(x.to - x.from, y.to - y.from) / static_cast<double>(max_pixels),
               min_metres_per_pixel);
  const auto pixels = [&](const Range& r) {
    const double count = std::ceil((r.to - r.from) / frame.metres_per_pixel);
    return std::clamp<std::size_t>(static_cast<std::size_t>(count), 1, max_pixels);
  };
  frame.width = pixels(x);
  frame.height = pixels(y);
  return frame;
}

float Layer::quantile(double share) const {
  std::vector<float> filled;
  for (const float amount : amounts_) {
    if (amount > 0.0F) filled.push_back(amount);
  }
  if (filled.empty()) return 1.0F;
  return unimapper::quantile(std::span(filled), share);
}

}  // namespace unimapper::apps
