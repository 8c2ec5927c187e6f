#include "path.hpp"

#include <algorithm>

namespace unimapper::simulator {
namespace {

constexpr double kRightTurnRadius = 5.5;
constexpr double kLeftTurnRadius = 8.5;

void append_line(std::vector<Vec2>& points, Vec2 from, Vec2 to) {
  const int parts = std::max(1, static_cast<int>(norm(to - from)));
  for (int i = 0; i < parts; ++i) {
    points.push_back(from + (static_cast<double>(i) / parts) * (to - from));
  }
}

/// Fillet between the directions `in` and `out` (unit, perpendicular) that join in `corner`.
void append_turn(std::vector<Vec2>& points, Vec2 corner, Vec2 in, Vec2 out, double radius) {
  const Vec2 centre = corner - radius * in + radius * out;
  constexpr int kParts = 12;
  for (int i = 0; i < kParts; ++i) {
    const double angle = 0.5 * kPi * i / kParts;
    points.push_back(centre + (radius * std::sin(angle)) * in - (radius * std::cos(angle)) * out);
  }
}

Vec2 position(const TownPlan& plan, Node node) {
  return {plan.line_u(node.i), plan.line_v(node.j)};
}

std::vector<Vec2> warped(const TownPlan& plan, std::vector<Vec2> points) {
  for (Vec2& p : points) p = plan.warp(p);
  return points;
}

/// Moving average over a few neighbours: spreads the jump of curvature at the ends of a turn.
std::vector<Vec2> smoothed(const std::vector<Vec2>& points, bool closed) {
  constexpr int kHalf = 3;
  const int count = static_cast<int>(points.size());
  std::vector<Vec2> result(points.size());
  for (int i = 0; i < count; ++i) {
    Vec2 sum{};
    const int reach = closed ? kHalf : std::min({kHalf, i, count - 1 - i});
    for (int k = -reach; k <= reach; ++k) {
      sum = sum + points[static_cast<std::size_t>((i + k + count) % count)];
    }
    result[static_cast<std::size_t>(i)] = (1.0 / (2 * reach + 1)) * sum;
  }
  return result;
}

std::vector<Vec2> resampled(std::vector<Vec2> points, bool closed, double step) {
  if (closed) points.push_back(points.front());
  std::vector<Vec2> result;
  double next = 0.0;
  double s = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double length = norm(points[i] - points[i - 1]);
    for (; next < s + length; next += step) {
      result.push_back(points[i - 1] + ((next - s) / length) * (points[i] - points[i - 1]));
    }
    s += length;
  }
  if (!closed) result.push_back(points.back());
  return result;
}

}  // namespace

Path::Path(std::vector<Vec2> points, bool closed)
    : points_(
          resampled(smoothed(resampled(std::move(points), closed, kStep), closed), closed, kStep)),
      closed_(closed) {
  const std::size_t segments = closed ? points_.size() : points_.size() - 1;
  length_ = kStep * static_cast<double>(segments);
}

Path Path::reversed() const {
  Path path = *this;
  std::reverse(path.points_.begin(), path.points_.end());
  return path;
}

Vec2 Path::at(double s) const {
  const auto count = static_cast<double>(points_.size());
  double index = s / kStep;
  if (closed_) {
    index -= count * std::floor(index / count);
  } else if (index <= 0.0) {
    return points_[0] + index * (points_[1] - points_[0]);
  } else if (index >= count - 1.0) {
    const Vec2 step = points_[points_.size() - 1] - points_[points_.size() - 2];
    return points_.back() + (index - (count - 1.0)) * step;
  }
  const auto low = std::min(static_cast<std::size_t>(index), points_.size() - 1);
  const std::size_t high = (low + 1) % points_.size();
  return points_[low] + (index - static_cast<double>(low)) * (points_[high] - points_[low]);
}

Vec2 Path::heading(double s, double span) const {
  return normalized(at(s + 0.5 * span) - at(s - 0.5 * span));
}

double Path::curvature(double s) const {
  const Vec2 before = heading(s - 1.5);
  const Vec2 after = heading(s + 1.5);
  return std::atan2(cross(before, after), dot(before, after)) / 3.0;
}

double Path::nearest(Vec2 p) const {
  std::size_t best = 0;
  double best_square = 1e300;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double square = dot(points_[i] - p, points_[i] - p);
    if (square < best_square) {
      best_square = square;
      best = i;
    }
  }
  return kStep * static_cast<double>(best);
}

