// Navigation grids: ground that can be driven, obstacles, storeys, and what is unknown
#include "unimapper/merge/navigation_grid.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// A session that stands at one position, 1.5 m above ground, in the map's frame.
struct Scene {
  std::vector<SessionData> sessions{1};
  MergeResult result;

  Scene() {
    result.sessions.resize(1);
    result.sessions[0].status = SessionStatus::kCentral;
    stand({0.0, 0.0, 1.5});
  }

  void stand(const Eigen::Vector3d& sensor) {
    KeyframeRecord& keyframe = sessions[0].keyframes.emplace_back();
    Pose T_odometry_sensor;
    T_odometry_sensor.translation = sensor;
    keyframe.scans.push_back({0, 0, T_odometry_sensor});
    result.sessions[0].T_map_keyframe.emplace_back();
    result.sessions[0].refined.emplace_back();
  }

  void add(float x, float y, float z, bool ground) {
    sessions[0].keyframes[0].static_cells.push_back(
        {{x, y, z}, 1, static_cast<std::uint8_t>(ground ? 1 : 0), 0});
  }

  /// Ground at the centres of the cells of 0.2 m of a rectangle.
  void pave(double from_x, double to_x, double from_y, double to_y,
            const std::function<double(double)>& height_of_x) {
    for (double x = from_x + 0.1; x < to_x; x += 0.2) {
      for (double y = from_y + 0.1; y < to_y; y += 0.2) {
        add(static_cast<float>(x), static_cast<float>(y), static_cast<float>(height_of_x(x)), true);
      }
    }
  }

  [[nodiscard]] NavigationGrid grid(const GridOptions& options = {}) const {
    return navigation_grid(sessions, result, options);
  }
};

double level(double) { return 0.0; }

/// The cell at a position of the map; unknown outside of the grid.
GridCell cell(const NavigationGrid& grid, double x, double y) {
  const double column = std::floor((x - grid.origin.x()) / grid.resolution_m + 1e-9);
  const double row = std::floor((y - grid.origin.y()) / grid.resolution_m + 1e-9);
  if (column < 0.0 || row < 0.0 || column >= grid.width || row >= grid.height) {
    return GridCell::kUnknown;
  }
  return grid.at(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row));
}

}  // namespace

TEST_CASE("Ground is free, and what stands on it up to the robot's height is not", "[grid]") {
  Scene scene;
  scene.pave(-4, 6, -3, 3, level);
  scene.add(2.1F, 0.1F, 0.9F, false);    // a post
  scene.add(2.1F, 1.1F, 2.4F, false);    // a branch above
  scene.add(2.1F, -1.1F, 0.15F, false);  // grass
  const NavigationGrid grid = scene.grid();
  CHECK(grid.width == 50);
  CHECK(grid.height == 30);
  CHECK(grid.origin.x() == Approx(-4.0));
  CHECK(grid.origin.y() == Approx(-3.0));
  CHECK(cell(grid, 2.1, 0.1) == GridCell::kOccupied);
  CHECK(cell(grid, 2.1, 1.1) == GridCell::kFree);
  CHECK(cell(grid, 2.1, -1.1) == GridCell::kFree);
  CHECK(cell(grid, -3.9, -2.9) == GridCell::kFree);
  CHECK(grid.several_levels == 0);
  GridOptions taller;
  taller.clearance_m = 2.5;
  CHECK(cell(scene.grid(taller), 2.1, 1.1) == GridCell::kOccupied);
}

TEST_CASE("Gaps between rings are crossed, and beyond wider ones nothing is known", "[grid]") {
  Scene scene;
  scene.pave(-2, 2, -2, 2, level);
  scene.pave(2.4, 4, -2, 2, level);  // beyond a gap of 0.4 m
  scene.pave(6, 8, -2, 2, level);    // of 2 m
  const NavigationGrid grid = scene.grid();
  CHECK(cell(grid, 2.3, 0.1) == GridCell::kFree);
  CHECK(cell(grid, 3.1, 0.1) == GridCell::kFree);
  CHECK(cell(grid, 5.1, 0.1) == GridCell::kUnknown);
  CHECK(cell(grid, 7.1, 0.1) == GridCell::kUnknown);
}

TEST_CASE("A ramp is followed, a wall's top is not", "[grid]") {
  Scene scene;
  scene.pave(-2, 2, -2, 2, level);
  scene.pave(2, 12, -2, 2, [](double x) { return 0.2 * (x - 2.0); });
  scene.pave(-4, -2, -2, 2, [](double) { return 1.2; });
  const NavigationGrid grid = scene.grid();
  CHECK(cell(grid, 11.1, 0.1) == GridCell::kFree);
  CHECK(cell(grid, -3.9, 0.1) == GridCell::kUnknown);
  // What rises beside the ground that is known stands in its way.
  CHECK(cell(grid, -2.1, 0.1) == GridCell::kOccupied);
}

TEST_CASE("Of two storeys the grid has that which was driven first, and says so", "[grid]") {
  Scene scene;
  scene.stand({0.0, 0.0, 4.7});
  scene.pave(-3, 3, -3, 3, level);
  scene.pave(-3, 3, -3, 0, [](double) { return 3.2; });
  scene.add(1.1F, -1.1F, 4.2F, false);  // a car on the upper one
  const NavigationGrid grid = scene.grid();
  CHECK(cell(grid, 1.1, -1.1) == GridCell::kFree);
  CHECK(grid.several_levels == 30 * 15);
}

TEST_CASE("Only sessions in the map, their static cells, and finite ones are in the grid",
          "[grid]") {
  Scene scene;
  scene.pave(-2, 2, -2, 2, level);
  scene.sessions[0].keyframes[0].dynamic_cells.push_back({{1.1F, 0.1F, 1.0F}, 1, 0, 0});
  scene.add(std::numeric_limits<float>::quiet_NaN(), 0.0F, 1.0F, false);
  scene.add(3e8F, 0.0F, 1.0F, true);
  const NavigationGrid grid = scene.grid();
  CHECK(grid.width == 20);
  CHECK(cell(grid, 1.1, 0.1) == GridCell::kFree);
  scene.result.sessions[0].status = SessionStatus::kProvisional;
  CHECK(scene.grid().cells.empty());
}

TEST_CASE("A grid that would not fit into memory is refused", "[grid]") {
  Scene scene;
  scene.add(0.0F, 0.0F, 0.0F, true);
  scene.add(9e4F, 9e4F, 0.0F, true);
  CHECK_THROWS_WITH(scene.grid(), Catch::Contains("more than 2^28 cells"));
}
