// Reader of DynamicMap_Benchmark recordings.
#include <algorithm>
#include <cstdio>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/label_values.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/pcd_sequence.hpp"
#include "ports/datasets/sequence.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

class DynamicMapDataset : public SequenceDataset {
 public:
  explicit DynamicMapDataset(Sequence sequence) : SequenceDataset(std::move(sequence)) {}

  void read_scan(std::size_t i, Scan& scan) const override {
    // Points become floats when they are near.
    scan.origin = pose(i).translation;
    parse_pcd(read_file(file(i)), file(i), scan);
    scan.origin.setZero();
    const Eigen::Matrix3d R_sensor_world = pose(i).rotation.transpose();
    for (Scan::Point& point : scan.points) {
      const Eigen::Vector3d p = R_sensor_world * Eigen::Vector3d(point.x, point.y, point.z);
      // The intensity is the ground truth and must not reach the pipeline.
      point = {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
               0.0F};
    }
  }

  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t i) const override {
    Scan scan;
    parse_pcd(read_file(file(i)), file(i), scan);
    std::vector<std::uint32_t> values;
    values.reserve(scan.points.size());
    for (const Scan::Point& point : scan.points) {
      const bool is_moving = point.intensity == 1.0F;
      const bool is_static = point.intensity == 0.0F;
      values.push_back(is_moving ? kLabelDynamic : is_static ? kLabelStatic : kLabelIgnored);
    }
    return values;
  }
};

PcdHeader read_header(const fs::path& file) {
  constexpr std::size_t kHeaderLimitBytes = 16384;
  return parse_pcd_header(read_file(file, kHeaderLimitBytes), file);
}

std::optional<Pose> find_viewpoint(const fs::path& file) { return read_header(file).viewpoint; }

Pose read_viewpoint(const fs::path& file) {
  const auto viewpoint = find_viewpoint(file);
  if (!viewpoint) {
    fail(file, "VIEWPOINT is not a finite position with a unit quaternion (tx ty tz qw qx qy qz)");
  }
  return *viewpoint;
}

/// True where any file has a viewpoint of its own: most writers leave the identity there.
bool have_viewpoints(const std::vector<fs::path>& files) {
  return std::any_of(files.begin(), files.end(), [](const fs::path& file) {
    const auto viewpoint = find_viewpoint(file);
    return !viewpoint || viewpoint->translation != Eigen::Vector3d::Zero() ||
           viewpoint->rotation != Eigen::Matrix3d::Identity();
  });
}

/// Coordinates of a map far from its origin do not fit 32-bit floats.
void refuse_rounded_points(const fs::path& file) {
  constexpr double kMostM = 0.01;
  const PcdHeader header = read_header(file);
  if (!header.viewpoint || header.coordinate_bytes > sizeof(float)) return;
  const double far_m = header.viewpoint->translation.cwiseAbs().maxCoeff();
  const double rounded_m = far_m * 0x1p-23;
  if (rounded_m <= kMostM) return;
  char text[256];
  std::snprintf(
      text, sizeof text,
      "its points are 32-bit floats %.0f km from the map's origin, where they are rounded "
      "to %.2f m: write x, y and z as 64-bit floats, or count from an origin nearby",
      far_m * 1e-3, rounded_m);
  fail(file, text);
}

}  // namespace

bool recognises_dynamic_map(const fs::path& directory) {
  const fs::path clouds = find_cloud_directory(directory);
  if (!holds(clouds, ".pcd")) return false;
  if (!find_child(directory, {"gt_cloud.pcd"}).empty()) return true;
  return find_poses_file(directory).empty() && have_viewpoints(list_files(clouds, ".pcd"));
}

std::unique_ptr<Dataset> open_dynamic_map(const fs::path& directory,
                                          const OpenOptions& /*options*/) {
  const fs::path clouds = find_cloud_directory(directory);
  if (clouds.empty()) fail(directory, "holds no pcd/ directory");
  Sequence sequence;
  sequence.files = list_files(clouds, ".pcd");
  if (sequence.files.empty()) fail(clouds, "holds no *.pcd scans");
  if (sequence.files.size() > 1 && !have_viewpoints(sequence.files)) {
    fail(clouds, "every VIEWPOINT is the identity, so the files do not say where the sensor was; " +
                     remedy_for_missing_poses());
  }
  refuse_rounded_points(sequence.files.front());
  for (const fs::path& file : sequence.files) {
    sequence.stamps_ns.push_back(static_cast<std::int64_t>(sequence.poses.size()) *
                                 kDefaultPeriod_ns);
    sequence.poses.push_back(read_viewpoint(file));
  }
  sequence.notes.push_back(
      {"points are taken to lie in the world, and VIEWPOINT for where they were seen from; if they "
       "lie in the sensor's frame, write the viewpoints as poses.txt (t x y z qx qy qz qw)",
       false, true});
  return std::make_unique<DynamicMapDataset>(std::move(sequence));
}

}  // namespace unimapper::datasets
