#include "src/apps/evaluate/ply_cloud.hpp"

#include "ports/datasets/files.hpp"
#include "ports/datasets/ply.hpp"

namespace unimapper::apps {

std::vector<Eigen::Vector3f> read_ply_positions(const std::filesystem::path& file) {
  datasets::Scan scan;
  datasets::parse_ply(datasets::read_file(file), file, scan);
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  for (const datasets::Scan::Point& point : scan.points) {
    const Eigen::Vector3f p(point.x, point.y, point.z);
    if (p.allFinite()) points.push_back(p);
  }
  return points;
}

}  // namespace unimapper::apps
