// Two-dimensional occupancy grid by following the ground from the sessions' ways
#include "unimapper/merge/navigation_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "structure_columns.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::merge {
namespace {

constexpr double kSteepest = 0.5;       // rise per way
constexpr double kGroundNoise_m = 0.1;  // of the heights of two neighbouring cells
constexpr double kGap_m = 0.6;          // rings of a LiDAR leave gaps
constexpr double kSensorReach_m = 3.0;  // around a sensor in which ground below it is looked for
constexpr double kSensorHeight_m = 4.0;

constexpr float kNoLevel = std::numeric_limits<float>::quiet_NaN();

/// Another cell of the grid, relative to one.
struct Step {
  std::int64_t x;
  std::int64_t y;
  double way_m;
};

/// Level of the ground by cell, followed outward from below the sensors.
class GroundLevels {
 public:
  GroundLevels(const StructureColumns& columns, const GridOptions& options)
      : columns_(columns), options_(options) {
    const std::size_t count = static_cast<std::size_t>(columns.width()) * columns.height();
    level_m_.assign(count, kNoLevel);
    is_on_several_.assign(count, 0);
    is_visited_.assign(columns.size(), 0);
    steps_ = steps_within(kGap_m);
  }

  /// Follows the ground below a sensor, map frame, as far as it goes. What was followed before
  /// keeps its level.
  void follow_from(const Eigen::Vector3d& sensor) {
    const std::optional<std::size_t> here = columns_.column(sensor);
    if (!here) return;
    const std::optional<Surface> start = surface_below(sensor, *here);
    if (!start) return;
    std::vector<Surface> queue;
    visit(*start, queue);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const float level_m = columns_.entry(queue[i].entry).z_m;
      for (const Step& step : steps_) {
        const std::optional<std::size_t> cell = neighbour(queue[i].cell, step);
        if (!cell) continue;
        const auto most = static_cast<float>(kSteepest * step.way_m + kGroundNoise_m);
        for (std::size_t e = columns_.begin(*cell); e < columns_.end(*cell); ++e) {
          const StructureColumns::Entry& entry = columns_.entry(e);
          if (entry.ground && std::abs(entry.z_m - level_m) <= most) visit({*cell, e}, queue);
        }
      }
    }
  }

  [[nodiscard]] bool is_reached(std::size_t cell) const { return !std::isnan(level_m_[cell]); }
  [[nodiscard]] std::size_t several_levels() const {
    return static_cast<std::size_t>(
        std::count(is_on_several_.begin(), is_on_several_.end(), std::uint8_t{1}));
  }

  /// Of the cell, or of the nearest reached one across a gap; NaN: none.
  [[nodiscard]] float level_around(std::size_t cell) const {
    if (is_reached(cell)) return level_m_[cell];
    for (const Step& step : steps_) {
      const std::optional<std::size_t> other = neighbour(cell, step);
      if (other && is_reached(*other)) return level_m_[*other];
    }
    return kNoLevel;
  }

  /// Whether ground was reached on two opposite sides of the cell, no farther than a gap.
  [[nodiscard]] bool is_between_ground(std::size_t cell) const {
    return std::any_of(steps_.begin(), steps_.end(), [&](const Step& step) {
      const std::optional<std::size_t> one = neighbour(cell, step);
      const std::optional<std::size_t> other = neighbour(cell, {-step.x, -step.y, step.way_m});
      return one && other && is_reached(*one) && is_reached(*other);
    });
  }

 private:
  /// Ground of a cell: an entry of its column.
  struct Surface {
    std::size_t cell;
    std::size_t entry;
  };

  /// All steps but none, from the shortest.
  [[nodiscard]] std::vector<Step> steps_within(double reach_m) const {
    const double resolution_m = options_.resolution_m;
    // The neighbours always, however large the cells are.
    const auto most =
        std::max<std::int64_t>(1, static_cast<std::int64_t>(reach_m / resolution_m + 1e-9));
    std::vector<Step> steps;
    for (std::int64_t y = -most; y <= most; ++y) {
      for (std::int64_t x = -most; x <= most; ++x) {
        if (x == 0 && y == 0) continue;
        steps.push_back({x, y, resolution_m * std::sqrt(static_cast<double>(x * x + y * y))});
      }
    }
    std::stable_sort(steps.begin(), steps.end(),
                     [](const Step& a, const Step& b) { return a.way_m < b.way_m; });
    return steps;
  }

