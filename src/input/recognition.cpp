// Sensor of a recording, recognised from its points
#include "src/input/recognition.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/input/scan_sampling.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

constexpr double kAllRound_deg = 300.0;

bool is_return(const datasets::Scan::Point& p) {
  return std::isfinite(p.x + p.y + p.z) && !(p.x == 0.0F && p.y == 0.0F && p.z == 0.0F);
}

/// The bits of a point's coordinates.
struct Place {
  std::array<std::uint32_t, 3> bits;
  explicit Place(const datasets::Scan::Point& p)
      : bits{std::bit_cast<std::uint32_t>(p.x), std::bit_cast<std::uint32_t>(p.y),
             std::bit_cast<std::uint32_t>(p.z)} {}
  [[nodiscard]] std::size_t hash() const {
    std::uint64_t hash = 0;
    for (const std::uint32_t part : bits) {
      hash = (hash ^ part) * 0x9E3779B97F4A7C15U;
      hash ^= hash >> 32U;
    }
    return hash;
  }
  /// In one of so many parts, about as many places in each; cheaper than a hash.
  [[nodiscard]] std::uint32_t part(std::uint32_t parts) const {
    return ((bits[0] + bits[1] + bits[2]) * 0x9E3779B9U >> 16U) % parts;
  }
  bool operator==(const Place&) const = default;
};

/// In a table at most half full the slot of the point at `place`: one more than its index among
/// `points`, or 0 where there is none yet.
std::uint32_t& slot_of(const Place& place, std::span<const datasets::Scan::Point> points,
                       std::vector<std::uint32_t>& slots) {
  std::size_t slot = place.hash() & (slots.size() - 1);
  while (slots[slot] != 0 && Place(points[slots[slot] - 1]) != place) {
    slot = (slot + 1) & (slots.size() - 1);
  }
  return slots[slot];
}

std::vector<std::uint32_t> slots_for(std::size_t points) {
  return std::vector<std::uint32_t>(std::bit_ceil(2 * points + 2));
}

/// Whether a place may hold more than one point; of large scans, some of the places are looked at.
bool has_copies(const datasets::Scan& scan) {
  constexpr std::size_t kLarge = 10'000;
  constexpr std::uint32_t kParts = 8;
  const std::uint32_t parts = scan.points.size() < kLarge ? 1 : kParts;
  std::vector<std::uint32_t> slots =
      slots_for(parts == 1 ? scan.points.size() : 2 * scan.points.size() / parts);
  std::size_t held = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Place place(scan.points[i]);
    if (place.part(parts) != 0 || !is_return(scan.points[i])) continue;
    std::uint32_t& slot = slot_of(place, scan.points, slots);
    if (slot != 0 || 2 * ++held >= slots.size()) return true;
    slot = static_cast<std::uint32_t>(i + 1);
  }
  return false;
}

/// The scan without times, each point once, in its order; `all` counts the points that return
/// something, copies too.
datasets::Scan without_copies(const datasets::Scan& scan, std::size_t& all) {
  datasets::Scan result;
  const bool copies = has_copies(scan);
  std::vector<std::uint32_t> slots = slots_for(copies ? scan.points.size() : 0);
  const bool has_rings = scan.ring.size() == scan.points.size();
  result.points.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const datasets::Scan::Point& point = scan.points[i];
    if (!is_return(point)) continue;
    ++all;
    if (copies) {
      std::uint32_t& slot = slot_of(Place(point), result.points, slots);
      if (slot != 0) continue;
      slot = static_cast<std::uint32_t>(result.points.size() + 1);
    }
    result.points.push_back(point);
    if (has_rings) result.ring.push_back(scan.ring[i]);
  }
  return result;
}

void take_sampling(const datasets::Scan& scan, SensorFigures& figures) {
  SensorModel any = sensor_model(SensorKind::kGeneric);
  any.range_max_m = 500.0F;
  const auto sampling = measure_sampling(scan, any);
  if (!sampling) return;
  figures.ray_spacing_deg = static_cast<double>(sampling->ray_spacing_deg);
  figures.ring_spacing_deg = static_cast<double>(sampling->ring_spacing_deg);
}

}  // namespace

