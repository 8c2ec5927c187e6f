#include "src/apps/evaluate/top_view.hpp"

#include <cmath>

namespace unimapper::apps {
namespace {

constexpr double kLocalMetresPerPixel = 0.1;
// Heights above the sensor between black and white: below any ground, above any first floor.
constexpr double kLowestM = -3.0;
constexpr double kHighestM = 5.0;

}  // namespace

TopView::TopView(const Frame& frame, long mistake_pixels)
    : frame_(frame), mistake_pixels_(mistake_pixels), raster_(frame.width, frame.height) {}

TopView TopView::around(const Pose& T_world_sensor) {
  const Eigen::Vector3d& center = T_world_sensor.translation;
  Frame frame;
  frame.min_x = center.x() - kLocalViewM;
  frame.max_y = center.y() + kLocalViewM;
  frame.metres_per_pixel = kLocalMetresPerPixel;
  frame.width = frame.height =
      static_cast<std::size_t>(std::lround(2.0 * kLocalViewM / kLocalMetresPerPixel));
  TopView view(frame, 3);
  view.add_rings(T_world_sensor);
  return view;
}

void TopView::add_rings(const Pose& T_world_sensor) {
  constexpr int kSteps = 4000;
  const Eigen::Vector3d& center = T_world_sensor.translation;
  for (const float radius : evaluate::kRangeBinEnds) {
    for (int i = 0; i < kSteps; ++i) {
      const double angle = 2.0 * M_PI * i / kSteps;
      const Eigen::Vector2d pixel =
          frame_.pixel(center.x() + static_cast<double>(radius) * std::cos(angle),
                       center.y() + static_cast<double>(radius) * std::sin(angle));
      raster_.hint(std::lround(std::floor(pixel.x())), std::lround(std::floor(pixel.y())));
    }
  }
}

void TopView::add(const evaluate::ScoredScan& scan) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!scan.points[i].allFinite()) continue;
    const Eigen::Vector3d p = scan.T_world_sensor * scan.points[i].cast<double>();
    const Eigen::Vector2d pixel = frame_.pixel(p.x(), p.y());
    // Far outside a pixel's number may not fit its type.
    if (!(pixel.cwiseAbs().maxCoeff() < 1e6)) continue;
    const double height = p.z() - scan.T_world_sensor.translation.z();
    const Outcome outcome = outcome_of(scan.truth[i], scan.predicted[i]);
    const long size = outcome >= Outcome::kLost ? mistake_pixels_ : 1;
    raster_.mark(static_cast<long>(std::floor(pixel.x())) - size / 2,
                 static_cast<long>(std::floor(pixel.y())) - size / 2, size, size, outcome,
                 static_cast<float>((height - kLowestM) / (kHighestM - kLowestM)));
  }
}

}  // namespace unimapper::apps
