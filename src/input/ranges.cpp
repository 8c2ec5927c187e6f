// Ranges of a few scans: units of the points, and points that are none
#include "src/input/ranges.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "src/core/quantile.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

constexpr double kOrigin_m = 0.01;
constexpr float kFarthestCoordinate = 1e7F;  // of the largest projected map, metres
constexpr float kSmallestCoordinate = 1e-20F;

bool is_plausible(float coordinate) {
  const float size = std::fabs(coordinate);
  return size == 0.0F || (size >= kSmallestCoordinate && size <= kFarthestCoordinate);
}

double middle(std::vector<float>& values) {
  return values.empty() ? 0.0 : static_cast<double>(median(std::span(values)));
}

}  // namespace

RangeFigures range_figures(std::span<const datasets::Scan> scans) {
  constexpr std::size_t kPerScan = 8000;  // that say how far and where the points are
  constexpr std::size_t kLarge = 60'000;
  RangeFigures figures;
  std::vector<float> ranges;
  std::vector<float> axis[3];
  std::vector<Eigen::Vector3f> kept;
  std::uint64_t looked_at = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t at_origin = 0;
  std::uint64_t implausible = 0;
  for (const datasets::Scan& scan : scans) {
    // What is read with another record size repeats after up to twelve points, rings after 2^n.
    const std::size_t every = scan.points.size() < kLarge ? 1 : 13;
    // Odd: an even one may meet a part of the rings alone.
    const std::size_t stride = (1 + scan.points.size() / every / kPerScan) | 1U;
    std::size_t returned = 0;
    figures.points += scan.points.size();
    for (std::size_t i = 0; i < scan.points.size(); i += every) {
      const datasets::Scan::Point& point = scan.points[i];
      ++looked_at;
      const Eigen::Vector3f p(point.x, point.y, point.z);
      if (!is_plausible(p.x()) || !is_plausible(p.y()) || !is_plausible(p.z())) {
        if (!p.allFinite()) {
          ++not_finite;
          continue;
        }
        ++implausible;
      }
      const double squared_m2 = p.cast<double>().squaredNorm();
      if (squared_m2 < kOrigin_m * kOrigin_m) {
        ++at_origin;
        continue;
      }
      if (returned++ % stride != 0) continue;
      ranges.push_back(static_cast<float>(std::sqrt(squared_m2)));
      for (int a = 0; a < 3; ++a) axis[a].push_back(p[a]);
      kept.push_back(p);
    }
    figures.empty_scans += returned == 0 ? 1 : 0;
    ++figures.scans;
  }
  if (figures.points == 0) return figures;
  const auto all = static_cast<double>(looked_at);
  figures.not_finite = static_cast<double>(not_finite) / all;
  figures.at_origin = static_cast<double>(at_origin) / all;
  figures.implausible =
      static_cast<double>(implausible) / static_cast<double>(looked_at - not_finite + 1);
  if (ranges.empty()) return figures;
  figures.median_m = middle(ranges);
  figures.largest_m = static_cast<double>(quantile(std::span(ranges), 0.99));
  const Eigen::Vector3d center(middle(axis[0]), middle(axis[1]), middle(axis[2]));
  figures.center_m = center.norm();
  std::vector<float> distances;
  distances.reserve(kept.size());
  for (const Eigen::Vector3f& p : kept) {
    distances.push_back(static_cast<float>((p.cast<double>() - center).norm()));
  }
  figures.scatter_m = static_cast<double>(quantile(std::span(distances), 0.9));
  return figures;
}

Finding check_units(const RangeFigures& ranges) {
  constexpr double kFarthest_m = 1000.0;     // 99 % of the points; LiDARs reach 500 m
  constexpr double kUnusual_m = 500.0;       // the same
  constexpr double kNearest_m = 0.5;         // the same
  constexpr double kMillimetres_m = 1500.0;  // median of a room in millimetres
  Finding finding{"units", Severity::kFine, ranges.largest_m, "m", {}, {kUnusual_m, kFarthest_m}};
  if (ranges.points == 0 || ranges.median_m == 0.0) return finding;
  // A map's coordinates are another matter.
  if (ranges.center_m > 3.0 * ranges.scatter_m) return finding;
  if (ranges.largest_m > kFarthest_m) {
    finding.severity = Severity::kWrong;
    const bool millimetres = ranges.median_m > kMillimetres_m;
    finding.message = text(
        "half of the points are farther than %.0f m: they look like %s; convert them to metres "
        "(multiply by %s)",
        ranges.median_m, millimetres ? "millimetres" : "centimetres",
        millimetres ? "0.001" : "0.01");
  } else if (ranges.largest_m > kUnusual_m) {
    finding.severity = Severity::kSuspicious;
    finding.message = text(
        "one point in a hundred is farther than %.0f m, beyond the reach of a LiDAR: are the "
        "points in metres? Convert them if not",
        ranges.largest_m);
  } else if (ranges.largest_m < kNearest_m) {
    finding.severity = Severity::kWrong;
    finding.limits = {};
    finding.message = text(
        "99 %% of the points are nearer than %.3f m: they look like kilometres or are normalised; "
        "convert them to metres",
        ranges.largest_m);
  }
  return finding;
}

