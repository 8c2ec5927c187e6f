#include "lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

namespace unimapper::simulator {
namespace {

Vec3 spherical(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

/// A laser of a spinning sensor: elevation, azimuth offset, origin off the axis and off the centre.
struct Beam {
  double elevation, azimuth_offset, radius, height, delay;  ///< delay as a share of one column
};

/// Numbers of the lasers: from the bottom up where they fire in another order (VLP-16), else in
/// the order in which they fire, from the top down.
std::vector<std::uint16_t> ring_numbers(std::span<const Beam> beams) {
  const bool is_ordered =
      std::is_sorted(beams.begin(), beams.end(),
                     [](const Beam& a, const Beam& b) { return a.elevation > b.elevation; });
  std::vector<std::uint16_t> rings;
  for (const Beam& beam : beams) {
    const auto below = std::count_if(beams.begin(), beams.end(), [&](const Beam& other) {
      return other.elevation < beam.elevation;
    });
    rings.push_back(static_cast<std::uint16_t>(is_ordered ? rings.size() : below));
  }
  return rings;
}

/// Column 0 points backwards, and the head turns clockwise seen from above.
void make_spinning(std::span<const Beam> beams, std::uint32_t columns, std::uint32_t thin,
                   std::vector<PatternRay>& rays) {
  const auto beam_count = static_cast<std::uint32_t>(beams.size());
  const std::vector<std::uint16_t> rings = ring_numbers(beams);
  for (std::uint32_t column = 0; column < columns; column += thin) {
    for (std::uint32_t b = 0; b < beam_count; ++b) {
      const Beam& beam = beams[b];
      const double turn = (column + beam.delay) / columns;
      const double encoder = kPi - 2.0 * kPi * turn;
      const Vec3 axis = spherical(encoder, 0.0);
      rays.push_back({beam.radius * axis + Vec3{0, 0, beam.height},
                      spherical(encoder + beam.azimuth_offset, beam.elevation),
                      static_cast<float>(turn < 1.0 ? turn : 1.0), column * beam_count + b,
                      rings[b]});
    }
  }
}

std::vector<Beam> ouster_beams(int count, double top, double bottom,
                               const std::array<double, 4>& offsets_deg, double radius) {
  std::vector<Beam> beams;
  for (int i = 0; i < count; ++i) {
    const double elevation = top + (bottom - top) * i / (count - 1);
    beams.push_back({elevation * kDegree, offsets_deg[static_cast<std::size_t>(i % 4)] * kDegree,
                     radius, 0.0, 0.0});
  }
  return beams;
}

std::vector<Beam> vlp16_beams() {
  static constexpr int kElevations[16] = {-15, 1, -13, 3,  -11, 5,  -9, 7,
                                          -7,  9, -5,  11, -3,  13, -1, 15};
  std::vector<Beam> beams;
  for (int i = 0; i < 16; ++i) {
    // The lasers fire 2.304 us apart in a cycle of 55.296 us and leave 11.2 mm above or below.
    const double height = 0.0112 * -kElevations[i] / 15.0;
    beams.push_back({kElevations[i] * kDegree, 0.0, 0.0, height, i * 2.304 / 55.296});
  }
  return beams;
}

std::vector<Beam> hdl64e_beams() {
  std::vector<Beam> beams;
  static constexpr std::array<double, 4> kColumnsDeg{-6.4, -2.1, 2.1, 6.4};
  for (int i = 0; i < 64; ++i) {
    const double elevation = i < 32 ? 2.0 - i / 3.0 : -8.83 - 0.5 * (i - 32);
    beams.push_back({elevation * kDegree, kColumnsDeg[static_cast<std::size_t>(i % 4)] * kDegree,
                     0.0, i < 32 ? 0.03 : -0.03, 0.0});
  }
  return beams;
}

/// Elevation of the share `rank` (0 bottom, 1 top) of rings of which half lie within a quarter of
/// the field of view around the horizon.
double uneven_elevation(double bottom, double top, double rank) {
  const double band = 0.25 * (top - bottom);
  const double low = std::clamp(-0.5 * band, bottom, top - band);
  const double outside = (top - bottom) - band;
  const double rank_low = 0.5 * (low - bottom) / outside;
  const double rank_high = rank_low + 0.5;
  if (rank < rank_low) return bottom + 2.0 * outside * rank;
  if (rank < rank_high) return low + 2.0 * band * (rank - rank_low);
  return low + band + 2.0 * outside * (rank - rank_high);
}

/// `rings` beams, from the top down, between the lowest and the highest of `own`, which also lend
/// their azimuth offsets, origins and delays.
std::vector<Beam> respaced(std::span<const Beam> own, std::size_t rings, bool is_uneven) {
  const auto [lowest, highest] =
      std::minmax_element(own.begin(), own.end(),
                          [](const Beam& a, const Beam& b) { return a.elevation < b.elevation; });
  std::vector<Beam> beams;
  for (std::size_t i = 0; i < rings; ++i) {
    const double rank = 1.0 - static_cast<double>(i) / static_cast<double>(rings - 1);
    Beam beam = own[i % own.size()];
    beam.height = own[i * own.size() / rings].height;
    beam.delay = own.back().delay * static_cast<double>(i) / static_cast<double>(rings - 1);
    beam.elevation = is_uneven
                         ? uneven_elevation(lowest->elevation, highest->elevation, rank)
                         : lowest->elevation + rank * (highest->elevation - lowest->elevation);
    beams.push_back(beam);
  }
  return beams;
}

/// A spinning sensor's own beams and columns.
struct SpinningHead {
  std::vector<Beam> beams;
  std::uint32_t columns;
};

SpinningHead spinning_head(SensorKind kind) {
  switch (kind) {
    case SensorKind::kHdl64e:
      return {hdl64e_beams(), 2083};
    case SensorKind::kVlp16:
      return {vlp16_beams(), 1808};
    case SensorKind::kOs1_64:
      return {ouster_beams(64, 22.5, -22.5, {4.2, 1.42, -1.37, -4.14}, 0.0121), 1024};
    default:
      return {ouster_beams(128, 10.76, -11.09, {2.07, 0.66, -0.71, -2.08}, 0.01376), 1024};
  }
}

/// 120 by 19.2 degrees, four lines at a time from left to right.
void make_aeva(std::uint32_t thin, std::vector<PatternRay>& rays) {
  constexpr std::uint32_t kLines = 64;
  constexpr std::uint32_t kColumns = 1000;
  constexpr std::uint32_t kParallel = 4;
  constexpr std::uint32_t kPasses = kLines / kParallel;
  for (std::uint32_t pass = 0; pass < kPasses; ++pass) {
    for (std::uint32_t column = 0; column < kColumns; column += thin) {
      for (std::uint32_t b = 0; b < kParallel; ++b) {
        const std::uint32_t line = pass * kParallel + b;
        const double elevation = 9.6 - 19.2 * line / (kLines - 1);
        const double azimuth = 60.0 - 120.0 * column / (kColumns - 1);
        const double time = (pass + static_cast<double>(column) / kColumns) / kPasses;
        rays.push_back({{},
                        spherical(azimuth * kDegree, elevation * kDegree),
                        static_cast<float>(time),
                        line * kColumns + column,
                        static_cast<std::uint16_t>(line)});
      }
    }
  }
}

/// Two counter-rotating prisms trace a rosette; six lines per shot.
void make_avia(double start_s, std::uint32_t thin, std::vector<PatternRay>& rays) {
  constexpr double kOmega1 = 7294.0 * 2.0 * kPi / 60.0;
  constexpr double kOmega2 = -4664.0 * 2.0 * kPi / 60.0;
  constexpr double kAmplitudeDeg = 17.6;
  constexpr double kLineSpacingDeg = 1.36;
  constexpr double kRoofElevationDeg = -25.0;  // below it a car-mounted unit sees its own roof
  constexpr std::uint32_t kLines = 6;
  constexpr std::uint32_t kShots = 4000;
  for (std::uint32_t shot = 0; shot < kShots; shot += thin) {
    for (std::uint32_t line = 0; line < kLines; ++line) {
      const double in_sweep = kSweepSeconds * (shot + line / 6.0) / kShots;
      const double t = start_s + in_sweep;
      const double azimuth = kAmplitudeDeg * (std::cos(kOmega1 * t) + std::cos(kOmega2 * t));
      const double elevation = kAmplitudeDeg * (std::sin(kOmega1 * t) + std::sin(kOmega2 * t)) +
                               (line - 2.5) * kLineSpacingDeg;
      if (elevation < kRoofElevationDeg) continue;
      rays.push_back({{},
                      spherical(azimuth * kDegree, elevation * kDegree),
                      static_cast<float>(in_sweep / kSweepSeconds),
                      shot * kLines + line,
                      static_cast<std::uint16_t>(line)});
    }
  }
}

/// A fast rotor and a slow nod; a row of four beams that turns with the rotor.
void make_mid360(double start_s, std::uint32_t thin, std::vector<PatternRay>& rays) {
  constexpr double kRotorDegPerSecond = -62050.63;
  constexpr std::uint32_t kLines = 4;
  constexpr std::uint32_t kShots = 5000;
  for (std::uint32_t shot = 0; shot < kShots; shot += thin) {
    const double in_sweep = kSweepSeconds * shot / kShots;
    const double t = start_s + in_sweep;
    const double rotor = 269.0 + kRotorDegPerSecond * t;
    const double centre = 22.5 + 25.5 * std::cos(2.0 * kPi * 10.0 * t);
    for (std::uint32_t line = 0; line < kLines; ++line) {
      const double b = 1.5 - line;
      const double elevation = centre + 2.0 * b * std::cos((rotor - 269.0) * kDegree);
      const double azimuth =
          rotor - 2.0 * b * std::cos(rotor * kDegree) / std::cos(elevation * kDegree);
      rays.push_back({{},
                      spherical(azimuth * kDegree, elevation * kDegree),
                      static_cast<float>(in_sweep / kSweepSeconds),
                      shot * kLines + line,
                      static_cast<std::uint16_t>(line)});
    }
  }
}

}  // namespace

LidarModel lidar_model(SensorKind kind) {
  switch (kind) {
    case SensorKind::kHdl64e:
      return {kind, 0.9, 120.0, 50.0, 0.018, 0.002};
    case SensorKind::kVlp16:
      return {kind, 0.5, 100.0, 50.0, 0.02, 0.0025};
    case SensorKind::kOs1_64:
      return {kind, 0.8, 120.0, 40.0, 0.015, 0.0023};
    case SensorKind::kOs2_128:
      return {kind, 1.0, 240.0, 90.0, 0.02, 0.0016};
    case SensorKind::kAevaAeries2:
      return {kind, 1.0, 400.0, 120.0, 0.02, 0.001};
    case SensorKind::kLivoxAvia:
      return {kind, 1.0, 450.0, 190.0, 0.02, 0.0025};
    case SensorKind::kLivoxMid360:
      return {kind, 0.1, 70.0, 40.0, 0.02, 0.0026};
    case SensorKind::kGeneric:
      break;
  }
  throw std::runtime_error("the simulator has no scan pattern for sensor '" +
                           std::string(sensor_model(kind).name) + "'");
}

bool repeats(SensorKind kind) {
  return kind != SensorKind::kLivoxAvia && kind != SensorKind::kLivoxMid360;
}

bool is_spinning(SensorKind kind) {
  return kind == SensorKind::kHdl64e || kind == SensorKind::kVlp16 || kind == SensorKind::kOs1_64 ||
         kind == SensorKind::kOs2_128;
}

void make_pattern(SensorKind kind, double start_s, std::uint32_t thin,
                  std::vector<PatternRay>& rays, const Sampling& sampling) {
  rays.clear();
  if (is_spinning(kind)) {
    SpinningHead head = spinning_head(kind);
    if (sampling.columns != 0) head.columns = sampling.columns;
    if (sampling.rings != 0 || sampling.uneven_rings) {
      const std::size_t rings = sampling.rings != 0 ? sampling.rings : head.beams.size();
      head.beams = respaced(head.beams, rings, sampling.uneven_rings);
    }
    return make_spinning(head.beams, head.columns, thin, rays);
  }
  if (kind == SensorKind::kAevaAeries2) return make_aeva(thin, rays);
  if (kind == SensorKind::kLivoxAvia) return make_avia(start_s, thin, rays);
  if (kind == SensorKind::kLivoxMid360) return make_mid360(start_s, thin, rays);
  throw std::runtime_error("the simulator has no scan pattern for this sensor");
}

}  // namespace unimapper::simulator
