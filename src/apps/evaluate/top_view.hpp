// Top view of labelled scans.
#pragma once

#include "src/apps/evaluate/outcome_raster.hpp"
#include "src/apps/picture/raster.hpp"
#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {

/// Half the side of the piece of ground a local view shows, metres.
inline constexpr double kLocalViewM = 50.0;

/// Points in the world frame, grey by their height above the sensor; removed and wrongly labelled
/// points in colours.
class TopView {
 public:
  /// Mistakes are `mistake_pixels` wide.
  TopView(const Frame& frame, long mistake_pixels);

  /// The ground within 50 m of a sensor, north up, with rings at the range bins' ends.
  [[nodiscard]] static TopView around(const Pose& T_world_sensor);

  void add(const evaluate::ScoredScan& scan);
  [[nodiscard]] Image paint() const { return raster_.paint(); }

 private:
  void add_rings(const Pose& T_world_sensor);

  Frame frame_;
  long mistake_pixels_;
  OutcomeRaster raster_;
};

}  // namespace unimapper::apps