Finding check_origin(const RangeFigures& ranges) {
  constexpr double kFar_m = 1000.0;
  Finding finding{"origin", Severity::kFine, ranges.center_m, "m", {}, {kNoLimit, kFar_m}};
  if (ranges.center_m > 3.0 * ranges.scatter_m && ranges.center_m > kFar_m) {
    finding.severity = Severity::kWrong;
    finding.message = text(
        "the points lie about %.0f m from the origin and within %.0f m of each other: they are in "
        "a map's frame, not in the sensor's; transform each scan by the inverse of its pose",
        ranges.center_m, ranges.scatter_m);
  }
  return finding;
}

Finding check_points(const RangeFigures& ranges) {
  const double empty = ranges.scans == 0 ? 0.0
                                         : static_cast<double>(ranges.empty_scans) /
                                               static_cast<double>(ranges.scans);
  constexpr double kManyEmpty = 0.2;
  Finding finding{"points",
                  Severity::kFine,
                  100.0 * empty,
                  "% empty scans",
                  {},
                  {100.0 * kManyEmpty, kNoLimit}};
  constexpr double kNearlyAll = 0.98;
  if (ranges.scans > 0 && ranges.empty_scans == ranges.scans) {
    finding.severity = Severity::kWrong;
    finding.message =
        "none of the scans looked at holds a point away from the origin: check that the scans hold "
        "x, y, z as float32 in metres, and choose the reader with --format";
  } else if (empty > kManyEmpty) {
    finding.severity = Severity::kSuspicious;
    finding.message = text(
        "%zu of the %zu scans looked at hold no points: leave empty scans (and their poses) out",
        ranges.empty_scans, ranges.scans);
  } else if (ranges.not_finite + ranges.at_origin > kNearlyAll) {
    finding.severity = Severity::kSuspicious;
    finding.figure = 100.0 * (ranges.not_finite + ranges.at_origin);
    finding.unit = "% invalid points";
    finding.message = text("%.1f %% of the points are NaN or zero: check the layout of the records",
                           finding.figure);
  }
  return finding;
}

namespace {

/// Mean distance from one record to the next over that to records elsewhere, for records of
/// `floats` floats: near 0 where the points of a scan follow each other, 1 where they do not.
double roughness(std::span<const float> values, std::size_t floats) {
  const std::size_t records = values.size() / floats;
  constexpr std::size_t kLooks = 1000;
  if (records < 64) return 1.0;
  const std::size_t stride = std::max<std::size_t>(1, records / kLooks);
  const auto at = [&](std::size_t record) {
    return Eigen::Vector3f(values[record * floats], values[record * floats + 1],
                           values[record * floats + 2]);
  };
  std::vector<float> near;
  std::vector<float> far;
  for (std::size_t i = 0; i + 1 < records; i += stride) {
    const Eigen::Vector3f here = at(i);
    const Eigen::Vector3f next = at(i + 1);
    const Eigen::Vector3f elsewhere = at((i + records / 3 + 7 * (i % 13)) % records);
    if (!here.allFinite() || !next.allFinite() || !elsewhere.allFinite()) continue;
    near.push_back((next - here).norm());
    far.push_back((elsewhere - here).norm());
  }
  if (near.size() < 64) return 1.0;
  const double usual = middle(far);
  return usual > 0.0 ? middle(near) / usual : 1.0;
}

}  // namespace

namespace {

/// 8 or 12 where of every two or three points read one is none: one of its coordinates is always
/// zero, those of the others never are. Else 0.
std::size_t padded_floats(const datasets::Scan& scan) {
  constexpr std::size_t kRun = 6;  // a multiple of both
  constexpr std::size_t kRuns = 1000;
  const std::size_t stride = kRun * (1 + scan.points.size() / (kRun * kRuns));
  for (const std::size_t period : {2U, 3U}) {
    std::vector<std::size_t> zeros(period);
    std::vector<std::size_t> points(period);
    for (std::size_t run = 0; run + kRun <= scan.points.size(); run += stride) {
      for (std::size_t i = run; i < run + kRun; ++i) {
        const datasets::Scan::Point& p = scan.points[i];
        ++points[i % period];
        zeros[i % period] += p.x == 0.0F || p.y == 0.0F || p.z == 0.0F ? 1 : 0;
      }
    }
    const bool first_holds = 100 * zeros[0] < points[0];
    const bool last_is_none = 2 * zeros[period - 1] > points[period - 1];
    if (first_holds && last_is_none) return 4 * period;
  }
  return 0;
}

}  // namespace

