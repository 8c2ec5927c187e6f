// Facades: walls with openings.
#pragma once

#include "mesh.hpp"

namespace unimapper::simulator {

/// A wall in its own plane: x along it, z up, y into the building.
struct Wall {
  Mesh& mesh;
  Frame frame;
  Surface surface;

  /// At depth `y`.
  void rectangle(double x0, double z0, double x1, double z1, double y, Surface s) const {
    mesh.quad(frame({x0, y, z0}), frame({x1, y, z0}), frame({x1, y, z1}), frame({x0, y, z1}), s);
  }
  void box(Vec3 low, Vec3 high, Surface s) const { mesh.box(frame, low, high, s); }
};

/// A hole in a wall, in the wall's coordinates.
struct Opening {
  double x0, z0, x1, z1;
  double recess;  ///< how far behind the wall the pane or door is
};

/// Wall of a cell with an opening cut out of it, and the four faces of the reveal.
void add_cell_with_opening(const Wall& wall, double x0, double z0, double x1, double z1,
                           const Opening& o);
/// Pane and frame of a window in an opening.
void add_window(const Wall& wall, const Opening& o, bool has_cross_bar, bool has_sill);

}  // namespace unimapper::simulator
