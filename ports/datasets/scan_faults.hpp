// Faults of single scans, counted.
#pragma once

#include <memory>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Gives a scan that cannot be read as one without points, so that one damaged file or message does
/// not end a run. `notes` counts the faults of all scans read so far: those damaged, of which it
/// names the first with its reason, times of points that are of no sweep, that are missing in some
/// scans, or that change their unit. Reading throws DatasetError from the scan on that makes the
/// damaged ones a tenth of all. Scans get their fingerprint here.
std::unique_ptr<Dataset> with_counted_faults(std::unique_ptr<Dataset> dataset);

}  // namespace unimapper::datasets