SensorFigures measure_sensor(std::span<const datasets::Scan> scans,
                             const DirectionFigures& directions) {
  SensorFigures figures;
  figures.width_deg = directions.width_deg;
  std::vector<float> ranges;
  std::vector<float> elevations;
  std::vector<bool> rings(std::size_t{1} << 16U);
  const datasets::Scan* fullest = nullptr;
  std::size_t with_copies = 0;
  std::size_t each_once = 0;
  for (const datasets::Scan& recorded : scans) {
    figures.recorded_points = std::max(figures.recorded_points, recorded.points.size());
    datasets::Scan once;
    const bool copies = has_copies(recorded);
    if (copies) once = without_copies(recorded, with_copies);
    const datasets::Scan& scan = copies ? once : recorded;
    const bool has_rings = scan.ring.size() == scan.points.size();
    const std::size_t stride = 1 + scan.points.size() / 8000;
    std::size_t returns = 0;
    std::size_t finite = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (!is_return(scan.points[i])) continue;
      if (has_rings) rings[scan.ring[i]] = true;
      const std::size_t number = returns++;
      const Eigen::Vector3f p(scan.points[i].x, scan.points[i].y, scan.points[i].z);
      constexpr float kNearest_m = 0.1F;
      const float squared_m2 = p.squaredNorm();
      if (!std::isfinite(squared_m2) || squared_m2 < kNearest_m * kNearest_m) continue;
      ++finite;
      if (number % stride != 0) continue;
      ranges.push_back(std::sqrt(squared_m2));
      elevations.push_back(std::asin(std::clamp(p.z() / ranges.back(), -1.0F, 1.0F)) *
                           static_cast<float>(kDegreesPerRadian));
    }
    each_once += returns;
    with_copies += copies ? 0 : returns;
    if (finite > figures.points) {
      figures.points = finite;
      fullest = &recorded;
    }
  }
  if (figures.points == 0) return figures;
  figures.copies = static_cast<double>(with_copies) / static_cast<double>(each_once);
  figures.rings = static_cast<std::uint32_t>(std::count(rings.begin(), rings.end(), true));
  figures.farthest_m = static_cast<double>(quantile(std::span(ranges), 0.999));
  figures.lowest_deg = static_cast<double>(quantile(std::span(elevations), 0.005));
  figures.highest_deg = static_cast<double>(quantile(std::span(elevations), 0.995));
  take_sampling(without_copies(*fullest, with_copies), figures);
  return figures;
}

namespace {

/// 0 where `value` is `expected`, 1 where they differ by `factor`.
double off_by(double value, double expected, double factor) {
  return std::fabs(std::log(value / expected)) / std::log(factor);
}

/// Degrees beyond `slack_deg`, 1 at 6 degrees more.
double beyond(double excess_deg, double slack_deg) {
  return std::max(0.0, excess_deg - slack_deg) / 6.0;
}

double elevations_off(const SensorFigures& figures, const SensorModel& model) {
  const auto low = static_cast<double>(model.elevation_min_deg);
  const auto high = static_cast<double>(model.elevation_max_deg);
  // Rays outside the field of view are impossible but for a tilt; rays that are missing at the top
  // return nothing from the sky, at the bottom they are hidden by the robot.
  return beyond(low - figures.lowest_deg, 0.7) + beyond(figures.highest_deg - high, 0.7) +
         0.4 * beyond(figures.lowest_deg - low, 1.5) +
         0.25 * beyond(high - figures.highest_deg, 3.0);
}

}  // namespace