  [[nodiscard]] std::optional<std::size_t> neighbour(std::size_t cell, const Step& step) const {
    const std::int64_t width = columns_.width();
    const std::int64_t x = static_cast<std::int64_t>(cell) % width + step.x;
    const std::int64_t y = static_cast<std::int64_t>(cell) / width + step.y;
    if (x < 0 || y < 0 || x >= width || y >= columns_.height()) return std::nullopt;
    return static_cast<std::size_t>(y * width + x);
  }

  /// The highest ground below a sensor in the nearest cell that has any.
  [[nodiscard]] std::optional<Surface> surface_below(const Eigen::Vector3d& sensor,
                                                     std::size_t here) const {
    for (const Step& step : steps_within(kSensorReach_m)) {
      const std::optional<std::size_t> cell = neighbour(here, step);
      if (!cell) continue;
      for (std::size_t e = columns_.end(*cell); e-- > columns_.begin(*cell);) {
        const double below_m = sensor.z() - static_cast<double>(columns_.entry(e).z_m);
        if (!columns_.entry(e).ground || below_m <= 0.0 || below_m > kSensorHeight_m) continue;
        return Surface{*cell, e};
      }
    }
    return std::nullopt;
  }

  void visit(const Surface& surface, std::vector<Surface>& queue) {
    if (is_visited_[surface.entry] != 0) return;
    is_visited_[surface.entry] = 1;
    queue.push_back(surface);
    const float level_m = columns_.entry(surface.entry).z_m;
    float& of_cell_m = level_m_[surface.cell];
    if (std::isnan(of_cell_m)) {
      of_cell_m = level_m;
    } else if (std::abs(of_cell_m - level_m) >= static_cast<float>(options_.clearance_m)) {
      is_on_several_[surface.cell] = 1;
    }
  }

  const StructureColumns& columns_;
  const GridOptions& options_;
  std::vector<float> level_m_;
  std::vector<std::uint8_t> is_on_several_;
  std::vector<std::uint8_t> is_visited_;  ///< by entry of the columns
  std::vector<Step> steps_;
};

GridCell classify(std::size_t cell, const StructureColumns& columns, const GroundLevels& levels,
                  const GridOptions& options) {
  const float level_m = levels.level_around(cell);
  if (std::isnan(level_m)) return GridCell::kUnknown;
  for (std::size_t e = columns.begin(cell); e < columns.end(cell); ++e) {
    const double above_m = static_cast<double>(columns.entry(e).z_m) - static_cast<double>(level_m);
    if (above_m >= options.obstacle_m && above_m < options.clearance_m) return GridCell::kOccupied;
  }
  const bool free = levels.is_reached(cell) || levels.is_between_ground(cell);
  return free ? GridCell::kFree : GridCell::kUnknown;
}

}  // namespace

NavigationGrid navigation_grid(const std::vector<SessionData>& sessions, const MergeResult& result,
                               const GridOptions& options) {
  const StructureColumns columns(sessions, result, options.resolution_m);
  GroundLevels levels(columns, options);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (!is_in_map(result.sessions[s].status)) continue;
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      const Pose T_map_sensor =
          result.sessions[s].T_map_keyframe[k] * reference_sensor_pose(sessions[s].keyframes[k]);
      levels.follow_from(T_map_sensor.translation);
    }
  }
  NavigationGrid grid;
  grid.resolution_m = options.resolution_m;
  grid.origin = columns.origin();
  grid.width = columns.width();
  grid.height = columns.height();
  grid.several_levels = levels.several_levels();
  grid.cells.resize(static_cast<std::size_t>(grid.width) * grid.height);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    grid.cells[i] = classify(i, columns, levels, options);
  }
  return grid;
}

}  // namespace unimapper::merge
