// Projected coordinate systems, by PROJ.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "src/apps/map/position_file.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {

/// East and north in metres, with or without a height, as PROJ knows them. Not thread safe.
class Projection {
 public:
  /// `name`: "EPSG:25832", "EPSG:32632+5773", a system's full name, WKT or a text of PROJ. Throws
  /// std::runtime_error with the remedy for what PROJ does not know or is no such system.
  explicit Projection(const std::string& name);
  ~Projection();
  Projection(const Projection&) = delete;
  Projection& operator=(const Projection&) = delete;

  [[nodiscard]] const merge::CoordinateSystem& system() const { return system_; }

  /// East, north and height of a place on WGS84, metres; a system without heights keeps the
  /// ellipsoid's. Throws std::runtime_error where PROJ has no way there, as without a grid of the
  /// geoid.
  [[nodiscard]] Eigen::Vector3d project(const Datum& place) const;

  /// A sentence if a position lies where the system is not used, or where its metre is another one
  /// on the ground; the coordinates may be of another system.
  [[nodiscard]] std::string doubt(const Eigen::Vector3d& position) const;

 private:
  [[nodiscard]] std::string doubt_of_scale(const Eigen::Vector3d& position, double latitude_deg,
                                           double longitude_deg) const;

  struct Objects;
  std::unique_ptr<Objects> proj_;
  merge::CoordinateSystem system_;
};

}  // namespace unimapper::apps