SensorMatch match_sensor(const SensorFigures& figures, const SensorSheet& sheet) {
  const SensorModel& model = sheet.model;
  SensorMatch match{&sheet, 0, 0.0};
  double& distance = match.distance;
  const bool spins = model.pattern == ScanPattern::kSpinning;
  if (spins) {
    constexpr double kRingFactor = 1.4;  // from which the pipeline replaces the sheet's, too
    const double rings_apart_deg =
        sheet.ring_spacing_deg > 0.0
            ? sheet.ring_spacing_deg
            : static_cast<double>(model.elevation_max_deg - model.elevation_min_deg) /
                  static_cast<double>(model.rings - 1);
    if (!figures.has_rings()) {
      distance += 1.5;
    } else {
      distance += off_by(figures.ring_spacing_deg, rings_apart_deg, kRingFactor);
      double nearest = 2.0;
      for (const std::uint32_t columns : sheet.columns) {
        const double off = off_by(figures.ray_spacing_deg, 360.0 / columns, 1.5);
        if (off >= nearest) continue;
        nearest = off;
        match.columns = columns;
      }
      distance += nearest;
    }
    if (figures.rings > 0) distance += figures.rings > model.rings ? 2.0 : 0.0;
    if (figures.rings > 0) distance += 3 * figures.rings < 2 * model.rings ? 1.0 : 0.0;
  } else if (figures.has_rings() && model.pattern == ScanPattern::kNonRepetitive &&
             figures.width_deg > kAllRound_deg) {
    distance += 0.5;
  }
  const auto width_deg = static_cast<double>(model.horizontal_fov_deg);
  if (width_deg < kAllRound_deg || figures.width_deg < kAllRound_deg) {
    const double missing = width_deg >= kAllRound_deg ? kAllRound_deg - figures.width_deg
                                                      : width_deg - figures.width_deg;
    distance += beyond(figures.width_deg - width_deg, 4.0) + 0.5 * beyond(missing, 8.0);
  }
  distance += elevations_off(figures, model);
  const double most_points =
      match.columns > 0 ? static_cast<double>(match.columns) * static_cast<double>(model.rings)
                        : static_cast<double>(model.points_per_scan);
  const double share = static_cast<double>(figures.points) / most_points;
  if (share > 1.1) distance += std::min(2.0, 2.0 * std::log2(share / 1.1 + 0.25));
  if (share < 0.25) distance += std::min(1.0, 0.5 * std::log2(0.25 / std::max(share, 1e-3)));
  distance += std::max(0.0, figures.farthest_m / static_cast<double>(model.range_max_m) - 1.03) * 3;
  return match;
}

namespace {

/// How much farther than the nearest sheet one must be not to be meant.
constexpr double kClearly = 0.2;

/// Sheets that no scan tells apart, and for which the presets are the same in all but name.
bool are_alike(const SensorModel& a, const SensorModel& b) {
  constexpr float kElevation_deg = 1.0F;
  return a.pattern == b.pattern && a.rings == b.rings &&
         a.horizontal_fov_deg == b.horizontal_fov_deg &&
         std::abs(a.elevation_min_deg - b.elevation_min_deg) <= kElevation_deg &&
         std::abs(a.elevation_max_deg - b.elevation_max_deg) <= kElevation_deg;
}

/// Of sheets like the nearest one the first in the list of sheets, so that noise does not choose.
void prefer_first_of_alike(std::vector<SensorMatch>& matches) {
  const auto nearest = matches.begin();
  auto first = nearest;
  for (auto match = nearest; match != matches.end(); ++match) {
    if (match->distance > nearest->distance + kClearly) break;
    if (!are_alike(match->sheet->model, nearest->sheet->model)) continue;
    if (match->sheet < first->sheet) first = match;
  }
  std::rotate(nearest, first, first + 1);
}

}  // namespace

std::vector<SensorMatch> match_sensors(const SensorFigures& figures) {
  std::vector<SensorMatch> matches;
  for (const SensorSheet& sheet : sensor_sheets()) {
    if (sheet.model.name == "generic") continue;
    matches.push_back(match_sensor(figures, sheet));
  }
  std::stable_sort(matches.begin(), matches.end(), [](const SensorMatch& a, const SensorMatch& b) {
    return a.distance < b.distance;
  });
  prefer_first_of_alike(matches);
  return matches;
}

