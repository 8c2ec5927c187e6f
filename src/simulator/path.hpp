// Paths by arc length: lanes of the street grid and sidewalks around blocks.
#pragma once

#include <span>
#include <vector>

#include "town_plan.hpp"

namespace unimapper::simulator {

/// A polyline with arc length, open or closed, in town coordinates.
class Path {
 public:
  Path(std::vector<Vec2> points, bool closed);

  /// The path the other way round.
  [[nodiscard]] Path reversed() const;
  [[nodiscard]] double length() const { return length_; }
  /// Position at arc length `s`; wraps if closed, else continues straight past the ends.
  [[nodiscard]] Vec2 at(double s) const;
  /// Unit direction of travel, over `span` metres around `s`.
  [[nodiscard]] Vec2 heading(double s, double span = 2.6) const;
  /// Radians per metre, signed (left positive), over a few metres.
  [[nodiscard]] double curvature(double s) const;
  /// Arc length of the point nearest to `p`.
  [[nodiscard]] double nearest(Vec2 p) const;

  static constexpr double kStep = 0.5;  ///< metres between the polyline's points

 private:
  std::vector<Vec2> points_;  // kStep apart
  double length_ = 0.0;
  bool closed_ = false;
};

/// A closed path around a polygon, its corners rounded as people walk.
Path rounded_loop(const std::vector<Vec2>& corners);

/// Value at a fractional index of at least two samples: the first before them, beyond them the line
/// through the last two.
double interpolate(std::span<const double> samples, double index);

/// Fastest speed at every half metre of a closed path that respects `wish_m_s` (one per half
/// metre), curves, acceleration and braking.
std::vector<double> drivable_speed(const Path& path, std::vector<double> wish_m_s);

/// A crossing of the street grid.
struct Node {
  int i, j;
  friend bool operator==(Node, Node) = default;
};

/// The right-hand lane through `nodes` (each a neighbour of the one before, no U-turns), `offset`
/// metres right of the streets' centre lines.
Path lane_path(const TownPlan& plan, std::span<const Node> nodes, bool closed, double offset);

/// Once around `columns` by `rows` blocks, `from_centre` metres from the centre lines of the
/// streets around them; more than one block crosses the streets in between.
Path sidewalk_path(const TownPlan& plan, int column, int row, int columns, int rows,
                   double from_centre, bool clockwise);

}  // namespace unimapper::simulator
