#include "src/apps/truth.hpp"

#include "ports/datasets/dataset.hpp"

namespace unimapper::apps {

std::vector<evaluate::StampedPose> read_truth(const std::filesystem::path& path) {
  const auto dataset = datasets::open_dataset(path);
  const std::vector<Pose> truth = dataset->ground_truth_poses();
  std::vector<evaluate::StampedPose> poses;
  poses.reserve(dataset->scan_count());
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    poses.push_back({dataset->stamp_ns(i), truth.empty() ? dataset->pose(i) : truth[i]});
  }
  return poses;
}

}  // namespace unimapper::apps
