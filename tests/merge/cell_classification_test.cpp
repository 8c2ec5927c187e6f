// Classification of a keyframe's cells from their evidence
#include "src/merge/labels/cell_classification.hpp"

#include "tests/test.hpp"
#include "unimapper/core/grid_size.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// What is known of the cells of one object, log-odds in thousandths.
struct Evidence {
  std::int32_t log_odds;
  std::uint8_t occupied = 0;
  bool ground = false;
  bool low = false;
  bool was_dynamic = false;
};

/// A keyframe's cells, box by box.
class Scene {
 public:
  /// Fills voxels from `from` on; returns the numbers of its cells.
  std::vector<std::uint32_t> add(const VoxelIndex& from, const VoxelIndex& size,
                                 const Evidence& evidence) {
    std::vector<std::uint32_t> numbers;
    for (std::int32_t z = 0; z < size.z; ++z) {
      for (std::int32_t y = 0; y < size.y; ++y) {
        for (std::int32_t x = 0; x < size.x; ++x) {
          numbers.push_back(static_cast<std::uint32_t>(cells_.size()));
          cells_.number.push_back(numbers.back());
          cells_.voxel.push_back(pack({from.x + x, from.y + y, from.z + z}));
          cells_.ground.push_back(evidence.ground ? 1 : 0);
          cells_.low.push_back(evidence.ground || evidence.low ? 1 : 0);
          cells_.was_dynamic.push_back(evidence.was_dynamic ? 1 : 0);
          cells_.log_odds.push_back(evidence.log_odds);
          cells_.occupied.push_back(evidence.occupied);
        }
      }
    }
    return numbers;
  }
  /// Share of some cells that are dynamic.
  [[nodiscard]] double dynamic(const std::vector<std::uint32_t>& of) const {
    const std::vector<std::uint8_t> labels = classify_cells(cells_, kFineCellSizeM);
    const auto count =
        std::count_if(of.begin(), of.end(), [&](std::uint32_t i) { return labels[i] != 0; });
    return static_cast<double>(count) / static_cast<double>(of.size());
  }

 private:
  CellEvidence cells_;
};

/// A wall that came into view with everything before it: nobody else observed it.
constexpr Evidence kFirstSeen{0};
constexpr Evidence kSeenThrough{1700};

// Constants of their own: GCC 12 at -O1 takes temporaries of an initialiser for dangling ones.
constexpr VoxelIndex kWallFrom{0, 0, 0};
constexpr VoxelIndex kWallSize{120, 1, 30};

/// A wall of first-seen cells, and the dynamic share of what touches it in front.
struct BesideWall {
  Scene scene;
  std::vector<std::uint32_t> wall = scene.add(kWallFrom, kWallSize, kFirstSeen);

  double share(const VoxelIndex& size, const Evidence& evidence) {
    return scene.dynamic(scene.add({20, 1, 2}, size, evidence));
  }
};

constexpr VoxelIndex kWalker{4, 3, 9};

}  // namespace

TEST_CASE("a walker who brushes past a wall that came into view with him is dynamic",
          "[refinement]") {
  BesideWall beside;
  CHECK(beside.share(kWalker, kSeenThrough) == 1.0);
  // What touches him is lost with him, the rest of the wall is not.
  CHECK(beside.scene.dynamic(beside.wall) < 0.05);
}

TEST_CASE("a part of a wall is static if it is small, or was observed, or hardly seen through",
          "[refinement]") {
  // A few cells that rays grazed.
  CHECK(BesideWall().share({2, 4, 2}, kSeenThrough) == 0.0);
  // One other keyframe observed it where it is.
  CHECK(BesideWall().share(kWalker, {kSeenThrough.log_odds, 1}) == 0.0);
  // The mean is over the cells of the wall that touch it as well.
  CHECK(BesideWall().share(kWalker, {250}) == 0.0);
  CHECK(BesideWall().share(kWalker, {800}) == 1.0);
  // Of a sheet of transparent cells and what is within reach of their mean, only a minority was
  // seen through itself.
  CHECK(BesideWall().share({6, 1, 6}, {2000}) == 0.0);
}

TEST_CASE("a car that parks and leaves within the window is dynamic where it stood",
          "[refinement]") {
  // Three keyframes observed it there, four saw through afterwards: -1.3 and +3.4.
  Scene scene;
  const auto street = scene.add({0, 0, -1}, {40, 20, 1}, {-2000, 6, true});
  const auto car = scene.add({5, 5, 2}, {20, 9, 6}, {2100, 3});
  CHECK(scene.dynamic(car) == 1.0);
  CHECK(scene.dynamic(street) == 0.0);
}

TEST_CASE("what stopped keeps the robot's label until others observed it there", "[refinement]") {
  // A car that has just stopped: the robot's label of 1.5 against cells of other keyframes.
  const auto share = [](std::int32_t others) {
    Scene scene;
    const auto car =
        scene.add({5, 5, 2}, {20, 9, 6}, {1500 - others * 425, static_cast<std::uint8_t>(others)});
    return scene.dynamic(car);
  };
  CHECK(share(3) == 1.0);
  CHECK(share(4) == 0.0);
  CHECK(share(6) == 0.0);
}

TEST_CASE("a component that says static on average is not dynamic as a whole", "[refinement]") {
  // Every other layer was seen through once, what lies between was often occupied: the mean of both
  // is what each cell goes by.
  const auto share = [](std::int32_t occupied) {
    Scene scene;
    scene.add({0, 0, 0}, {9, 9, 9}, {300});
    const auto rest = scene.add({9, 0, 0}, {9, 9, 9}, {occupied, 2});
    return scene.dynamic(rest);
  };
  CHECK(share(-600) > 0.99);
  CHECK(share(-800) < 0.2);
}

TEST_CASE("cells low above the ground follow what moves on them", "[refinement]") {
  Scene scene;
  scene.add({0, 0, 0}, {20, 20, 1}, {-2000, 6, true});
  const auto feet = scene.add({8, 8, 1}, {3, 3, 1}, {-400, 1, false, true});
  const auto walker = scene.add({8, 8, 2}, {3, 3, 7}, kSeenThrough);
  CHECK(scene.dynamic(walker) == 1.0);
  CHECK(scene.dynamic(feet) == 1.0);
}

TEST_CASE("a pole that the robot kept stays where rays beside it saw through", "[refinement]") {
  Scene scene;
  const auto pole = scene.add({0, 0, 0}, {1, 2, 12}, kSeenThrough);
  const auto person = scene.add({20, 0, 0}, {3, 3, 9}, kSeenThrough);
  const auto fragment = scene.add({40, 0, 0}, {1, 2, 4}, kSeenThrough);
  CHECK(scene.dynamic(pole) == 0.0);
  CHECK(scene.dynamic(person) == 1.0);
  CHECK(scene.dynamic(fragment) == 1.0);
  // What the robot removed is dynamic however narrow it is.
  const Evidence removed{kSeenThrough.log_odds, 0, false, false, true};
  const auto narrow = scene.add({60, 0, 0}, {1, 2, 12}, removed);
  CHECK(scene.dynamic(narrow) == 1.0);
}
