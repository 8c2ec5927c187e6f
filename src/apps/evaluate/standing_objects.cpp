#include "src/apps/evaluate/standing_objects.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::apps {
namespace {

/// A ray misses the outermost part of a box too easily, or grazes it.
constexpr double kCoreShare = 0.7;
/// Beyond the box, so that what was hit is something else.
constexpr double kBeyond_m = 0.5;
/// Of a scan; of larger ones every so many.
constexpr std::size_t kMostRays = 40000;
/// Returns, or rays, that make a scan one that saw the object.
constexpr std::size_t kRays = 3;

/// Rays from one position to one box.
class BoxRays {
 public:
  BoxRays(const UprightBox& box, const Eigen::Vector3d& origin)
      : T_box_world_(box.pose().inverse()), half_(0.5 * box.size), origin_(T_box_world_ * origin) {}

  void add(const Eigen::Vector3d& end) {
    const Eigen::Vector3d at = T_box_world_ * end;
    if ((at.array().abs() <= half_.array()).all()) {
      ++hits_;
    } else if (passes_to(at)) {
      ++through_;
    }
  }
  [[nodiscard]] bool is_hit() const { return hits_ >= kRays; }
  [[nodiscard]] bool is_seen_through() const { return through_ >= kRays; }

 private:
  /// Whether the ray leaves the core of the box well before its end.
  [[nodiscard]] bool passes_to(const Eigen::Vector3d& end) const {
    const Eigen::Vector3d ray = end - origin_;
    double enter = 0.0;
    double leave = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double half = kCoreShare * half_[axis];
      const double a = (-half - origin_[axis]) / ray[axis];
      const double b = (half - origin_[axis]) / ray[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave && (1.0 - leave) * ray.norm() > kBeyond_m;
  }

  Pose T_box_world_;
  Eigen::Vector3d half_;
  Eigen::Vector3d origin_;
  std::size_t hits_ = 0;
  std::size_t through_ = 0;
};

/// SemanticKITTI's classes of persons and vehicles that stand still.
bool can_stand(std::uint32_t label) {
  constexpr std::uint32_t kFirstVehicle = 10;
  constexpr std::uint32_t kLastPerson = 32;
  return label >= kFirstVehicle && label <= kLastPerson;
}

/// A scan with the boxes within reach of its sensor.
struct NearScan {
  const datasets::Dataset& dataset;
  std::size_t index;
  const Pose& T_world_sensor;
  const std::vector<datasets::Scan::Point>& points;
  std::vector<std::size_t> boxes;

  /// Calls `visit(end, number of the point)`, ends in the world frame, for up to `kMostRays`
  /// returns.
  template <typename Visit>
  void for_each_return(const Visit& visit) const {
    const std::size_t stride = 1 + points.size() / kMostRays;
    for (std::size_t p = 0; p < points.size(); p += stride) {
      visit(T_world_sensor * Eigen::Vector3d(points[p].x, points[p].y, points[p].z), p);
    }
  }
};

template <typename Visit>
void for_scans_near(const std::filesystem::path& recording, const std::vector<UprightBox>& boxes,
                    double reach_m, const Visit& visit) {
  const auto dataset = datasets::open_dataset(recording);
  const std::vector<Pose> truth = dataset->ground_truth_poses();
  if (truth.size() != dataset->scan_count()) {
    throw std::runtime_error(recording.string() + ": has no ground-truth poses");
  }
  datasets::Scan scan;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    std::vector<std::size_t> near;
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      if ((boxes[b].centre - truth[i].translation).norm() <= reach_m) near.push_back(b);
    }
    if (near.empty()) continue;
    dataset->read_scan(i, scan);
    visit(NearScan{*dataset, i, truth[i], scan.points, std::move(near)});
  }
}

}  // namespace

std::vector<evaluate::StandingObject> read_objects(const std::filesystem::path& directory) {
  const std::filesystem::path file = directory / "objects.txt";
  std::vector<evaluate::StandingObject> objects;
  const std::string text = datasets::read_file(file);
  datasets::for_each_row(text, [&](const datasets::Columns& columns, std::size_t line) {
    if (columns.count != 8) {
      throw std::runtime_error(file.string() + ": line " + std::to_string(line) +
                               " is not an object: label, x, y, z, yaw, length, width, height");
    }
    double v[8];
    for (std::size_t i = 0; i < 8; ++i) v[i] = datasets::parse_number(columns.text[i], file, line);
    evaluate::StandingObject object;
    object.label = static_cast<int>(v[0]);
    object.box = {{v[1], v[2], v[3]}, v[4], {v[5], v[6], v[7]}};
    objects.push_back(object);
  });
  return objects;
}

ObjectSightings count_sightings(const std::filesystem::path& recording,
                                const std::vector<UprightBox>& boxes, double reach_m) {
  ObjectSightings sightings;
  sightings.scans_hit.resize(boxes.size());
  sightings.scans_seen_through.resize(boxes.size());
  for_scans_near(recording, boxes, reach_m, [&](const NearScan& scan) {
    std::vector<BoxRays> rays;
    for (const std::size_t b : scan.boxes) {
      rays.emplace_back(boxes[b], scan.T_world_sensor.translation);
    }
    scan.for_each_return([&](const Eigen::Vector3d& end, std::size_t) {
      for (BoxRays& of_box : rays) of_box.add(end);
    });
    for (std::size_t n = 0; n < rays.size(); ++n) {
      sightings.scans_hit[scan.boxes[n]] += rays[n].is_hit() ? 1 : 0;
      sightings.scans_seen_through[scan.boxes[n]] += rays[n].is_seen_through() ? 1 : 0;
    }
  });
  return sightings;
}

std::vector<BoxReturns> count_returns(const std::filesystem::path& recording,
                                      const std::vector<UprightBox>& boxes, double reach_m) {
  constexpr double kMargin_m = 0.1;
  std::vector<BoxReturns> returns(boxes.size());
  for_scans_near(recording, boxes, reach_m, [&](const NearScan& scan) {
    const std::vector<std::uint32_t> labels = scan.dataset.labels(scan.index);
    if (labels.size() != scan.points.size()) {
      throw std::runtime_error(recording.string() + ": has no ground-truth labels");
    }
    scan.for_each_return([&](const Eigen::Vector3d& end, std::size_t point) {
      for (const std::size_t b : scan.boxes) {
        if (!boxes[b].contains(end, kMargin_m)) continue;
        ++(can_stand(labels[point] & 0xFFFFU) ? returns[b].standing : returns[b].others);
      }
    });
  });
  return returns;
}

}  // namespace unimapper::apps
