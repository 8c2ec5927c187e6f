/* LiDAR odometry for C: scans in, poses of the sensor out, in one block of memory.
 *
 * For robots that have no odometry of their own: its poses are what um_add_scan of unimapper.h
 * takes. Order of use: um_odometry_config_init, um_odometry_required_bytes, um_odometry_init, then
 * um_odometry_add_scan for every scan. Memory, threads, errors, frames and versions as in
 * unimapper.h. docs/odometry.md says what it can do and what it cannot.
 */
#ifndef UNIMAPPER_ODOMETRY_H
#define UNIMAPPER_ODOMETRY_H

#include "unimapper.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Parameters; um_odometry_config_init sets the defaults. */
typedef struct um_odometry_config {
  uint32_t max_voxels; /**< room of the local map, in voxels */
  uint32_t max_points; /**< room for the points of one thinned scan */
  double min_range_m;  /**< points nearer are left out: the robot itself */
  double max_range_m;  /**< points beyond are left out */
  double voxel_m;      /**< edge of the local map's voxels */
} um_odometry_config;

/** What is known about a pose. */
enum um_odometry_state {
  UM_ODOMETRY_STARTING = 0,   /**< too few scans for a velocity */
  UM_ODOMETRY_TRACKING = 1,   /**< the scan determines all axes */
  UM_ODOMETRY_DEGENERATE = 2, /**< along the weak axes the pose is predicted, not measured */
  UM_ODOMETRY_LOST = 3        /**< the scan does not fit the local map: the pose is predicted */
};

/** What a scan showed. */
typedef struct um_odometry_result {
  int32_t state; /**< one of enum um_odometry_state */
  /** At the scan's stamp. The first accepted scan's is the identity, or levelled by accelerations.
   */
  um_pose T_odometry_sensor;
  double velocity_m_s[3];           /**< in the sensor's frame */
  double angular_velocity_rad_s[3]; /**< in the sensor's frame */
  /** Of the motion since the scan before, row by row: translation along the odometry's axes (square
   *  metres), then the rotation vector in the sensor's frame (square radians). Sums over scans are
   *  those of longer motions. */
  double covariance[36];
  /** Directions that the scan does not determine, in the sensor's frame: x, y, z of a translation,
   *  then of a rotation; one of the two is zero. */
  double weak_axes[6][6];
  uint32_t weak_axis_count; /**< rows of weak_axes in use */
  uint32_t reserved;        /**< 0 */
  const char* reason;       /**< why the state is not tracking; static text, never null */
} um_odometry_result;

/** Opaque; lives at the start of the block given to um_odometry_init. */
typedef struct um_odometry um_odometry;

/** Sets every parameter to its default. */
UM_API UM_CHECKED um_status um_odometry_config_init(um_odometry_config* config);

/** Exactly the bytes um_odometry_init needs; 0 if the configuration is refused. */
UM_API size_t um_odometry_required_bytes(const um_odometry_config* config);

/** Makes an odometry in `memory` (64-byte aligned, at least um_odometry_required_bytes), which
 *  stays the caller's and must not be touched or moved while it is used. On success *odometry is
 *  the handle; otherwise it is null, and *message (may be null) says why in one sentence. */
UM_API UM_CHECKED um_status um_odometry_init(const um_odometry_config* config, void* memory,
                                             size_t bytes, um_odometry** odometry,
                                             const char** message);

/** Takes what the gyroscope of an IMU measured about the sensor's axes, rad/s, by the clock of the
 *  scans. Optional: rotations are predicted by it then, and sweeps compensated. Tell it of all up
 * to a scan's last point before that scan. UM_INVALID_POSE (not finite, or of 34 rad/s or more),
 *  UM_TIME_REVERSED: nothing has changed. */
UM_API UM_CHECKED um_status um_odometry_add_angular_velocity(um_odometry* odometry,
                                                             int64_t stamp_ns,
                                                             const double rad_s[3]);

/** Takes what the accelerometer of an IMU measured along the sensor's axes, at rest 9.81 m/s² along
 *  up, told as above. Optional: the first scan's pose is levelled by it, and a drift of roll and
 *  pitch is taken back. UM_INVALID_POSE (not finite, or of 200 m/s² or more), UM_TIME_REVERSED:
 *  nothing has changed. */
UM_API UM_CHECKED um_status um_odometry_add_acceleration(um_odometry* odometry, int64_t stamp_ns,
                                                         const double m_s2[3]);

/** Up in the odometry frame at the last scan, a unit vector, and its standard deviation in one
 *  direction; infinite where it is not known. */
UM_API UM_CHECKED um_status um_odometry_up(const um_odometry* odometry, double up[3],
                                           double* sigma_rad);

/** Registers a scan. `time_s` (may be null: the scan is motion-compensated) has for every point the
 *  seconds after the stamp at which it was measured; they may be negative.
 *
 *  UM_TIME_REVERSED, UM_EMPTY_SCAN: nothing has changed, and *result holds the scan before.
 *  Cost: proportional to the points (docs/odometry.md). */
UM_API UM_CHECKED um_status um_odometry_add_scan(um_odometry* odometry, const um_points* points,
                                                 const float* time_s, int64_t stamp_ns,
                                                 um_odometry_result* result);

/** What um_add_slip takes with the scan of a result of um_odometry_add_scan: the covariance along
 *  weak axes of translation alone, and along all where the odometry is lost; else zero. Without it
 *  the base takes the pose along them for as good as others. */
UM_API UM_CHECKED um_status um_odometry_slip(const um_odometry_result* result,
                                             double covariance[9]);

#ifdef __cplusplus
}
#endif

#endif
