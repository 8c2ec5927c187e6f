// Rings of points at one elevation, which form only in the sensor's frame
#pragma once

#include <span>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// `AgreementFigures::ring_gain` of scans whose poses are `poses`, metres from the first; of a
/// part of their points.
[[nodiscard]] double measure_ring_gain(std::span<const datasets::Scan* const> scans,
                                       std::span<const Pose> poses);

/// `AgreementFigures::ring_loss`, the first scan against the median of the others; of a part of
/// their points.
[[nodiscard]] double measure_ring_loss(std::span<const datasets::Scan* const> scans);

}  // namespace unimapper::input
