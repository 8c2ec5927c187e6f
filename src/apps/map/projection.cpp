#include "src/apps/map/projection.hpp"

#include <fmt/format.h>
#include <proj.h>

#include <cmath>
#include <stdexcept>
#include <string_view>

namespace unimapper::apps {

struct ProjCloser {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
  void operator()(PJ* object) const { proj_destroy(object); }
};
using ProjObject = std::unique_ptr<PJ, ProjCloser>;

namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295769;
constexpr const char* kRemedy =
    "; give a projected system in metres, as EPSG:25832 (UTM zone 32, heights of the ellipsoid) or "
    "EPSG:32632+5773 (with heights of the geoid EGM96)";

[[noreturn]] void refuse_system(const std::string& name, const std::string& why) {
  throw std::runtime_error("coordinate system " + name + ": " + why);
}

/// PROJ takes a word for any system whose name resembles it; only a whole name is meant.
bool is_meant(const std::string& name, PJ* crs) {
  return name.find_first_of(":[+{") != std::string::npos || name == proj_get_name(crs);
}

ProjObject find_system(PJ_CONTEXT* context, const std::string& name) {
  if (proj_context_get_database_path(context) == nullptr) {
    throw std::runtime_error(
        "coordinate systems need PROJ's database: install proj-data, or name the folder of proj.db "
        "in PROJ_DATA");
  }
  const bool is_text = name.starts_with("+") && name.find("+type=crs") == std::string::npos;
  ProjObject crs(proj_create(context, (is_text ? name + " +type=crs" : name).c_str()));
  if (crs == nullptr || proj_is_crs(crs.get()) == 0 || !is_meant(name, crs.get())) {
    refuse_system(name, std::string("PROJ does not know it") + kRemedy);
  }
  return crs;
}

ProjObject part_of(PJ_CONTEXT* context, PJ* crs, int part) {
  return ProjObject(proj_crs_get_sub_crs(context, crs, part));
}

/// Axes of a site frame: east, north, up, metres.
void require_axes(PJ_CONTEXT* context, PJ* crs, const std::string& name) {
  const ProjObject axes(proj_crs_get_coordinate_system(context, crs));
  const int count = axes == nullptr ? 0 : proj_cs_get_axis_count(context, axes.get());
  for (int i = 0; i < count; ++i) {
    const char* direction = "";
    const char* unit = "";
    double metres = 0.0;
    proj_cs_get_axis_info(context, axes.get(), i, nullptr, nullptr, &direction, &metres, &unit,
                          nullptr, nullptr);
    const std::string_view to(direction);
    if (to != "east" && to != "north" && to != "up") {
      refuse_system(
          name, "an axis of it points " + std::string(to) + ", not east, north or up" + kRemedy);
    }
    if (metres != 1.0) refuse_system(name, "its unit is the " + std::string(unit) + kRemedy);
  }
  if (count < 1) refuse_system(name, std::string("has no axes") + kRemedy);
}

/// From longitude, latitude and height on WGS84; null where PROJ has no way but a guess.
ProjObject way_to(PJ_CONTEXT* context, PJ* crs) {
  constexpr const char* const kExact[] = {"ALLOW_BALLPARK=NO", nullptr};
  const ProjObject wgs84(proj_create(context, "EPSG:4979"));
  if (wgs84 == nullptr) return nullptr;
  const ProjObject way(proj_create_crs_to_crs_from_pj(context, wgs84.get(), crs, nullptr, kExact));
  return ProjObject(way == nullptr ? nullptr
                                   : proj_normalize_for_visualization(context, way.get()));
}

}  // namespace

struct Projection::Objects {
  std::unique_ptr<PJ_CONTEXT, ProjCloser> context{proj_context_create()};
  ProjObject horizontal;  ///< east and north
  ProjObject way;         ///< to the system; null: none is known
  ProjObject way_on_map;  ///< without heights; null: none is known
};

Projection::~Projection() = default;

