// Axes of the points: which of them the sensor turns about, or looks along
#include "src/input/axes.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/input/text.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kSectors = 12;
constexpr const char* kRemedy =
    "give --extrinsic 0,0,0,180,0,0 if the poses are of an upright body, or --extrinsic auto if "
    "they are of the LiDAR itself; or negate z if an export mirrored the points";

/// The narrowest band of azimuths that holds 98 % of `azimuths_deg`, which it sorts.
void find_band(std::vector<float>& azimuths_deg, DirectionFigures& figures) {
  std::sort(azimuths_deg.begin(), azimuths_deg.end());
  const std::size_t size = azimuths_deg.size();
  const std::size_t within = std::max<std::size_t>(1, size * 98 / 100);
  double narrowest = 360.0;
  for (std::size_t i = 0; i < size; i += std::max<std::size_t>(1, size / 2000)) {
    const std::size_t last = i + within - 1;
    const double end =
        static_cast<double>(azimuths_deg[last % size]) + (last >= size ? 360.0 : 0.0);
    const double width = end - static_cast<double>(azimuths_deg[i]);
    if (width >= narrowest) continue;
    narrowest = width;
    figures.middle_deg = std::remainder(static_cast<double>(azimuths_deg[i]) + 0.5 * width, 360.0);
  }
  figures.width_deg = narrowest;
}

/// A metre of the path, and what lies on both sides of it.
struct Metre {
  Eigen::Vector3d centre;
  bool shows_both;  ///< the ground below would be in sight
  std::vector<double> below_m;
  std::vector<double> above_m;

  /// Adds a point, seen from the path.
  void add(const Eigen::Vector3d& point) {
    constexpr double kAside_m2 = 0.25;
    constexpr double kOn_m = 0.08;  // of a sensor to what it is driven on
    constexpr double kFarthest_m = 8.0;
    const double height_m = std::fabs(point.z());
    if (!(point.head<2>().squaredNorm() < kAside_m2)) return;
    if (height_m < kOn_m || height_m > kFarthest_m) return;
    (point.z() < 0.0 ? below_m : above_m).push_back(height_m);
  }
};

/// Collects what lies on one side of the path.
class SurfaceHeights {
 public:
  void add(std::vector<double>& points_m, bool shows_both) {
    constexpr std::size_t kFewest = 3;  // points
    // Leaves and people are not level.
    constexpr double kFlat_m = 0.3;
    if (points_m.size() < kFewest) return;
    const double thick_m = quantile(std::span(points_m), 0.9) - quantile(std::span(points_m), 0.1);
    metres_.push_back({median(std::span(points_m)), quantile(std::span(points_m), 0.9),
                       thick_m < kFlat_m, shows_both});
  }

  [[nodiscard]] SurfaceSide side() && {
    constexpr double kLevel_m = 0.3;
    SurfaceSide side;
    side.seen = metres_.size();
    if (metres_.empty()) return side;
    std::vector<double> values;
    for (const auto& metre : metres_) values.push_back(metre.farthest_m);
    side.farthest_m = quantile(std::span(values), 0.9);
    for (std::size_t k = 0; k < metres_.size(); ++k) values[k] = metres_[k].height_m;
    side.height_m = median(std::span(values));
    for (std::size_t k = 0; k < metres_.size(); ++k) {
      const bool is_near = std::fabs(metres_[k].height_m - side.height_m) < kLevel_m;
      const bool is_level = metres_[k].is_flat && is_near;
      side.level += is_level ? 1 : 0;
      side.level_in_sight += is_level && metres_[k].shows_both ? 1 : 0;
      side.in_sight += is_near && metres_[k].shows_both ? 1 : 0;
      side.flat += metres_[k].is_flat ? 1 : 0;
      side.in_way += 2.0 * metres_[k].height_m < side.farthest_m ? 1 : 0;
      values[k] = std::fabs(metres_[k].height_m - side.height_m);
    }
    side.scatter_m = quantile(std::span(values), 0.7);
    return side;
  }

 private:
  struct Height {
    double height_m;
    double farthest_m;
    bool is_flat;
    bool shows_both;
  };
  std::vector<Height> metres_;
};

}  // namespace

