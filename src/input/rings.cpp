// Rings of points at one elevation, which form only in the sensor's frame
#include "src/input/rings.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "src/core/quantile.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kElevations = 450 * kNeighbours;  // of 0.05 degrees: less than between rings

/// Number of points by elevation, seen from the origin of `T`; of a part of them.
std::vector<double> count_elevations(const datasets::Scan& scan, const Pose& T) {
  constexpr std::size_t kMost = 20000;
  std::vector<double> bins(kElevations);
  const std::size_t stride = 1 + scan.points.size() / kMost;
  for (std::size_t i = 0; i < scan.points.size(); i += stride) {
    const Eigen::Vector3d p =
        T * Eigen::Vector3d(scan.points[i].x, scan.points[i].y, scan.points[i].z);
    if (!p.allFinite() || p.norm() < 1.0) continue;
    const double share = 0.5 + std::asin(std::clamp(p.z() / p.norm(), -1.0, 1.0)) / M_PI;
    bins[std::min(kElevations - 1, static_cast<std::size_t>(share * kElevations))] += 1.0;
  }
  return bins;
}

/// How much the elevations of points concentrate in rings: 1 where they are spread evenly over
/// neighbouring bins. Where scans are seen from does not matter: a tunnel seen from outside fills a
/// small angle, but evenly.
double concentration(const datasets::Scan& scan, const Pose& T) {
  const std::vector<double> bins = count_elevations(scan, T);
  double squares = 0.0;
  double squares_of_means = 0.0;
  for (std::size_t first = 0; first < kElevations; first += kNeighbours) {
    double sum = 0.0;
    for (std::size_t i = first; i < first + kNeighbours; ++i) {
      squares += bins[i] * bins[i];
      sum += bins[i];
    }
    squares_of_means += sum * sum / kNeighbours;
  }
  return squares_of_means > 0.0 ? squares / squares_of_means : 0.0;
}

/// How much they concentrate at all: 1 where they are spread evenly over all elevations. Compares
/// scans from one place, which rings fill alike.
double peakedness(const datasets::Scan& scan) {
  double squares = 0.0;
  double sum = 0.0;
  for (const double count : count_elevations(scan, Pose())) {
    squares += count * count;
    sum += count;
  }
  return sum > 0.0 ? kElevations * squares / (sum * sum) : 0.0;
}

}  // namespace

double measure_ring_gain(std::span<const datasets::Scan* const> scans,
                         std::span<const Pose> poses) {
  constexpr double kFewest_m = 1.0;
  double gain = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (poses[i].translation.norm() < kFewest_m) continue;
    const double as_given = concentration(*scans[i], Pose());
    if (as_given <= 0.0) continue;
    gain += concentration(*scans[i], poses[i].inverse()) / as_given;
    count += 1.0;
  }
  return count > 0.0 ? gain / count : 0.0;
}

double measure_ring_loss(std::span<const datasets::Scan* const> scans) {
  if (scans.size() < 2) return 0.0;
  std::vector<double> later;
  for (const datasets::Scan* scan : scans.subspan(1)) later.push_back(peakedness(*scan));
  const double usual = median(std::span(later));
  return usual > 0.0 ? peakedness(*scans.front()) / usual : 0.0;
}

}  // namespace unimapper::input
