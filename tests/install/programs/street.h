/* A street of boxes and a spinning LiDAR in it, for the C and the C++ program. */
#ifndef STREET_H
#define STREET_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

enum { kBoxes = 60, kRows = 32, kColumns = 720, kPoints = kRows * kColumns, kScans = 180 };

typedef struct {
  double low[3];
  double high[3];
} Box;

typedef struct {
  Box boxes[kBoxes];
  float points[kPoints][3]; /* of one scan, sensor frame; NaN where nothing was hit */
} Street;

/* Between 0 and 1, the same on every machine. */
static double street_random(uint64_t* state) {
  *state = *state * 6364136223846793005ULL + 1442695040888963407ULL;
  return (double)(*state >> 11) * (1.0 / 9007199254740992.0);
}

/* Houses, walls and posts beside a road along x. */
static void street_build(Street* street) {
  uint64_t state = 7;
  int i;
  for (i = 0; i < kBoxes; ++i) {
    Box* box = &street->boxes[i];
    const double x = -30.0 + 160.0 * street_random(&state);
    const double side = street_random(&state) < 0.5 ? -1.0 : 1.0;
    const double y = side * (6.0 + 22.0 * street_random(&state));
    const int post = i % 3 == 0;
    const double half_x = post ? 0.2 : 1.0 + 4.0 * street_random(&state);
    const double half_y = post ? 0.2 : 0.5 + 2.5 * street_random(&state);
    const double clear = side * y - half_y < 5.0 ? 5.0 - (side * y - half_y) : 0.0;
    box->low[0] = x - half_x;
    box->high[0] = x + half_x;
    box->low[1] = y + side * clear - half_y;
    box->high[1] = y + side * clear + half_y;
    box->low[2] = 0.0;
    box->high[2] = 2.0 + 6.0 * street_random(&state);
  }
}

/* Distance along a ray from `from` to the ground or the nearest box; infinite if there is none. */
static double street_distance(const Street* street, const double from[3], const double ray[3]) {
  double nearest = ray[2] < 0.0 ? -from[2] / ray[2] : INFINITY;
  int i;
  for (i = 0; i < kBoxes; ++i) {
    double enter = 0.0;
    double leave = nearest;
    int axis;
    for (axis = 0; axis < 3; ++axis) {
      const double a = (street->boxes[i].low[axis] - from[axis]) / ray[axis];
      const double b = (street->boxes[i].high[axis] - from[axis]) / ray[axis];
      enter = fmax(enter, fmin(a, b));
      leave = fmin(leave, fmax(a, b));
    }
    if (enter < leave) nearest = enter;
  }
  return nearest;
}

/* Where the sensor is at a scan: half a metre on with each, `offset` metres beside the road. */
static void street_sensor(int scan, double offset, double position[3]) {
  position[0] = 0.5 * scan;
  position[1] = offset;
  position[2] = 1.8;
}

/* Fills `points` with what the sensor sees there, looking along the road. */
static void street_scan(Street* street, int scan, double offset) {
  double from[3];
  int row;
  int column;
  street_sensor(scan, offset, from);
  for (row = 0; row < kRows; ++row) {
    for (column = 0; column < kColumns; ++column) {
      const double elevation = -0.2617 + 0.5234 * row / (double)(kRows - 1);
      const double azimuth = 6.283185307179586 * (column + 0.25) / (double)kColumns;
      const double ray[3] = {cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth),
                             sin(elevation) + 1e-9};
      const double distance = street_distance(street, from, ray);
      float* const point = street->points[row * kColumns + column];
      int axis;
      for (axis = 0; axis < 3; ++axis) {
        point[axis] = distance < 60.0 ? (float)(distance * ray[axis]) : NAN;
      }
    }
  }
}

/* The odometry of the second robot starts elsewhere, with another heading: T_odometry_world. */
static const double kSecondYaw = 0.7;
static const double kSecondTranslation[3] = {40.0, -15.0, 3.0};
static const double kSecondOffset = 1.0; /* metres beside the first robot's path */

#endif /* STREET_H */
