// Compensation of the sensor's motion within sweeps.
#pragma once

#include <memory>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/sweep_check.hpp"

namespace unimapper::datasets {

/// The dataset with every point where it would have been measured at the scan's stamp, by the time
/// of the point and the poses in between: those of the odometry where the dataset has them
/// (`pose_at`), else those of the scans. A note says what was done and why. With `kOff`, or
/// where compensating does not make scans sharper, the scans stay as they are. Throws DatasetError.
[[nodiscard]] std::unique_ptr<Dataset> deskewed(std::unique_ptr<Dataset> dataset,
                                                Deskew mode = Deskew::kAuto);

}  // namespace unimapper::datasets
