// Ground-truth trajectory of a recording.
#pragma once

#include <filesystem>
#include <vector>

#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::apps {

/// The ground truth of the dataset at `path`, one pose per scan: gt_poses.txt where it is
/// there, else poses.txt, with the dataset's stamps. Throws DatasetError.
[[nodiscard]] std::vector<evaluate::StampedPose> read_truth(const std::filesystem::path& path);

}  // namespace unimapper::apps