Projection::Projection(const std::string& name) : proj_(std::make_unique<Objects>()) {
  PJ_CONTEXT* context = proj_->context.get();
  proj_log_level(context, PJ_LOG_NONE);
  // Nothing is loaded meanwhile: the grids that are installed count.
  proj_context_set_enable_network(context, 0);
  const ProjObject crs = find_system(context, name);
  ProjObject& horizontal = proj_->horizontal;
  horizontal = ProjObject(proj_clone(context, crs.get()));
  if (proj_get_type(crs.get()) == PJ_TYPE_COMPOUND_CRS) {
    horizontal = part_of(context, crs.get(), 0);
    ProjObject vertical = part_of(context, crs.get(), 1);
    if (proj_get_type(vertical.get()) == PJ_TYPE_BOUND_CRS) {
      vertical = ProjObject(proj_get_source_crs(context, vertical.get()));
    }
    require_axes(context, vertical.get(), name);
  }
  if (proj_get_type(horizontal.get()) == PJ_TYPE_BOUND_CRS) {
    horizontal = ProjObject(proj_get_source_crs(context, horizontal.get()));
  }
  if (proj_get_type(horizontal.get()) != PJ_TYPE_PROJECTED_CRS) {
    refuse_system(
        name, std::string("is no projected system, it has no east and north in metres") + kRemedy);
  }
  require_axes(context, horizontal.get(), name);
  // Without axes WKT means east, north: some systems name north first, LAS files never do.
  constexpr const char* const kForm[] = {"MULTILINE=NO", "OUTPUT_AXIS=NO", nullptr};
  const char* wkt = proj_as_wkt(context, crs.get(), PJ_WKT1_GDAL, kForm);
  if (wkt == nullptr)
    refuse_system(name, "PROJ cannot write it as WKT of OGC 01-009, which LAS needs");
  system_ = {name, wkt};
  proj_->way = way_to(context, crs.get());
  proj_->way_on_map = way_to(context, horizontal.get());
}

Eigen::Vector3d Projection::project(const Datum& place) const {
  if (proj_->way == nullptr) {
    refuse_system(
        system_.name,
        "PROJ has no transformation from WGS84 to it; the grid of its geoid may be missing "
        "(projsync loads it): without heights, as EPSG:25832, those of the ellipsoid are kept");
  }
  const PJ_COORD to =
      proj_trans(proj_->way.get(), PJ_FWD,
                 proj_coord(place.longitude_deg, place.latitude_deg, place.height_m, HUGE_VAL));
  const Eigen::Vector3d position(to.xyz.x, to.xyz.y, to.xyz.z);
  if (!(position.cwiseAbs().maxCoeff() <= 1e8)) {
    refuse_system(system_.name, "latitude " + std::to_string(place.latitude_deg) + ", longitude " +
                                    std::to_string(place.longitude_deg) + " is not in it");
  }
  return position;
}

/// Says where a metre of the system is another one on the ground, as of Web Mercator.
std::string Projection::doubt_of_scale(const Eigen::Vector3d& position, double latitude_deg,
                                       double longitude_deg) const {
  constexpr double kStepM = 100.0;
  constexpr double kMetresPerDegree = 111195.0;  // on a sphere: right to half a percent
  constexpr double kMostOff = 0.05;
  const PJ_COORD north = proj_trans(proj_->way_on_map.get(), PJ_INV,
                                    proj_coord(position.x(), position.y() + kStepM, 0.0, HUGE_VAL));
  const double east_deg =
      (north.lp.lam - longitude_deg) * std::cos(latitude_deg * kRadiansPerDegree);
  const double length_m = kMetresPerDegree * std::hypot(east_deg, north.lp.phi - latitude_deg);
  if (!(std::abs(length_m / kStepM - 1.0) > kMostOff)) return {};
  return fmt::format(
      "{}: a metre of it is {:.2f} m on the ground there: the map would be distorted", system_.name,
      length_m / kStepM);
}

std::string Projection::doubt(const Eigen::Vector3d& position) const {
  constexpr double kMarginDeg = 1.0;  // systems are used a little beyond their area
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;
  if (proj_->way_on_map == nullptr ||
      proj_get_area_of_use(proj_->context.get(), proj_->horizontal.get(), &west, &south, &east,
                           &north, nullptr) == 0) {
    return {};
  }
  const PJ_COORD at = proj_trans(proj_->way_on_map.get(), PJ_INV,
                                 proj_coord(position.x(), position.y(), 0.0, HUGE_VAL));
  const double width = east - west + (east < west ? 360.0 : 0.0);
  const double from_west = at.lp.lam - west;
  const double eastward = from_west - 360.0 * std::floor((from_west + kMarginDeg) / 360.0);
  const bool is_there = eastward <= width + kMarginDeg && at.lp.phi >= south - kMarginDeg &&
                        at.lp.phi <= north + kMarginDeg;
  if (is_there) return doubt_of_scale(position, at.lp.phi, at.lp.lam);
  return fmt::format(
      "{}: the position {:.1f} {:.1f} is at latitude {:.2f}, longitude {:.2f}, which is not where "
      "the system is used ({:.1f} to {:.1f}, {:.1f} to {:.1f}): are these coordinates of it?",
      system_.name, position.x(), position.y(), at.lp.phi, at.lp.lam, south, north, west, east);
}

}  // namespace unimapper::apps
