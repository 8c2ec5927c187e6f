#include "town_plan.hpp"

#include <algorithm>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

std::array<double, TownPlan::kLines> jittered_lines(Random& random) {
  std::array<double, TownPlan::kLines> lines{};
  for (std::size_t i = 1; i < lines.size(); ++i) {
    lines[i] = lines[i - 1] + random.uniform(74.0, 96.0);
  }
  const double centre = 0.5 * (lines[3] + lines[4]);
  for (double& line : lines) line -= centre;
  return lines;
}

}  // namespace

TownPlan::TownPlan(std::uint64_t seed) {
  Random random(seed, Stream::kPlan);
  u_ = jittered_lines(random);
  v_ = jittered_lines(random);
  const auto wave = [&](double amplitude, double shortest, double longest) {
    const double k = 2.0 * kPi / random.uniform(shortest, longest);
    const double direction = random.uniform(0.0, 2.0 * kPi);
    return Wave{amplitude, k * std::cos(direction), k * std::sin(direction),
                random.uniform(0.0, 2.0 * kPi)};
  };
  for (Wave& w : warp_x_) w = wave(4.5, 230.0, 340.0);
  for (Wave& w : warp_y_) w = wave(4.5, 230.0, 340.0);
  hills_ = {wave(3.2, 300.0, 420.0), wave(2.0, 170.0, 260.0), wave(0.5, 80.0, 120.0)};
}

Vec2 TownPlan::warp(Vec2 plan) const {
  return {plan.x + warp_x_[0].at(plan) + warp_x_[1].at(plan),
          plan.y + warp_y_[0].at(plan) + warp_y_[1].at(plan)};
}

double TownPlan::height(Vec2 town) const {
  return hills_[0].at(town) + hills_[1].at(town) + hills_[2].at(town);
}

double TownPlan::sidewalk_lift(Vec2 town) const {
  // The warp is gentle: a few fixed-point steps invert it to the centimetre.
  Vec2 plan = town;
  for (int i = 0; i < 6; ++i) plan = plan + (town - warp(plan));
  double to_line = 1e9;
  for (int i = 0; i < kLines; ++i) {
    to_line = std::min({to_line, std::abs(plan.x - line_u(i)), std::abs(plan.y - line_v(i))});
  }
  const double inside = std::clamp((to_line - (street::kKerb - 0.2)) / 0.4, 0.0, 1.0);
  return inside * (street::kKerbHeight + 0.015);
}

Vec3 TownPlan::up(Vec2 town) const {
  constexpr double kStep = 0.5;
  const double dx = height({town.x + kStep, town.y}) - height({town.x - kStep, town.y});
  const double dy = height({town.x, town.y + kStep}) - height({town.x, town.y - kStep});
  return normalized({-dx, -dy, 2.0 * kStep});
}

Vec3 TownPlan::ground(Vec2 plan, double lift) const {
  const Vec2 p = warp(plan);
  return {p.x, p.y, height(p) + lift};
}

Frame TownPlan::level_frame(Vec2 plan, Vec2 along, double lift) const {
  const Vec2 step = 0.5 * normalized(along);
  return upright_frame(ground(plan, lift), warp(plan + step) - warp(plan - step));
}

Frame TownPlan::tilted_frame(Vec2 plan, Vec2 along, double lift) const {
  const Vec2 step = 0.5 * normalized(along);
  return sloped_frame(ground(plan, lift), warp(plan + step) - warp(plan - step), up(warp(plan)));
}

}  // namespace unimapper::simulator