Finding check_records(std::span<const datasets::Scan> scans, const RangeFigures& ranges) {
  constexpr double kGarbage = 0.02;
  Finding finding{"records",
                  Severity::kFine,
                  100.0 * ranges.implausible,
                  "% implausible",
                  {},
                  {kNoLimit, 100.0 * kGarbage}};
  if (ranges.implausible > kGarbage) {
    finding.severity = Severity::kWrong;
    finding.message = text(
        "%.0f %% of the points have coordinates that no LiDAR measures: the records are of another "
        "size or type than x, y, z, intensity as float32; convert them, or choose the reader with "
        "--format",
        finding.figure);
    return finding;
  }
  // Which record size makes a scan's points follow each other.
  constexpr std::size_t kAsRead = sizeof(datasets::Scan::Point) / sizeof(float);
  std::size_t best_floats = kAsRead;
  std::size_t agreed = 0;
  std::size_t looked_at = 0;
  double as_read_sum = 0.0;
  for (const datasets::Scan& scan : scans) {
    if (scan.points.size() < 256) continue;
    const std::span<const float> values(&scan.points.front().x, kAsRead * scan.points.size());
    const double as_read = roughness(values, kAsRead);
    double best = as_read;
    std::size_t floats = kAsRead;
    for (const std::size_t other : {3U, 5U, 6U, 7U, 9U, 10U, 11U}) {
      const double value = roughness(values, other);
      // A multiple of the right size is as smooth.
      constexpr double kBetter = 0.7;
      if (value >= kBetter * best) continue;
      best = value;
      floats = other;
    }
    ++looked_at;
    as_read_sum += as_read;
    if (const std::size_t padded = padded_floats(scan); padded > 0) {
      ++agreed;
      best_floats = padded;
      continue;
    }
    constexpr double kClearly = 0.35;
    if (floats != kAsRead && best < kClearly * as_read && as_read > 0.3) {
      ++agreed;
      best_floats = floats;
    }
  }
  if (looked_at > 0) {
    finding.figure = as_read_sum / static_cast<double>(looked_at);
    finding.unit = "roughness";
    finding.limits = {};
  }
  if (looked_at > 0 && 2 * agreed > looked_at) {
    finding.severity = Severity::kWrong;
    finding.message = text(
        "the records look %zu floats long (%zu bytes%s), but were read as four (x, y, z, "
        "intensity): convert them to four floats, or choose the reader with --format",
        best_floats, 4 * best_floats, best_floats == 5 ? ", as those of nuScenes" : "");
  }
  return finding;
}

bool RepeatedScans::add(std::uint64_t fingerprint, const Pose& pose) {
  constexpr double kMoved_m = 0.1;
  constexpr double kTurned_deg = 1.0;
  const bool is_alike = fingerprint != 0 && fingerprint == fingerprint_;
  fingerprint_ = fingerprint;
  if (!is_alike) {
    first_ = pose;
    return false;
  }
  const Pose moved = first_.inverse() * pose;
  return moved.translation.norm() > kMoved_m ||
         rotation_angle(moved.rotation) * kDegreesPerRadian > kTurned_deg;
}

Finding check_repeated(std::span<const datasets::Scan* const> first,
                       std::span<const datasets::Scan* const> second) {
  const auto same = [](const datasets::Scan& a, const datasets::Scan& b) {
    // Points of both may have been compensated for the motion since.
    if (a.fingerprint != 0 && b.fingerprint != 0) return a.fingerprint == b.fingerprint;
    return !a.points.empty() && std::equal(a.points.begin(), a.points.end(), b.points.begin(),
                                           b.points.end(), [](const auto& p, const auto& q) {
                                             return p.x == q.x && p.y == q.y && p.z == q.z;
                                           });
  };
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < first.size(); ++i) repeated += same(*first[i], *second[i]) ? 1 : 0;
  const double share =
      first.empty() ? 0.0 : static_cast<double>(repeated) / static_cast<double>(first.size());
  Finding finding{"repeated scans", Severity::kFine, 100.0 * share, "%", {}, {0.0, kNoLimit}};
  if (repeated > 0) {
    finding.severity = Severity::kSuspicious;
    finding.message = text(
        "%zu of %zu scans looked at repeat the scan before, point by point: leave repeated scans "
        "and their poses out",
        repeated, first.size());
  }
  return finding;
}

}  // namespace unimapper::input