Path rounded_loop(const std::vector<Vec2>& corners) {
  constexpr double kStep = 0.5;
  constexpr int kHalf = 5;  // moving average over five metres, twice
  std::vector<Vec2> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 from = corners[i];
    const Vec2 to = corners[(i + 1) % corners.size()];
    const int parts = std::max(1, static_cast<int>(norm(to - from) / kStep));
    for (int k = 0; k < parts; ++k) {
      points.push_back(from + (static_cast<double>(k) / parts) * (to - from));
    }
  }
  const int count = static_cast<int>(points.size());
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<Vec2> smooth(points.size());
    for (int i = 0; i < count; ++i) {
      Vec2 sum{};
      for (int k = -kHalf; k <= kHalf; ++k) {
        sum = sum + points[static_cast<std::size_t>((i + k + count) % count)];
      }
      smooth[static_cast<std::size_t>(i)] = (1.0 / (2 * kHalf + 1)) * sum;
    }
    points = std::move(smooth);
  }
  return {std::move(points), true};
}

double interpolate(std::span<const double> samples, double index) {
  const double at = std::max(0.0, index);
  const auto low = std::min(static_cast<std::size_t>(at), samples.size() - 2);
  const double w = at - static_cast<double>(low);
  return samples[low] + w * (samples[low + 1] - samples[low]);
}

std::vector<double> drivable_speed(const Path& path, std::vector<double> wish_m_s) {
  constexpr double kLateral = 2.2;  // m/s^2
  constexpr double kAcceleration = 1.3;
  constexpr double kBraking = 1.6;
  std::vector<double>& speed = wish_m_s;
  const std::size_t count = speed.size();
  if (count == 0) return wish_m_s;
  for (std::size_t i = 0; i < count; ++i) {
    const double curvature = path.curvature(Path::kStep * static_cast<double>(i));
    speed[i] = std::min(speed[i], std::sqrt(kLateral / std::max(std::abs(curvature), 1e-6)));
  }
  // Twice around, so that the limits also hold where the closed path wraps.
  for (std::size_t k = 1; k < 2 * count; ++k) {
    double& now = speed[k % count];
    const double before = speed[(k - 1) % count];
    now = std::min(now, std::sqrt(before * before + 2.0 * kAcceleration * Path::kStep));
  }
  for (std::size_t k = 2 * count - 1; k > 0; --k) {
    double& now = speed[(k - 1) % count];
    const double after = speed[k % count];
    now = std::min(now, std::sqrt(after * after + 2.0 * kBraking * Path::kStep));
  }
  return wish_m_s;
}

Path lane_path(const TownPlan& plan, std::span<const Node> nodes, bool closed, double offset) {
  const std::size_t count = nodes.size();
  const auto direction = [&](std::size_t k) {
    return normalized(position(plan, nodes[(k + 1) % count]) - position(plan, nodes[k % count]));
  };
  const auto right = [&](Vec2 d) { return offset * Vec2{d.y, -d.x}; };
  std::vector<Vec2> points;
  Vec2 from = position(plan, nodes[0]) + right(direction(0));
  if (closed) {
    // Start where the turn at node 0 ends.
    const Vec2 in = direction(count - 1);
    const Vec2 out = direction(0);
    const double turn = cross(in, out);
    const double radius = turn > 0.5 ? kLeftTurnRadius : kRightTurnRadius;
    if (std::abs(turn) > 0.5)
      from = position(plan, nodes[0]) + right(in) + right(out) + radius * out;
  }
  const std::size_t last = closed ? count : count - 2;
  for (std::size_t k = 1; k <= last; ++k) {
    const Vec2 in = direction(k - 1);
    const Vec2 out = direction(k);
    const double turn = cross(in, out);
    if (std::abs(turn) < 0.5) continue;
    const double radius = turn > 0.0 ? kLeftTurnRadius : kRightTurnRadius;
    const Vec2 corner = position(plan, nodes[k % count]) + right(in) + right(out);
    append_line(points, from, corner - radius * in);
    append_turn(points, corner, in, out, radius);
    from = corner + radius * out;
  }
  if (!closed) {
    const Vec2 end = position(plan, nodes[count - 1]) + right(direction(count - 2));
    append_line(points, from, end);
    points.push_back(end);
  } else if (std::abs(cross(direction(count - 1), direction(0))) < 0.5) {
    append_line(points, from, position(plan, nodes[0]) + right(direction(0)));
  }
  return {warped(plan, std::move(points)), closed};
}

Path sidewalk_path(const TownPlan& plan, int column, int row, int columns, int rows,
                   double from_centre, bool clockwise) {
  const Vec2 low{plan.line_u(column) + from_centre, plan.line_v(row) + from_centre};
  const Vec2 high{plan.line_u(column + columns) - from_centre,
                  plan.line_v(row + rows) - from_centre};
  constexpr double kRound = 1.5;
  std::vector<Vec2> points;
  const Vec2 corners[4] = {low, {high.x, low.y}, high, {low.x, high.y}};
  const Vec2 directions[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (int k = 0; k < 4; ++k) {
    append_line(points, corners[k] + kRound * directions[k],
                corners[(k + 1) % 4] - kRound * directions[k]);
    append_turn(points, corners[(k + 1) % 4], directions[k], directions[(k + 1) % 4], kRound);
  }
  if (clockwise) std::reverse(points.begin(), points.end());
  return {warped(plan, std::move(points)), true};
}

}  // namespace unimapper::simulator
