// The recording that other programs wrote in every form of a bag (see data/).
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "tests/folders.hpp"
#include "tests/ports/datasets/fixtures.hpp"

namespace unimapper::datasets::bag {

inline std::filesystem::path foreign_file(const std::string& name) {
  const std::filesystem::path file =
      std::filesystem::path(testing::source_folder()) / "tests/ports/datasets/bag/data" / name;
  REQUIRE(std::filesystem::file_size(file) > 0);
  return file;
}

/// Three scans with poses: a robot that drives along x at 10 m/s, its LiDAR 0.5 m ahead, 1.2 m
/// above it and turned left by 90 degrees.
inline void check_foreign_recording(const Dataset& dataset) {
  REQUIRE(dataset.scan_count() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(dataset.stamp_ns(i) == 100'000'000'000 + static_cast<std::int64_t>(i) * 100'000'000);
    const Pose& pose = dataset.pose(i);
    CHECK(pose.translation.isApprox(Eigen::Vector3d(static_cast<double>(i) + 0.5, 0.0, 1.2), 1e-9));
    CHECK(pose.rotation.col(0).isApprox(Eigen::Vector3d::UnitY(), 1e-9));
    const Scan scan = scan_of(dataset, i);
    REQUIRE(scan.points.size() == 2);
    CHECK(scan.view()[0] == Eigen::Vector3f(1, 2, 3));
    CHECK(scan.view()[1] == Eigen::Vector3f(4, 5, 6));
    CHECK(scan.points[1].intensity == 20.0F);
    CHECK(scan.ring == std::vector<std::uint16_t>{0, 2});
    REQUIRE(scan.time_s.size() == 2);
    CHECK(scan.time_s[1] == Approx(0.099));
  }
}

}  // namespace unimapper::datasets::bag
