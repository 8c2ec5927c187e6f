// Tests of the DynamicMap_Benchmark reader: clouds in the world frame.
#include <catch2/catch.hpp>

#include "tests/ports/datasets/pcd_fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

TEST_CASE("DynamicMap scans come back in the sensor frame, without their ground truth") {
  const TemporaryDirectory directory;
  // The sensor stands at (1, 0, 0) and looks along the world's y axis.
  directory.write("pcd/000010.pcd",
                  binary_cloud("1 0 0 0.7071067811865476 0 0 0.7071067811865476"));
  directory.write("pcd/000011.pcd", binary_cloud());
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "000010");
  CHECK(dataset->stamp_ns(1) == 100'000'000);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(1, 0, 0));
  Scan scan;
  dataset->read_scan(0, scan);
  CHECK(scan.view()[0].isApprox(Eigen::Vector3f(2, 0, 3), 1e-6F));
  CHECK(scan.view()[1].isApprox(Eigen::Vector3f(2, -3, 3), 1e-6F));
  CHECK(scan.points[1].intensity == 0.0F);
  CHECK(dataset->labels(0) == std::vector<std::uint32_t>{9, 251});
}

TEST_CASE("DynamicMap clouds far from their origin keep their points in doubles, or are refused") {
  const TemporaryDirectory directory;
  const std::string header =
      "VERSION 0.7\nFIELDS x y z intensity\nSIZE 8 8 8 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 1\n"
      "HEIGHT 1\nVIEWPOINT 448262.25 5411904.5 312.125 1 0 0 0\nPOINTS 1\nDATA binary\n";
  const double point[] = {448263.281, 5411902.52, 312.155};
  const float intensity = 0.0F;
  std::string cloud = header;
  cloud.append(reinterpret_cast<const char*>(point), sizeof point);
  cloud.append(reinterpret_cast<const char*>(&intensity), sizeof intensity);
  directory.write("pcd/000000.pcd", cloud);
  Scan scan;
  open_dataset(directory.path(), {.format = "dynamicmap"})->read_scan(0, scan);
  CHECK(scan.view()[0].isApprox(Eigen::Vector3f(1.031F, -1.98F, 0.03F), 1e-6F));

  directory.write("pcd/000000.pcd", binary_cloud("448262.25 5411904.5 312.125 1 0 0 0"));
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path(), {.format = "dynamicmap"}); }),
             Contains("32-bit floats 5412 km") && Contains("64-bit floats"));
}

TEST_CASE("gt_cloud.pcd tells DynamicMap from other clouds with poses") {
  const TemporaryDirectory directory;
  directory.write("pcd/000000.pcd", binary_cloud("5 0 0 1 0 0 0"));
  directory.write("poses.txt", kIdentityLine);
  CHECK(open_dataset(directory.path())->pose(0).translation.x() == 0.0);
  directory.write("gt_cloud.pcd", binary_cloud());
  CHECK(open_dataset(directory.path())->pose(0).translation.x() == 5.0);
}

TEST_CASE("a viewpoint that is no pose is refused with its file") {
  const TemporaryDirectory directory;
  directory.write("pcd/000000.pcd", binary_cloud());
  directory.write("pcd/000001.pcd", binary_cloud("0 0 nan 1 0 0 0"));
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("000001.pcd") && Contains("VIEWPOINT"));
}

TEST_CASE("labels that are neither moving nor static are to be ignored") {
  const TemporaryDirectory directory;
  std::string cloud = binary_cloud();
  cloud.replace(cloud.size() - 4, 4, hex("00000040"));
  directory.write("pcd/000000.pcd", cloud);
  CHECK(open_dataset(directory.path(), {.format = "dynamicmap"})->labels(0) ==
        std::vector<std::uint32_t>{9, 0});
}
