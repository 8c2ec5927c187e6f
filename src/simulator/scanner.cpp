#include "scanner.hpp"

#include <algorithm>
#include <cmath>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

constexpr double kSecondRayShare = 0.3;
constexpr double kFalseReturnShare = 3e-5;

/// Purposes of a ray's random streams.
enum RayStream : std::uint64_t { kAim = 0, kSecondAim = 1, kGlass = 2, kDetect = 3 };

double unit_gauss(Random& random) { return random.gauss(); }

/// `direction` tilted by a small random angle, one sigma `sigma` per axis.
Vec3 jittered(Vec3 direction, double sigma, Random& random) {
  const Vec3 side =
      normalized(cross(direction, std::abs(direction.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}));
  const Vec3 other = cross(direction, side);
  const double a = sigma * unit_gauss(random);
  const double b = sigma * unit_gauss(random);
  return normalized(direction + a * side + b * other);
}

}  // namespace

Frame interpolate(const SweepFrames& frames, double time) {
  const double at = std::clamp(time, 0.0, 1.0) * static_cast<double>(frames.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(at), frames.size() - 2);
  const double w = at - static_cast<double>(low);
  const Frame& a = frames[low];
  const Frame& b = frames[low + 1];
  return orthonormalized(
      {lerp(a.x, b.x, w), lerp(a.y, b.y, w), lerp(a.z, b.z, w), lerp(a.origin, b.origin, w)});
}

void Scanner::aim(std::uint32_t scan, const std::vector<PatternRay>& rays,
                  const SweepFrames& frames) {
  queries_.resize(rays.size());
  hits_.resize(rays.size());
  second_queries_.clear();
  second_of_.clear();
  const std::uint64_t scan_key = derive_key(key_, scan);
  const double sigma = 0.25 * model_.divergence_rad;
  float last_time = -1.0F;
  Frame frame;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const PatternRay& ray = rays[i];
    if (ray.time != last_time) frame = interpolate(frames, ray.time);
    last_time = ray.time;
    const std::uint64_t ray_key = derive_key(scan_key, ray.index);
    const auto query = [&](Random random) {
      return RayQuery{frame(ray.origin), frame.rotate(jittered(ray.direction, sigma, random)),
                      ray.time, static_cast<float>(0.5 * model_.range_min_m),
                      static_cast<float>(model_.range_max_m)};
    };
    queries_[i] = query(Random(derive_key(ray_key, kAim)));
    Random second(derive_key(ray_key, kSecondAim));
    if (second.chance(kSecondRayShare)) {
      second_of_.push_back(static_cast<std::uint32_t>(i));
      second_queries_.push_back(query(second));
    }
  }
  second_hits_.resize(second_queries_.size());
}

void Scanner::see_through_glass(std::uint64_t ray_key, RayQuery& query, RayHit& hit,
                                double& pass) const {
  constexpr int kMaxPanes = 6;
  Random random(derive_key(ray_key, kGlass));
  for (int pane = 0; pane < kMaxPanes; ++pane) {
    if (hit.distance_m < 0.0F || !properties(hit.surface).is_glass) return;
    const double c = hit.cosine;
    const double reflected = 0.06 + 0.9 * std::pow(1.0 - c, 5.0);
    if (random.chance(0.1 + 0.25 * std::pow(c, 30.0))) return;  // the pane itself reflects
    pass *= (1.0 - reflected) * (1.0 - reflected);              // both ways
    query.near_m = hit.distance_m + 0.004F;
    caster_.cast({&query, 1}, {&hit, 1});
  }
}

Scanner::Echo Scanner::echo_of(const RayHit& hit, double pass, double leaf_factor) const {
  if (hit.distance_m < 0.0F) return {-1.0, 0.0, 0.0F, 0, 0};
  const SurfaceProperties& p = properties(hit.surface);
  const double c = std::max(0.02, static_cast<double>(hit.cosine));
  double brightness = p.reflectance * std::pow(c, static_cast<double>(p.lobe_exponent));
  if (p.specular > 0.0F) brightness += p.specular * std::pow(c, 40.0);
  if (p.is_retroreflective) brightness *= 20.0;
  if (hit.surface == Surface::kLeaf) brightness *= leaf_factor;
  if (p.is_glass) brightness = 0.12 * std::pow(c, 20.0) + 0.03;
  const double r = std::max(1.0, static_cast<double>(hit.distance_m));
  const double loss = model_.range_10_m / r;
  const double strength = brightness / 0.1 * loss * loss * std::exp(-0.003 * r) * pass;
  return {hit.distance_m, strength, static_cast<float>(std::min(1.0, brightness * pass)), hit.label,
          hit.object};
}

Scanner::Echo Scanner::combined(const Echo& a, const Echo& b, double weight) {
  if (b.range < 0.0) return a;
  if (a.range < 0.0) return b;
  const double gap = std::abs(a.range - b.range);
  if (gap < 0.03) return a;
  if (gap > 0.6) return a.strength >= b.strength ? a : b;
  // Both surfaces in one pulse: a range in between that belongs to neither.
  Echo mixed = weight < 0.5 ? a : b;
  mixed.range = (1.0 - weight) * a.range + weight * b.range;
  return mixed;
}

void Scanner::scan(std::uint32_t scan, const std::vector<PatternRay>& rays,
                   const SweepFrames& frames, std::vector<LidarReturn>& returns) {
  aim(scan, rays, frames);
  caster_.cast(queries_, hits_);
  caster_.cast(second_queries_, second_hits_);
  const std::uint64_t scan_key = derive_key(key_, scan);
  std::size_t second = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const PatternRay& ray = rays[i];
    const std::uint64_t ray_key = derive_key(scan_key, ray.index);
    Random random(derive_key(ray_key, kDetect));
    const double leaf_factor = random.uniform(0.6, 1.4);
    double pass = 1.0;
    see_through_glass(ray_key, queries_[i], hits_[i], pass);
    Echo echo = echo_of(hits_[i], pass, leaf_factor);
    if (second < second_of_.size() && second_of_[second] == i) {
      double second_pass = 1.0;
      see_through_glass(ray_key + 1, second_queries_[second], second_hits_[second], second_pass);
      echo =
          combined(echo, echo_of(second_hits_[second], second_pass, leaf_factor), random.uniform());
      ++second;
    }
    if (random.chance(kFalseReturnShare)) {
      const double span = std::min(100.0, model_.range_max_m) - model_.range_min_m;
      echo = {model_.range_min_m + span * random.uniform(), 1e3, 0.02F, label::kOutlier, 0};
    } else {
      if (echo.range < 0.0) continue;
      const double detected =
          0.995 / (1.0 + std::exp(-(2.2 + 2.5 * std::log(std::max(echo.strength, 1e-9)))));
      if (!random.chance(detected)) continue;
    }
    const double spread = std::min(100.0, 1.0 / std::max(echo.strength, 1e-9));
    const double sigma = std::sqrt(model_.range_sigma_m * model_.range_sigma_m + 1e-4 * spread);
    const double range = echo.range + sigma * unit_gauss(random);
    if (range < model_.range_min_m || range > model_.range_max_m) continue;
    const double flicker = 1.0 + 0.06 * unit_gauss(random);
    const double intensity = std::clamp(echo.intensity * flicker, 0.0, 1.0);
    returns.push_back({ray.origin + range * ray.direction, ray.time, static_cast<float>(intensity),
                       echo.label, echo.object, ray.ring});
  }
}

}  // namespace unimapper::simulator