DirectionFigures measure_directions(std::span<const datasets::Scan> scans) {
  DirectionFigures figures;
  constexpr std::size_t kPerScan = 3000;
  constexpr float kNearest_m = 1.0F;  // nearer is the robot itself
  std::array<std::array<std::size_t, kSectors>, 3> counts{};
  std::array<std::vector<float>, 3> elevations;
  std::vector<float> azimuths;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const datasets::Scan& scan : scans) {
    const std::size_t stride = 1 + scan.points.size() / kPerScan;
    for (std::size_t i = 0; i < scan.points.size(); i += stride) {
      const Eigen::Vector3f p(scan.points[i].x, scan.points[i].y, scan.points[i].z);
      if (!p.allFinite() || p.squaredNorm() < kNearest_m * kNearest_m) continue;
      const Eigen::Vector3d d = p.cast<double>().normalized();
      sum += d;
      ++figures.points;
      for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<Eigen::Index>(a);
        const double azimuth_deg =
            kDegreesPerRadian * std::atan2(d[(axis + 2) % 3], d[(axis + 1) % 3]);
        const auto sector = static_cast<std::size_t>((azimuth_deg + 180.0) / 30.0);
        ++counts[a][std::min(sector, kSectors - 1)];
        elevations[a].push_back(
            static_cast<float>(kDegreesPerRadian * std::asin(std::clamp(d[axis], -1.0, 1.0))));
        if (a == 2) azimuths.push_back(static_cast<float>(azimuth_deg));
      }
    }
  }
  if (figures.points == 0) return figures;
  sum /= static_cast<double>(figures.points);
  for (std::size_t a = 0; a < 3; ++a) {
    figures.mean[a] = sum[static_cast<Eigen::Index>(a)];
    // A fifth of an even share.
    for (const std::size_t count : counts[a]) {
      figures.sectors[a] += 5 * kSectors * count >= figures.points ? 1 : 0;
    }
    figures.lowest_deg[a] = static_cast<double>(quantile(std::span(elevations[a]), 0.01));
    figures.highest_deg[a] = static_cast<double>(quantile(std::span(elevations[a]), 0.99));
  }
  find_band(azimuths, figures);
  return figures;
}

DrivenSurface measure_driven_surface(const Track& track, double lowest_deg,
                                     std::span<const std::size_t> indices,
                                     std::span<const datasets::Scan* const> scans) {
  constexpr std::size_t kAfter = 100;  // scans; what is behind may be a trailer
  constexpr double kSight_m = 25.0;
  constexpr std::size_t kPerScan = 20'000;
  constexpr double kInSight_m = 1.0;
  const double fall = std::tan(std::clamp(-lowest_deg, 0.0, 80.0) / kDegreesPerRadian);
  SurfaceHeights below;
  SurfaceHeights above;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const std::size_t i = indices[k];
    const Eigen::Matrix3d R_world_sensor = track.pose(i).rotation;
    const Eigen::Vector3d sensor = track.pose(i).translation;
    std::vector<Metre> path;
    for (std::size_t j = i; j < std::min(track.size, i + kAfter); ++j) {
      const Eigen::Vector3d p = track.pose(j).translation - sensor;
      if (!p.allFinite() || p.norm() > kSight_m) continue;
      if (!path.empty() && (p - path.back().centre).norm() < 1.0) continue;
      path.push_back({p, p.norm() * fall >= kInSight_m, {}, {}});
    }
    const std::size_t stride = 1 + scans[k]->points.size() / kPerScan;
    for (std::size_t n = 0; n < scans[k]->points.size(); n += stride) {
      const auto& point = scans[k]->points[n];
      const Eigen::Vector3d p = R_world_sensor * Eigen::Vector3d(point.x, point.y, point.z);
      for (Metre& metre : path) metre.add(p - metre.centre);
    }
    for (Metre& metre : path) {
      below.add(metre.below_m, metre.shows_both);
      above.add(metre.above_m, metre.shows_both);
    }
  }
  return {std::move(below).side(), std::move(above).side()};
}

bool are_upside_down(const Track& track, std::span<const std::size_t> indices) {
  const auto turned =
      static_cast<std::size_t>(std::count_if(indices.begin(), indices.end(), [&](std::size_t i) {
        return track.pose(i).rotation(2, 2) < 0.0;
      }));
  return 2 * turned > indices.size();
}

namespace {

constexpr std::size_t kFewestMetres = 20;  // metres
constexpr std::size_t kTimesMore = 4;
constexpr double kTallestMount_m = 3.0;  // of trucks

/// Whether things stand on `side` where the robot will drive, so that they move: people and cars do
/// on a ground, lamps and beams do not from a ceiling. People alone, without a ground, are few.
bool is_stood_on(const SurfaceSide& side, const SurfaceSide& other) {
  constexpr std::size_t kOneIn = 20;
  return side.seen >= kFewestMetres && 2 * side.seen >= other.seen &&
         side.farthest_m < kTallestMount_m && kOneIn * side.in_way >= side.seen &&
         side.in_way > kTimesMore * other.in_way;
}

}  // namespace

