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
  constexpr std::size_t kBefore = 20;  // scans
  constexpr std::size_t kAfter = 100;
  constexpr double kSight_m = 25.0;
  constexpr std::size_t kPerScan = 20'000;
  constexpr std::size_t kFewest = 3;  // points
  constexpr double kLowest_m = 0.08;  // of a sensor over what it is driven on
  constexpr double kHighest_m = 5.0;
  constexpr double kNearAbove_m = 0.3;  // ceilings are higher
  constexpr double kFarAbove_m = 2.5;
  constexpr double kInSight_m = 1.5;
  const double fall = std::tan(std::clamp(-lowest_deg, 0.0, 80.0) / kDegreesPerRadian);
  DrivenSurface driven;
  struct Metre {
    Eigen::Vector3d centre;
    std::size_t below = 0;
    std::size_t above = 0;
    double above_sum_m = 0.0;
  };
  std::vector<double> heights_m;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const std::size_t i = indices[k];
    const Eigen::Matrix3d R_world_sensor = track.pose(i).rotation;
    const Eigen::Vector3d sensor = track.pose(i).translation;
    std::vector<Metre> path;
    for (std::size_t j = i - std::min(i, kBefore); j < std::min(track.size, i + kAfter); ++j) {
      const Eigen::Vector3d p = track.pose(j).translation - sensor;
      if (!p.allFinite() || p.norm() > kSight_m || p.norm() * fall < kInSight_m) continue;
      if (path.empty() || (p - path.back().centre).norm() >= 1.0) path.push_back({p});
    }
    const std::size_t stride = 1 + scans[k]->points.size() / kPerScan;
    for (std::size_t n = 0; n < scans[k]->points.size(); n += stride) {
      const auto& point = scans[k]->points[n];
      const Eigen::Vector3d p = R_world_sensor * Eigen::Vector3d(point.x, point.y, point.z);
      for (Metre& metre : path) {
        const Eigen::Vector3d off = p - metre.centre;
        if (!(off.head<2>().squaredNorm() < 0.25)) continue;
        metre.below += off.z() <= -kLowest_m && off.z() >= -kHighest_m ? 1 : 0;
        if (off.z() < kNearAbove_m || off.z() > kFarAbove_m) continue;
        ++metre.above;
        metre.above_sum_m += off.z();
      }
    }
    for (const Metre& metre : path) {
      driven.below += metre.below >= kFewest ? 1 : 0;
      if (metre.above < kFewest) continue;
      heights_m.push_back(metre.above_sum_m / static_cast<double>(metre.above));
    }
  }
  if (heights_m.empty()) return driven;
  // Leaves are not level; small robots drive below some.
  constexpr double kLevel_m = 0.3;
  const double height_m = median(std::span(heights_m));
  driven.above =
      static_cast<std::size_t>(std::count_if(heights_m.begin(), heights_m.end(), [&](double one) {
        return std::fabs(one - height_m) < kLevel_m;
      }));
  return driven;
}

bool are_upside_down(const Track& track, std::span<const std::size_t> indices) {
  const auto turned =
      static_cast<std::size_t>(std::count_if(indices.begin(), indices.end(), [&](std::size_t i) {
        return track.pose(i).rotation(2, 2) < 0.0;
      }));
  return 2 * turned > indices.size();
}

bool is_upside_down(const DrivenSurface& driven) {
  // Under a ceiling surfaces lie on both sides.
  constexpr std::size_t kFewest = 20;
  constexpr std::size_t kTimes = 4;
  return driven.above >= kFewest && driven.above > kTimes * driven.below;
}

Finding check_axes(const DirectionFigures& directions, const DrivenSurface& driven,
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
  if (is_upside_down(driven)) {
    finding.severity = Severity::kWrong;
    finding.message =
        turned_by_poses
            ? text(
                  "by the poses the LiDAR is upside down, and by the points it is not (what is "
                  "driven on would lie above it in %zu of %zu metres of path): are the "
                  "quaternions qw qx qy qz (write qx qy qz qw), or is z down in the poses (NED)?",
                  driven.above, driven.above + driven.below)
            : text(
                  "what is driven on lies above the sensor in %zu of %zu metres of path: z points "
                  "down, the "
                  "LiDAR is mounted upside down; give --extrinsic 0,0,0,180,0,0 if the poses are "
                  "of an "
                  "upright body, or --extrinsic auto if they are of the LiDAR itself; or negate z "
                  "if an "
                  "export mirrored the points",
                  driven.above, driven.above + driven.below);
  }
  return finding;
}

}  // namespace unimapper::input
