// Range image of a labelled scan.
#pragma once

#include "src/apps/picture/image.hpp"
#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {

/// Azimuth to the right (left is left of the sensor, straight ahead in the middle of a full turn),
/// elevation upwards; bright is near. Spans the angles the scan holds points at; heights are
/// stretched.
[[nodiscard]] Image draw_range_image(const evaluate::ScoredScan& scan);

}  // namespace unimapper::apps