Side find_up(const DrivenSurface& driven, SheetSide sheet) {
  constexpr double kHighest_m = 2.5;  // a mount; most ceilings are higher
  const SurfaceSide& below = driven.below;
  const SurfaceSide& above = driven.above;
  const bool is_mirrored = sheet == SheetSide::kMirrored;
  // Where ground below would be out of sight, plants and ceilings alone are seen.
  const std::size_t told = is_mirrored ? above.level : above.level_in_sight;
  const std::size_t against = is_mirrored ? below.level : below.level_in_sight;
  if (told >= kFewestMetres && told > kTimesMore * against && above.height_m < kHighest_m) {
    if (is_mirrored) return Side::kBelow;
    if (is_stood_on(below, above)) return Side::kAbove;
    // A low ceiling may show itself better than a ground with people on it.
    return told > kTimesMore * below.in_sight ? Side::kBelow : Side::kUnknown;
  }
  if (is_mirrored) {
    const bool is_driven_on = below.level >= kFewestMetres && below.height_m < kTallestMount_m;
    return is_driven_on ? Side::kAbove : Side::kUnknown;
  }
  // Under a ceiling: what is driven on is near to the path, and equally far from it.
  constexpr double kNoise_m = 0.02;
  constexpr double kLikelier = 0.85;
  const bool is_surface = above.level >= kFewestMetres && 2 * above.flat > above.seen;
  const bool are_both =
      is_surface && 2 * above.seen >= below.seen && kTimesMore * below.seen >= above.seen;
  if (!are_both || sheet == SheetSide::kUpright) return Side::kAbove;
  if (is_stood_on(below, above)) return Side::kAbove;
  if (is_stood_on(above, below)) return Side::kUnknown;
  const double below_m2 = below.height_m * (below.scatter_m + kNoise_m);
  const double above_m2 = above.height_m * (above.scatter_m + kNoise_m);
  return above_m2 < kLikelier * below_m2 ? Side::kUnknown : Side::kAbove;
}

Finding check_axes(const DirectionFigures& directions, const DrivenSurface& driven, SheetSide sheet,
                   bool turned_by_poses) {
  Finding finding{"axes", Severity::kFine, 0.0, "axis", {}};
  constexpr std::size_t kFewest = 1000;
  constexpr int kAllRound = 11;
  constexpr double kWidest_deg = 110.0;  // of a sensor that turns
  if (directions.points < kFewest) return finding;
  const auto height = [&](std::size_t a) {
    return directions.highest_deg[a] - directions.lowest_deg[a];
  };
  const auto turns_about = [&](std::size_t a) {
    const double middle = 0.5 * (directions.highest_deg[a] + directions.lowest_deg[a]);
    return directions.sectors[a] >= kAllRound && height(a) < kWidest_deg &&
           std::fabs(middle) < 45.0;
  };
  std::size_t axis = 2;
  for (const std::size_t a : {0U, 1U}) {
    if (turns_about(a) && height(a) < 0.7 * height(axis)) axis = a;
  }
  if (axis != 2) {
    finding.severity = Severity::kWrong;
    finding.figure = static_cast<double>(axis);
    finding.message = text(
        "the sensor turns about the points' %c axis, which z must be: transform points and poses "
        "to axes with x forward, y left and z up",
        "xyz"[axis]);
    return finding;
  }
  finding.figure = 2.0;
  constexpr double kAlong = 0.8;
  const bool sees_part = directions.sectors[2] < kAllRound;
  if (sees_part && std::fabs(directions.mean[2]) > kAlong) {
    finding.severity = Severity::kSuspicious;
    finding.message =
        "the sensor looks along the points' z axis, as a camera does: transform points and poses "
        "to axes with x forward, y left and z up";
    return finding;
  }
  const Side up = find_up(driven, sheet);
  if (up == Side::kUnknown) {
    finding.severity = Severity::kSuspicious;
    finding.message =
        sheet == SheetSide::kMirrored
            ? text(
                  "which side is up is not known: known LiDARs look as far down as the points lie "
                  "up, and up as they lie down; if z points down, %s",
                  kRemedy)
            : text(
                  "which side is up is not known: a surface %.1f m above the sensor's path is more "
                  "like what is driven on than one %.1f m below it; if z points down, %s",
                  driven.above.height_m, driven.below.height_m, kRemedy);
  }
  if (up == Side::kBelow) {
    finding.severity = Severity::kWrong;
    finding.message =
        turned_by_poses
            ? text(
                  "by the poses the LiDAR is upside down, and by the points it is not (what is "
                  "driven on would lie above it in %zu of %zu metres of path): are the "
                  "quaternions qw qx qy qz (write qx qy qz qw), or is z down in the poses (NED)?",
                  driven.above.level, driven.above.level + driven.below.level)
            : text(
                  "what is driven on lies above the sensor in %zu of %zu metres of path: z points "
                  "down, the "
                  "LiDAR is mounted upside down; %s",
                  driven.above.level, driven.above.level + driven.below.level, kRemedy);
  }
  return finding;
}

}  // namespace unimapper::input
