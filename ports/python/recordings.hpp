// Recordings as Python holds them.
#pragma once

#include <memory>
#include <mutex>

#include "ports/datasets/dataset.hpp"

namespace unimapper::python {

/// A recording; its readers keep positions in files, so one thread at a time reads.
struct Recording {
  std::unique_ptr<datasets::Dataset> dataset;  ///< never null
  std::mutex mutex;                            ///< held while a scan is read
};

/// A scan that was read, with what the recording says of it.
struct RecordedScan {
  datasets::Scan scan;        ///< points, times and rings
  Pose T_odometry_sensor;     ///< identity where there are no poses
  std::int64_t stamp_ns = 0;  ///< of the scan
  std::string name;           ///< stem of its file
};

}  // namespace unimapper::python
