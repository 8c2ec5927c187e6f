// Prototypes of cars, vans and buses; origin on the ground below the middle, x forward.
#include <array>
#include <vector>

#include "world.hpp"

namespace unimapper::simulator {
namespace {

/// One cross-section of the lower body.
struct Station {
  double x, belt, half_width;
};

/// Upper part with the windows: lower and upper ends of wind screen, rear window and sides.
struct Cabin {
  double front_low, front_high, rear_low, rear_high, roof, half_width_roof;
};

struct CarShape {
  std::vector<Station> stations;  ///< from the rear to the front
  Cabin cabin;
  double sill;  ///< lower edge of the body
  double wheel_radius, front_axle, rear_axle;
  bool has_glass_sides;
};

double belt_at(const CarShape& shape, double x) {
  for (std::size_t i = 1; i < shape.stations.size(); ++i) {
    const Station& a = shape.stations[i - 1];
    const Station& b = shape.stations[i];
    if (x <= b.x) return a.belt + (b.belt - a.belt) * (x - a.x) / (b.x - a.x);
  }
  return shape.stations.back().belt;
}

void add_lower_body(Mesh& mesh, const CarShape& shape, Surface paint) {
  const auto& s = shape.stations;
  const auto ring = [&](const Station& at, double side) {
    const double w = side * at.half_width;
    const double middle = 0.55 * shape.sill + 0.45 * at.belt;
    return std::array<Vec3, 4>{Vec3{at.x, 0.93 * w, shape.sill}, Vec3{at.x, w, middle},
                               Vec3{at.x, 0.95 * w, at.belt - 0.05}, Vec3{at.x, 0.82 * w, at.belt}};
  };
  for (std::size_t i = 1; i < s.size(); ++i) {
    for (const double side : {-1.0, 1.0}) {
      const auto a = ring(s[i - 1], side);
      const auto b = ring(s[i], side);
      for (std::size_t k = 0; k + 1 < a.size(); ++k) {
        mesh.quad(a[k], b[k], b[k + 1], a[k + 1], paint);
      }
    }
    const auto left_a = ring(s[i - 1], 1.0);
    const auto right_a = ring(s[i - 1], -1.0);
    const auto left_b = ring(s[i], 1.0);
    const auto right_b = ring(s[i], -1.0);
    mesh.quad(left_a[3], left_b[3], right_b[3], right_a[3], paint);
    mesh.quad(left_a[0], left_b[0], right_b[0], right_a[0], Surface::kCarTrim);
  }
  for (const Station& end : {s.front(), s.back()}) {
    const auto left = ring(end, 1.0);
    const auto right = ring(end, -1.0);
    for (std::size_t k = 0; k + 1 < left.size(); ++k) {
      mesh.quad(left[k], left[k + 1], right[k + 1], right[k], k == 0 ? Surface::kCarTrim : paint);
    }
  }
}

void add_cabin(Mesh& mesh, const CarShape& shape, Surface paint) {
  const Cabin& c = shape.cabin;
  const double low = 0.82 * shape.stations[shape.stations.size() / 2].half_width;
  const double high = c.half_width_roof;
  const double z_front = belt_at(shape, c.front_low);
  const double z_rear = belt_at(shape, c.rear_low);
  const Surface side_window = shape.has_glass_sides ? Surface::kCarGlass : paint;
  const auto corners = [&](double side) {
    return std::array<Vec3, 4>{
        Vec3{c.rear_low, side * low, z_rear}, Vec3{c.front_low, side * low, z_front},
        Vec3{c.front_high, side * high, c.roof}, Vec3{c.rear_high, side * high, c.roof}};
  };
  const auto left = corners(1.0);
  const auto right = corners(-1.0);
  mesh.quad(left[3], left[2], right[2], right[3], paint);               // roof
  mesh.quad(left[1], left[2], right[2], right[1], Surface::kCarGlass);  // wind screen
  mesh.quad(left[0], left[3], right[3], right[0], Surface::kCarGlass);  // rear window
  for (const auto& q : {left, right}) {
    // Window between pillars and roof rail.
    const Vec3 centre = 0.25 * (q[0] + q[1] + q[2] + q[3]);
    std::array<Vec3, 4> window;
    for (std::size_t i = 0; i < 4; ++i) window[i] = lerp(q[i], centre, 0.14);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t j = (i + 1) % 4;
      mesh.quad(q[i], q[j], window[j], window[i], paint);
    }
    mesh.quad(window[0], window[1], window[2], window[3], side_window);
    const double middle = 0.5 * (c.front_low + c.rear_low);
    const double w = q[0].y > 0 ? 1.0 : -1.0;
    mesh.quad({middle - 0.05, w * low, z_rear}, {middle + 0.05, w * low, z_rear},
              {middle + 0.05, w * high, c.roof}, {middle - 0.05, w * high, c.roof}, paint);
  }
  // Seats.
  for (const double y : {-0.38, 0.38}) {
    const double x = 0.55 * c.front_low + 0.45 * c.rear_low;
    mesh.box({}, {x - 0.45, y - 0.24, 0.4}, {x - 0.3, y + 0.24, c.roof - 0.25}, Surface::kCarTrim);
    mesh.box({}, {c.rear_low + 0.25, y - 0.28, 0.4}, {c.rear_low + 0.42, y + 0.28, c.roof - 0.4},
             Surface::kCarTrim);
  }
}

void add_wheels(Mesh& mesh, const CarShape& shape, double half_width) {
  const double r = shape.wheel_radius;
  for (const double x : {shape.front_axle, shape.rear_axle}) {
    for (const double side : {-1.0, 1.0}) {
      const Vec3 outer{x, side * half_width * 0.99, r};
      const Vec3 inner{x, side * (half_width - 0.22), r};
      mesh.tube(inner, outer, r, r, 14, Surface::kTyre);
      mesh.disc(outer, {0, 1, 0}, r, 14, Surface::kTyre);
      mesh.disc(outer + Vec3{0, 0.01 * side, 0}, {0, 1, 0}, 0.6 * r, 10, Surface::kCarTrim);
    }
  }
}

void add_details(Mesh& mesh, const CarShape& shape, Surface paint) {
  const Station& front = shape.stations.back();
  const Station& rear = shape.stations.front();
  for (const double side : {-1.0, 1.0}) {
    const double y = side * (front.half_width - 0.22);
    mesh.box({}, {front.x - 0.03, y - 0.16, front.belt - 0.28},
             {front.x + 0.02, y + 0.16, front.belt - 0.12}, Surface::kHeadlight);
    const double mirror = side * (shape.stations[shape.stations.size() / 2].half_width + 0.1);
    const double x = shape.cabin.front_low - 0.45;
    mesh.box({}, {x - 0.05, mirror - 0.1, 1.0}, {x + 0.08, mirror + 0.1, 1.14}, paint);
  }
  mesh.box({}, {front.x - 0.01, -0.26, 0.4}, {front.x + 0.03, 0.26, 0.51}, Surface::kPlate);
  mesh.box({}, {rear.x - 0.03, -0.26, 0.6}, {rear.x + 0.01, 0.26, 0.71}, Surface::kPlate);
}

Mesh make_car(const CarShape& shape, Surface paint) {
  Mesh mesh;
  add_lower_body(mesh, shape, paint);
  add_cabin(mesh, shape, paint);
  add_wheels(mesh, shape, shape.stations[shape.stations.size() / 2].half_width);
  add_details(mesh, shape, paint);
  return mesh;
}

CarShape saloon() {
  return {{{-2.25, 0.82, 0.78},
           {-1.9, 0.98, 0.88},
           {-1.2, 0.98, 0.9},
           {0.9, 0.95, 0.9},
           {1.7, 0.88, 0.88},
           {2.25, 0.72, 0.76}},
          {0.95, 0.25, -1.55, -0.85, 1.44, 0.58},
          0.2,
          0.31,
          1.35,
          -1.35,
          true};
}

CarShape hatchback() {
  return {{{-1.95, 0.85, 0.78},
           {-1.75, 0.98, 0.86},
           {-1.0, 0.96, 0.87},
           {0.75, 0.94, 0.87},
           {1.45, 0.88, 0.85},
           {1.95, 0.72, 0.74}},
          {0.9, 0.2, -1.85, -1.45, 1.49, 0.58},
          0.2,
          0.3,
          1.2,
          -1.25,
          true};
}

CarShape off_roader() {
  return {{{-2.3, 0.95, 0.85},
           {-2.1, 1.1, 0.93},
           {-1.2, 1.1, 0.95},
           {0.95, 1.08, 0.95},
           {1.8, 1.02, 0.93},
           {2.3, 0.85, 0.84}},
          {1.1, 0.5, -2.2, -1.9, 1.72, 0.66},
          0.27,
          0.36,
          1.4,
          -1.4,
          true};
}

CarShape van() {
  return {{{-2.7, 1.15, 0.92},
           {-2.5, 1.2, 0.97},
           {-1.0, 1.2, 0.98},
           {1.6, 1.15, 0.98},
           {2.3, 1.05, 0.95},
           {2.7, 0.85, 0.86}},
          {2.2, 1.5, -2.65, -2.6, 2.3, 0.86},
          0.27,
          0.35,
          1.7,
          -1.7,
          false};
}

Mesh make_bus() {
  Mesh mesh;
  constexpr double kHalfLength = 5.7;
  constexpr double kHalfWidth = 1.25;
  const Surface paint = Surface::kPaintMid;
  const auto side_wall = [&](double y) {
    const auto band = [&](double x0, double x1, double z0, double z1, Surface s) {
      mesh.quad({x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}, s);
    };
    band(-kHalfLength, kHalfLength, 0.3, 1.15, paint);
    band(-kHalfLength, kHalfLength, 2.35, 3.0, paint);
    for (int i = 0; i < 7; ++i) {
      const double x0 = -kHalfLength + 2.0 * kHalfLength * i / 7;
      const double x1 = -kHalfLength + 2.0 * kHalfLength * (i + 1) / 7;
      band(x0, x0 + 0.1, 1.15, 2.35, paint);
      band(x0 + 0.1, x1, 1.15, 2.35, Surface::kCarGlass);
    }
  };
  side_wall(kHalfWidth);
  side_wall(-kHalfWidth);
  for (const double x : {-kHalfLength, kHalfLength}) {
    const auto band = [&](double z0, double z1, Surface s) {
      mesh.quad({x, -kHalfWidth, z0}, {x, kHalfWidth, z0}, {x, kHalfWidth, z1},
                {x, -kHalfWidth, z1}, s);
    };
    band(0.3, 1.1, paint);
    band(1.1, 2.5, Surface::kCarGlass);
    band(2.5, 3.0, paint);
  }
  mesh.quad({-kHalfLength, -kHalfWidth, 3.0}, {kHalfLength, -kHalfWidth, 3.0},
            {kHalfLength, kHalfWidth, 3.0}, {-kHalfLength, kHalfWidth, 3.0}, paint);
  mesh.quad({-kHalfLength, -kHalfWidth, 0.35}, {kHalfLength, -kHalfWidth, 0.35},
            {kHalfLength, kHalfWidth, 0.35}, {-kHalfLength, kHalfWidth, 0.35}, Surface::kCarTrim);
  for (int row = 0; row < 9; ++row) {
    const double x = -4.9 + 1.05 * row;
    for (const double y : {-0.75, 0.75}) {
      mesh.box({}, {x, y - 0.42, 0.4}, {x + 0.14, y + 0.42, 1.5}, Surface::kCarTrim);
    }
  }
  const CarShape wheels{{}, {}, 0, 0.48, 3.2, -2.9, true};
  add_wheels(mesh, wheels, kHalfWidth);
  return mesh;
}

}  // namespace

void add_vehicle_prototypes(Prototypes& prototypes) {
  static constexpr Surface kPaints[] = {Surface::kPaintLight, Surface::kPaintMid,
                                        Surface::kPaintDark};
  auto& meshes = prototypes.meshes;
  prototypes.cars = {static_cast<std::uint32_t>(meshes.size()), 9};
  for (const CarShape& shape : {saloon(), hatchback(), off_roader()}) {
    for (const Surface paint : kPaints) meshes.push_back(make_car(shape, paint));
  }
  prototypes.vans = {static_cast<std::uint32_t>(meshes.size()), 2};
  meshes.push_back(make_car(van(), Surface::kPaintLight));
  meshes.push_back(make_car(van(), Surface::kPaintMid));
  prototypes.buses = {static_cast<std::uint32_t>(meshes.size()), 1};
  meshes.push_back(make_bus());
}

}  // namespace unimapper::simulator
