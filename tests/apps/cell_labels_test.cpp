// Labels of points after the cells they went into
#include "src/apps/merge/cell_labels.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;

namespace {

/// In one cell along x and in the next, of 20 cm.
const Eigen::Vector3f kDynamic(0.18F, 0.05F, 0.05F);
const Eigen::Vector3f kStatic(0.39F, 0.05F, 0.05F);

/// A keyframe with a dynamic cell and a static one.
KeyframeRecord two_cells() {
  KeyframeRecord keyframe;
  keyframe.static_cells.push_back({kStatic, 1, 0, 0});
  keyframe.dynamic_cells.push_back({kDynamic, 1, 0, 0});
  return keyframe;
}

}  // namespace

TEST_CASE("a point has the label of the cell it went into, however near the mean of another") {
  const CellLabels labels(two_cells(), {});
  CHECK(labels.is_dynamic(kDynamic));
  CHECK(labels.is_dynamic({0.01F, 0.19F, 0.19F}));
  CHECK_FALSE(labels.is_dynamic({0.21F, 0.05F, 0.05F}));
  CHECK_FALSE(labels.is_dynamic(kStatic));
}

TEST_CASE("a point beside a dynamic cell that was left out of the keyframe is static") {
  const CellLabels labels(two_cells(), {});
  CHECK_FALSE(labels.is_dynamic({-0.01F, 0.05F, 0.05F}));
  CHECK_FALSE(labels.is_dynamic({0.18F, 0.21F, 0.05F}));
  CHECK_FALSE(labels.is_dynamic({0.18F, 0.05F, -0.01F}));
}

TEST_CASE("cells have the keyframe's size, and lie in the odometry's grid") {
  KeyframeRecord keyframe = two_cells();
  keyframe.cell_size_m = 0.25F;
  CHECK(CellLabels(keyframe, {}).is_dynamic({0.24F, 0.05F, 0.05F}));
  // The cells begin at -0.1 m and 0.1 m in the keyframe's frame.
  keyframe = two_cells();
  keyframe.T_odometry_keyframe.translation.x() = 500'000.1;
  const CellLabels shifted(keyframe, {});
  CHECK(shifted.is_dynamic({0.29F, 0.05F, 0.05F}));
  CHECK(shifted.is_dynamic({0.11F, 0.05F, 0.05F}));
  CHECK_FALSE(shifted.is_dynamic({0.09F, 0.05F, 0.05F}));
  CHECK_FALSE(shifted.is_dynamic({0.31F, 0.05F, 0.05F}));
}

TEST_CASE("refined labels replace the robot's") {
  const CellLabels labels(two_cells(), {.changed = {0, 1}});
  CHECK_FALSE(labels.is_dynamic(kDynamic));
  CHECK(labels.is_dynamic(kStatic));
}

TEST_CASE("points and cells without a finite position are static") {
  KeyframeRecord keyframe;
  keyframe.dynamic_cells.push_back({Eigen::Vector3f(1e30F, 0.0F, 0.0F), 1, 0, 0});
  const CellLabels labels(keyframe, {});
  CHECK_FALSE(labels.is_dynamic({1e30F, 0.0F, 0.0F}));
}

namespace {

/// The keyframe's origin in the odometry.
const Eigen::Vector3d kMiddleOfCell(0.1, 0.1, 0.0);

/// Flat ground of 3 m by 3 m whose cells' means lie at `z`, and a dynamic cell above its middle.
KeyframeRecord walker_on_ground(float z) {
  KeyframeRecord keyframe;
  keyframe.T_odometry_keyframe.translation = kMiddleOfCell;
  for (int x = -7; x <= 7; ++x) {
    for (int y = -7; y <= 7; ++y) {
      const Eigen::Vector3f at(0.2F * static_cast<float>(x), 0.2F * static_cast<float>(y), z);
      keyframe.static_cells.push_back({at, 10, 1, 0});
    }
  }
  keyframe.dynamic_cells.push_back({{0.0F, 0.0F, z + 0.3F}, 10, 0, 0});
  return keyframe;
}

}  // namespace

TEST_CASE("points of a ground cell are dynamic where they rise above the ground below a walker") {
  const float level = 0.05F;
  const CellLabels labels(walker_on_ground(level), {});
  CHECK(labels.is_dynamic({0.05F, 0.0F, level + 0.05F}));
  CHECK_FALSE(labels.is_dynamic({0.05F, 0.0F, level + 0.03F}));
  // Without anything dynamic above it, ground is as rough as it likes.
  CHECK_FALSE(labels.is_dynamic({1.05F, 0.0F, level + 0.05F}));
}

TEST_CASE("feet raise their own cell's mean, not the level of the ground around") {
  KeyframeRecord keyframe = walker_on_ground(0.05F);
  for (FineCell& cell : keyframe.static_cells) {
    if (cell.position.head<2>().norm() < 0.25F) cell.position.z() += 0.04F;
  }
  const CellLabels labels(keyframe, {});
  CHECK(labels.is_dynamic({0.05F, 0.0F, 0.10F}));
  CHECK_FALSE(labels.is_dynamic({0.05F, 0.0F, 0.08F}));
}

TEST_CASE("in a crowd the lower ground cells tell the level") {
  // Nothing but ground below walkers.
  KeyframeRecord keyframe;
  keyframe.T_odometry_keyframe.translation = kMiddleOfCell;
  for (int x = -2; x <= 2; ++x) {
    const float z = x % 2 == 0 ? 0.10F : 0.05F;
    keyframe.static_cells.push_back({{0.2F * static_cast<float>(x), 0.0F, z}, 10, 1, 0});
    keyframe.dynamic_cells.push_back({{0.2F * static_cast<float>(x), 0.0F, 0.35F}, 10, 0, 0});
  }
  const CellLabels labels(keyframe, {});
  CHECK(labels.is_dynamic({0.0F, 0.0F, 0.10F}));
  CHECK_FALSE(labels.is_dynamic({0.0F, 0.0F, 0.08F}));
}
