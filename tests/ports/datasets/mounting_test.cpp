// Tests of mounted LiDARs and of several LiDARs as one.
#include "ports/datasets/mounting.hpp"

#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;

namespace {

const Eigen::Vector3d kLandmark(10.0, 2.0, 1.0);

Pose base_at(double time_s) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * time_s, Eigen::Vector3d::UnitZ())),
          {2.0 * time_s, 0.0, 0.0}};
}

Pose mounting(double x, double yaw) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, 0.1, 0.8}};
}

/// Scans of one point each, the landmark, every 0.1 s after `first_s`.
class Landmark : public Dataset {
 public:
  Landmark(const Pose& T_base_lidar, bool has_poses_of_base, double first_s = 0.1,
           double late_s = 0.0)
      : first_s_(first_s) {
    for (std::size_t i = 0; i < 10; ++i) {
      const double time_s = 1e-9 * static_cast<double>(stamp_ns(i));
      const Pose T_world_lidar = base_at(time_s) * T_base_lidar;
      seen_.push_back((T_world_lidar.inverse() * kLandmark).cast<float>());
      const Pose given = base_at(time_s - late_s);
      poses_.push_back(has_poses_of_base ? given : given * T_base_lidar);
    }
  }
  [[nodiscard]] std::size_t scan_count() const override { return poses_.size(); }
  void read_scan(std::size_t i, Scan& scan) const override {
    scan.reset(0);
    scan.points.push_back({seen_[i].x(), seen_[i].y(), seen_[i].z(), 0.5F});
    scan.ring.push_back(3);
  }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
    return static_cast<std::int64_t>(1e9 * first_s_) + 100'000'000 * static_cast<std::int64_t>(i);
  }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return std::to_string(i); }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return poses_; }

 private:
  double first_s_;
  std::vector<Pose> poses_;
  std::vector<Eigen::Vector3f> seen_;
};

Eigen::Vector3d point_in_world(const Dataset& dataset, std::size_t scan, std::size_t point = 0) {
  const Scan read = scan_of(dataset, scan);
  const Scan::Point& p = read.points.at(point);
  return dataset.pose(scan) * Eigen::Vector3d(p.x, p.y, p.z);
}

double error_m(const Dataset& dataset, std::size_t scan, std::size_t point = 0) {
  return (point_in_world(dataset, scan, point) - kLandmark).norm();
}

/// One LiDAR and a second one, whose first scan is at `second_first_s`.
std::unique_ptr<Dataset> pair_of(const Pose& second, double second_first_s) {
  std::vector<std::unique_ptr<Dataset>> datasets;
  datasets.push_back(std::make_unique<Landmark>(mounting(0.3, 0.0), false));
  datasets.push_back(std::make_unique<Landmark>(second, false, second_first_s));
  return several_lidars(std::move(datasets));
}

}  // namespace

TEST_CASE("poses of the base become those of the LiDAR") {
  const Pose T_base_lidar = mounting(0.4, 1.0);
  CHECK(error_m(Landmark(T_base_lidar, true), 5) > 1.0);
  const auto dataset = mounted(std::make_unique<Landmark>(T_base_lidar, true), T_base_lidar);
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    CHECK(error_m(*dataset, i) < 1e-5);
    CHECK((dataset->ground_truth_poses()[i].translation - dataset->pose(i).translation).norm() <
          1e-12);
  }
}

TEST_CASE("poses that are late take a negative offset, early ones a positive one") {
  const double late_s = GENERATE(-0.15, -0.05, 0.05, 0.15);
  CHECK(error_m(Landmark({}, true, 0.1, late_s), 5) > 0.05);
  const auto dataset = retimed(std::make_unique<Landmark>(Pose(), true, 0.1, late_s), -late_s);
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    const bool is_at_end = i < 2 || i + 2 >= dataset->scan_count();
    CHECK(error_m(*dataset, i) < (is_at_end ? 0.03 : 1e-3));  // the last motion goes on
  }
}

TEST_CASE("the odometry of a LiDAR that hangs upside down is turned over, not its points") {
  const auto dataset = turned_over(std::make_unique<Landmark>(Pose(), true));
  const Eigen::Vector3d turned(kLandmark.x(), -kLandmark.y(), -kLandmark.z());
  CHECK((point_in_world(*dataset, 5) - turned).norm() < 1e-5);
}

TEST_CASE("points of a second LiDAR lie in the first one's frame unless too far apart in time") {
  for (const auto& [first_s, scans] : {std::pair(0.13, 10U), std::pair(0.56, 5U)}) {
    const auto dataset = pair_of(mounting(-0.1, 3.0), first_s);
    REQUIRE(dataset->scan_count() == 10);
    CHECK(scan_of(*dataset, 0).points.size() == (scans == 10 ? 2 : 1));
    const Scan scan = scan_of(*dataset, 9);
    CHECK(scan.points.size() == 2);
    CHECK(scan.ring.empty());
    CHECK(error_m(*dataset, 9, 0) < 1e-5);
    CHECK(error_m(*dataset, 4, 0) < 1e-5);
    if (scans == 10) CHECK(error_m(*dataset, 4, 1) < 1e-5);
    if (scans == 10) CHECK(dataset->notes().size() == 1);
    CHECK(dataset->notes()[0].text.find("LiDAR 2 added to " + std::to_string(scans) +
                                        " of 10 scans") == 0);
  }
}

TEST_CASE("LiDARs far from each other are warned of") {
  CHECK_FALSE(pair_of(mounting(0.0, 3.0), 0.1)->notes()[0].is_warning);
  CHECK(pair_of(mounting(-3.0, 3.0), 0.1)->notes()[0].is_warning);
}
