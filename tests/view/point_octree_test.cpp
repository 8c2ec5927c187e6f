// Tests of the octree of points and of its blocks.
#include "src/apps/view/point_octree.hpp"

#include "tests/random.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/view/gunzip.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using test::gunzip;
using test::number_at;

namespace {

ViewPoints random_points(std::size_t count, std::shared_ptr<merge::ScratchFile> file = nullptr) {
  test::Random random(3);
  ViewPoints points(std::move(file));
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](double range) { return static_cast<float>(random.uniform() * range); };
    ViewPoint point;
    point.position = {at(200.0) - 50.0F, at(120.0), at(12.0)};
    point.session = static_cast<std::uint8_t>(i % 3);
    point.category = static_cast<std::uint8_t>(i % 5);
    point.intensity = static_cast<std::uint8_t>(i % 7);
    points.push_back(point);
  }
  return points;
}

/// The points of a block.
std::vector<ViewPoint> decoded(const std::string& block) {
  const std::string bytes = gunzip(block);
  REQUIRE(bytes.substr(0, 4) == "UMPT");
  const auto version = number_at<std::uint32_t>(bytes, 4);
  const auto count = number_at<std::uint32_t>(bytes, 8);
  REQUIRE(bytes.size() == 28 + std::size_t{version == 2 ? 9U : 8U} * count);
  std::vector<ViewPoint> points(count);
  const auto step = number_at<float>(bytes, 24);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto steps = number_at<std::uint16_t>(bytes, 28 + 2 * (axis * count + i));
      points[i].position[static_cast<Eigen::Index>(axis)] =
          number_at<float>(bytes, 12 + 4 * axis) + step * static_cast<float>(steps);
    }
    points[i].session = number_at<std::uint8_t>(bytes, 28 + 6 * count + i);
    points[i].category = number_at<std::uint8_t>(bytes, 28 + 7 * count + i);
    if (version == 2) points[i].intensity = number_at<std::uint8_t>(bytes, 28 + 8 * count + i);
  }
  return points;
}

}  // namespace

TEST_CASE("no points and points that are not finite are in no node of the octree") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(make_octree({}).nodes.empty());
  ViewPoints points;
  for (const float x : {nan, -nan, std::numeric_limits<float>::infinity()}) {
    points.push_back({{x, 0.0F, 0.0F}, 0, 0});
  }
  CHECK(make_octree(points).nodes.empty());
  points.push_back({{3.0F, 4.0F, 5.0F}, 0, 0});
  const PointOctree octree = make_octree(points);
  REQUIRE(octree.nodes.size() == 1);
  CHECK(octree.nodes[0].points == 1);
  CHECK(octree.size_m < 2.0F);
}

TEST_CASE("every point is in one node of the octree, within a step of where it was") {
  const ViewPoints points = random_points(60000);
  const PointOctree octree = make_octree(points);
  REQUIRE(octree.nodes.size() > 8);
  std::vector<ViewPoint> found;
  for (const OctreeNode& node : octree.nodes) {
    const std::vector<ViewPoint> own = decoded(*octree.blocks.read(node.key));
    CHECK(own.size() == node.points);
    float size = octree.size_m;
    for (std::size_t level = 1; level < node.key.size(); ++level) size *= 0.5F;
    for (const ViewPoint& point : own) {
      const Eigen::AlignedBox3f around(node.bounds.min().array() - size / 65535.0F,
                                       node.bounds.max().array() + size / 65535.0F);
      REQUIRE(around.contains(point.position));
      found.push_back(point);
    }
  }
  REQUIRE(found.size() == points.size());
  const auto sum = [](const auto& all) {
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    for (const ViewPoint& point : all) total += point.position.cast<double>();
    return Eigen::Vector3d(total / static_cast<double>(all.size()));
  };
  CHECK((sum(found) - sum(points)).norm() < 0.002);
  for (std::uint8_t session = 0; session < 3; ++session) {
    const auto is_its = [session](const ViewPoint& p) { return p.session == session; };
    CHECK(std::count_if(found.begin(), found.end(), is_its) ==
          std::count_if(points.begin(), points.end(), is_its));
  }
}

TEST_CASE("blocks have intensities where one is known, and else not a byte more") {
  std::vector<ViewPoint> points(10);
  CHECK(point_block(points, Eigen::Vector3f::Zero(), 1.0F).size() == 28 + 8 * 10);
  points[3].intensity = 200;
  const std::string block = point_block(points, Eigen::Vector3f::Zero(), 1.0F);
  CHECK(decoded(gzipped(block))[3].intensity == 200);
  CHECK(make_octree(random_points(100)).has_intensity);
  ViewPoints without;
  without.push_back({Eigen::Vector3f::Zero(), 0, 0});
  CHECK_FALSE(make_octree(without).has_intensity);
}

TEST_CASE("nodes come by level, then by key, sparse and within their parent, each with its block") {
  const PointOctree octree = make_octree(random_points(60000));
  REQUIRE(octree.nodes.front().key == "r");
  std::set<std::string> keys;
  for (const OctreeNode& node : octree.nodes) {
    CHECK(node.points < 20000);
    CHECK(octree.blocks.read(node.key));
    if (node.key != "r") CHECK(keys.count(node.key.substr(0, node.key.size() - 1)) == 1);
    keys.insert(node.key);
  }
  CHECK_FALSE(octree.blocks.read("r77777777"));
  CHECK(std::is_sorted(octree.nodes.begin(), octree.nodes.end(),
                       [](const OctreeNode& a, const OctreeNode& b) {
                         return std::pair(a.key.size(), a.key) < std::pair(b.key.size(), b.key);
                       }));
}

TEST_CASE("points in a file give the same octree, and its blocks are in the file, too") {
  const TemporaryDirectory folder;
  const auto file = std::make_shared<merge::ScratchFile>(folder.path());
  const PointOctree there = make_octree(random_points(60000, file));
  const PointOctree here = make_octree(random_points(60000));
  REQUIRE(there.nodes.size() == here.nodes.size());
  for (std::size_t i = 0; i < here.nodes.size(); ++i) {
    CHECK(there.nodes[i].key == here.nodes[i].key);
    CHECK(there.blocks.read(here.nodes[i].key) == here.blocks.read(here.nodes[i].key));
  }
}

TEST_CASE("a hundred thousand points at one place end the division") {
  ViewPoints same;
  for (int i = 0; i < 100000; ++i) same.push_back({Eigen::Vector3f::Zero(), 0, 0});
  const PointOctree octree = make_octree(same);
  std::size_t points = 0;
  for (const OctreeNode& node : octree.nodes) points += node.points;
  CHECK(points == 100000);
}