bool is_recognised(const std::vector<SensorMatch>& matches) {
  constexpr double kNear = 0.8;
  if (matches.empty() || matches[0].distance >= kNear) return false;
  return std::none_of(matches.begin() + 1, matches.end(), [&](const SensorMatch& other) {
    return other.distance <= matches[0].distance + kClearly &&
           !are_alike(other.sheet->model, matches[0].sheet->model);
  });
}

SheetSide sheet_side(const SensorFigures& figures) {
  constexpr double kLike = 0.3;
  constexpr double kUnlike = 0.9;
  if (figures.points == 0 || figures.width_deg < kAllRound_deg) return SheetSide::kUnknown;
  SensorFigures mirrored = figures;
  mirrored.lowest_deg = -figures.highest_deg;
  mirrored.highest_deg = -figures.lowest_deg;
  double upright_off = 2.0 * kUnlike;
  double mirrored_off = 2.0 * kUnlike;
  bool is_upright = false;
  bool is_mirrored = false;
  for (const SensorSheet& sheet : sensor_sheets()) {
    if (sheet.model.name == "generic") continue;
    const double upright = elevations_off(figures, sheet.model);
    const double over = elevations_off(mirrored, sheet.model);
    upright_off = std::min(upright_off, upright);
    mirrored_off = std::min(mirrored_off, over);
    // A Mid-360 that sees no ceiling has the elevations of an HDL-64E upside down, but no rings.
    if ((sheet.model.pattern == ScanPattern::kSpinning) != figures.has_rings()) continue;
    is_upright = is_upright || upright < kLike;
    is_mirrored = is_mirrored || over < kLike;
  }
  if (is_mirrored && upright_off > kUnlike) return SheetSide::kMirrored;
  if (is_upright && mirrored_off > kUnlike) return SheetSide::kUpright;
  return SheetSide::kUnknown;
}

SensorModel generic_for(const SensorFigures& figures) {
  SensorModel model = sensor_model(SensorKind::kGeneric);
  if (figures.points == 0) return model;
  const auto low = static_cast<float>(std::max(figures.lowest_deg - 2.0, -90.0));
  const auto high = static_cast<float>(std::min(figures.highest_deg + 2.0, 90.0));
  model.elevation_min_deg = std::min(model.elevation_min_deg, low);
  model.elevation_max_deg = std::max(model.elevation_max_deg, high);
  model.range_max_m =
      std::clamp(static_cast<float>(1.1 * figures.farthest_m), model.range_max_m, 500.0F);
  // The preset adds a quarter.
  constexpr std::size_t kMost = 3300000;
  model.points_per_scan =
      std::max(model.points_per_scan, static_cast<std::uint32_t>(std::min(figures.points, kMost)));
  return model;
}

Finding check_sensor(const SensorFigures& figures, const SensorSheet& named) {
  const double distance = match_sensor(figures, named).distance;
  constexpr double kContradicts = 2.5;
  Finding finding{"sensor", Severity::kFine, distance, "", {}, {kContradicts, kNoLimit}};
  if (figures.points == 0 || named.model.name == "generic" || distance < kContradicts) {
    return finding;
  }
  const std::vector<SensorMatch> matches = match_sensors(figures);
  if (!is_recognised(matches) || matches[0].sheet->model.name == named.model.name) return finding;
  finding.severity = Severity::kSuspicious;
  const std::string_view looks = matches[0].sheet->model.name;
  const std::string_view name = named.model.name;
  finding.message = text(
      "the points do not look like those of a %.*s but of a %.*s (%.1f to %.1f degrees, rings %.2f "
      "degrees apart, %zu points): if so, pass --sensor %.*s",
      static_cast<int>(name.size()), name.data(), static_cast<int>(looks.size()), looks.data(),
      figures.lowest_deg, figures.highest_deg, figures.ring_spacing_deg, figures.points,
      static_cast<int>(looks.size()), looks.data());
  return finding;
}

}  // namespace unimapper::input
