// Vectors and frames of the simulator.
//
// Deliberately not Eigen: nearly every file here builds triangles from a handful of vector
// operations, and this header compiles in a tenth of the time.
#pragma once

#include <cmath>

namespace unimapper::simulator {

struct Vec3 {
  double x = 0.0, y = 0.0, z = 0.0;

  friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
  Vec3 operator-() const { return {-x, -y, -z}; }
};

inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(Vec3 a) { return (1.0 / norm(a)) * a; }
inline Vec3 lerp(Vec3 a, Vec3 b, double w) { return a + w * (b - a); }

/// A point or direction of the ground plan.
struct Vec2 {
  double x = 0.0, y = 0.0;

  friend Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2 operator*(double s, Vec2 a) { return {s * a.x, s * a.y}; }
};

inline double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
inline double norm(Vec2 a) { return std::sqrt(dot(a, a)); }
inline Vec2 normalized(Vec2 a) { return (1.0 / norm(a)) * a; }
inline Vec2 left_of(Vec2 a) { return {-a.y, a.x}; }

/// A right-handed orthonormal frame: maps its local coordinates to the parent's.
struct Frame {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Vec3 origin;

  [[nodiscard]] Vec3 rotate(Vec3 p) const { return p.x * x + p.y * y + p.z * z; }
  [[nodiscard]] Vec3 operator()(Vec3 p) const { return origin + rotate(p); }
  [[nodiscard]] Vec3 rotate_back(Vec3 p) const { return {dot(x, p), dot(y, p), dot(z, p)}; }
  [[nodiscard]] Frame inverse() const {
    Frame f;
    f.x = {x.x, y.x, z.x};
    f.y = {x.y, y.y, z.y};
    f.z = {x.z, y.z, z.z};
    f.origin = -rotate_back(origin);
    return f;
  }
  friend Frame operator*(const Frame& a, const Frame& b) {
    return {a.rotate(b.x), a.rotate(b.y), a.rotate(b.z), a(b.origin)};
  }
};

/// Frame at `origin`, level, with x along `heading`.
inline Frame upright_frame(Vec3 origin, Vec2 heading) {
  const Vec2 h = normalized(heading);
  return {{h.x, h.y, 0}, {-h.y, h.x, 0}, {0, 0, 1}, origin};
}

/// Frame at `origin` standing on a slope: z along `up`, x as near `heading` as that allows.
inline Frame sloped_frame(Vec3 origin, Vec2 heading, Vec3 up) {
  const Vec3 z = normalized(up);
  const Vec3 y = normalized(cross(z, {heading.x, heading.y, 0}));
  return {cross(y, z), y, z, origin};
}

/// Rotation by the rotation vector `r` (axis times angle, radians).
inline Frame rotation_frame(Vec3 r) {
  const double angle = norm(r);
  if (angle < 1e-12) return {};
  const Vec3 k = (1.0 / angle) * r;
  const double s = std::sin(angle);
  const double c = std::cos(angle);
  const auto turn = [&](Vec3 p) { return c * p + s * cross(k, p) + ((1.0 - c) * dot(k, p)) * k; };
  return {turn({1, 0, 0}), turn({0, 1, 0}), turn({0, 0, 1}), {}};
}

/// Rotation vector of the rotation part of `f`.
inline Vec3 rotation_vector(const Frame& f) {
  const Vec3 axis{0.5 * (f.y.z - f.z.y), 0.5 * (f.z.x - f.x.z), 0.5 * (f.x.y - f.y.x)};
  const double sine = norm(axis);
  const double cosine = 0.5 * (f.x.x + f.y.y + f.z.z - 1.0);
  if (sine < 1e-12) return axis;
  return (std::atan2(sine, cosine) / sine) * axis;
}

/// Makes the axes orthonormal again after many products.
inline Frame orthonormalized(Frame f) {
  f.x = normalized(f.x);
  f.y = normalized(f.y - dot(f.x, f.y) * f.x);
  f.z = cross(f.x, f.y);
  return f;
}

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180.0;

}  // namespace unimapper::simulator
