/* Uni-Mapper for C: scans and odometry poses in, static keyframes out, in one block of memory.
 *
 * Order of use: um_config_init, um_required_bytes, um_init, then um_add_scan for every scan and,
 * whenever it says so, um_keyframe_get and um_labels. docs/examples/first_keyframe.c is complete.
 *
 * Memory    The library allocates nothing and keeps no globals. A pipeline lives in the caller's
 *           block; it is done with as soon as the block is no longer used, there is nothing to
 *           close. Two pipelines share nothing.
 * Threads   Calls on one pipeline must not overlap in time; different pipelines are independent.
 *           Functions without a pipeline may be called from any thread. After um_init nothing
 *           locks, sleeps or calls the operating system. The library starts no thread; who has a
 *           second core for it hands in a um_executor.
 * Errors    Every call that can fail returns a um_status. um_status_text gives one sentence per
 *           status, um_message the exact error of the last call on a pipeline. Both, and the
 *           messages of um_init, um_config_check and um_config_from_model, are constants of the
 *           library; only a message of um_config_set is stored in the um_config and overwritten by
 *           the next call on it. A refused call changes nothing unless it says so.
 * Frames    sensor: the LiDAR at one scan. odometry: the robot's own world, z up. keyframe:
 *           gravity-levelled at the reference scan's sensor position, z up, x along the sensor's
 *           heading. T_a_b takes coordinates in b to coordinates in a. Metres, nanoseconds.
 * Versions  Header and library are of one version: before 1.0 the library's soname names major and
 *           minor. Compare UM_VERSION with um_version() where the library is loaded at run time.
 */
#ifndef UNIMAPPER_H
#define UNIMAPPER_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define UM_API __attribute__((visibility("default")))
/** A status must be looked at: GCC and Clang warn where it is ignored. */
#define UM_CHECKED __attribute__((warn_unused_result))
#else
#define UM_API
#define UM_CHECKED
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version -------------------------------------------------------------------------------- */

#define UM_VERSION_MAJOR 0
#define UM_VERSION_MINOR 1
#define UM_VERSION_PATCH 0
/** One number that grows with the version. */
#define UM_VERSION (UM_VERSION_MAJOR * 1000000 + UM_VERSION_MINOR * 1000 + UM_VERSION_PATCH)

/** UM_VERSION of the library that is linked, which need not be that of the header. */
UM_API uint32_t um_version(void);
/** Version of the library that is linked as text, e.g. "0.1.0". */
UM_API const char* um_version_text(void);

/* ---- Status --------------------------------------------------------------------------------- */

/** What a call has to say: one of enum um_status_code. */
typedef int32_t um_status;

enum um_status_code {
  UM_OK = 0,
  UM_INVALID_CONFIG = 1,     /**< a member of the configuration is out of its range */
  UM_MEMORY_TOO_SMALL = 2,   /**< less than um_required_bytes(config) */
  UM_MEMORY_MISALIGNED = 3,  /**< the block does not start on a 64-byte boundary */
  UM_INVALID_POSE = 4,       /**< NaN, infinite, or its rotation is none */
  UM_TIME_REVERSED = 5,      /**< the stamp is not later than the one before */
  UM_EMPTY_SCAN = 6,         /**< no point is finite and in range */
  UM_POSE_JUMP = 7,          /**< the pose moved farther than configured */
  UM_CAPACITY_EXCEEDED = 8,  /**< a fixed-capacity container is full */
  UM_INVALID_KEYFRAME = 9,   /**< what was handed over is no keyframe */
  UM_BUFFER_TOO_SMALL = 10,  /**< the result needs more bytes than the buffer has */
  UM_TIME_JUMP = 11,         /**< the stamp lies far ahead, or the clock was set back */
  UM_NULL_ARGUMENT = 100,    /**< a pointer that is needed is null */
  UM_INVALID_HANDLE = 101,   /**< not a pipeline made by um_init, or its block was overwritten */
  UM_INVALID_POINTS = 102,   /**< the view of the points cannot be right */
  UM_NO_KEYFRAME = 103,      /**< the last call closed no keyframe */
  UM_INVALID_INDEX = 104,    /**< no such scan in the keyframe */
  UM_UNKNOWN_SENSOR = 105,   /**< no such sensor */
  UM_UNKNOWN_COMPUTER = 106, /**< no such class of computer */
  UM_NO_EVENT = 107,         /**< the event ring is empty, or there is none */
  UM_UNKNOWN_PARAMETER = 108 /**< no parameter has this name */
};

/** One sentence for a status; never null. */
UM_API const char* um_status_text(um_status status);

/* ---- Sensors and configuration -------------------------------------------------------------- */

/** The LiDARs with a preset. */
enum um_sensor {
  UM_SENSOR_GENERIC = 0,
  UM_SENSOR_HDL_64E = 1,
  UM_SENSOR_VLP_16 = 2,
  UM_SENSOR_OS1_64 = 3,
  UM_SENSOR_OS2_128 = 4,
  UM_SENSOR_AEVA_AERIES_2 = 5,
  UM_SENSOR_LIVOX_AVIA = 6,
  UM_SENSOR_LIVOX_MID_360 = 7
};

/** Finds a sensor by name; case, spaces, dashes and the maker's name do not matter ("OS2-128",
 *  "ouster os2 128"). UM_UNKNOWN_SENSOR leaves *sensor alone. */
UM_API UM_CHECKED um_status um_sensor_find(const char* name, uint32_t* sensor);

/** What the pipeline is to run on; decides capacities and range, never thresholds. */
enum um_computer {
  UM_COMPUTER_SERVER = 0,          /**< gigabytes to spare */
  UM_COMPUTER_JETSON = 1,          /**< Jetson-class ARM64: at most 192 MB */
  UM_COMPUTER_RASPBERRY_PI = 2,    /**< Raspberry-Pi-class ARMv8: at most 64 MB */
  UM_COMPUTER_ARMV7_WITH_64_MB = 3 /**< ARMv7 with NEON: at most 64 MB */
};

/** Part `part` of `task`. No part reads what another one writes. `worker`, below
 *  um_executor.workers, names scratch memory: parts that run at the same time must get different
 *  ones. */
typedef void (*um_part)(void* task, uint32_t part, uint32_t worker);

/** Largest um_executor.workers. */
#define UM_MAX_WORKERS 8

/** Runs parts of what closes a keyframe, several at once where there are cores for them. The
 *  results are the same to the bit with any number of workers. docs/porting.md has two examples. */
typedef struct um_executor {
  /** Calls part(task, i, worker) once for each i below `parts`, and returns when all calls have
   *  returned. They must see what the calling thread wrote before, and it must see what they wrote.
   *  Called from any call on the pipeline but labels and keyframes that are read: `context` has to
   *  outlive the pipeline. Null = the calling thread does all in order. */
  void (*run)(void* context, uint32_t parts, um_part part, void* task);
  void* context;    /**< handed to `run` */
  uint32_t workers; /**< at most so many parts at once, [1, UM_MAX_WORKERS]; 1 without `run`. Each
                         has scratch memory in the pipeline's block. */
} um_executor;

/** The configuration of a pipeline. um_config_init fills it in; change the members here, and all
 *  other parameters by um_config_set. docs/parameters.md lists every parameter with its unit, range
 *  and meaning. The struct may be copied. */
typedef struct um_config {
  /** Room for so many events (see um_event_pop), which lies in the pipeline's block: a power of
   *  two up to 2^20; 0 = off. */
  uint32_t event_capacity;
  /** Monotonic clock in nanoseconds for stage times and budget, called from um_add_scan and
   *  um_flush; null = no times are taken. */
  int64_t (*clock_ns)(void);
  /** All other parameters, and the sentence of the last refused um_config_set. */
  uint64_t hidden[128];
  uint32_t keyframe_scans;               /**< keyframe.scans */
  float keyframe_range_min_m;            /**< keyframe.range_min_m */
  float keyframe_range_max_m;            /**< keyframe.range_max_m */
  uint32_t keyframe_max_points_per_scan; /**< keyframe.max_points_per_scan */
  uint32_t voxel_max_cells;              /**< voxel.max_cells */
  uint32_t loop_search_max_places;       /**< loop_search.max_places */
  float loop_search_accept_confidence;   /**< loop_search.accept_confidence */
  /** budget_us: longest that a call may take. With the parameter `deferred` what does not fit is
   * done later. A call that takes longer all the same is counted. Needs clock_ns; 0 = off. */
  uint32_t budget_us;
  um_executor executor; /**< who runs parts at the same time; run = null: nobody */
} um_config;

/** Fills in the recommended parameters for a sensor (enum um_sensor). */
UM_API UM_CHECKED um_status um_config_init(um_config* config, uint32_t sensor);

/** Fills in the recommended parameters for a sensor with the capacities a smaller computer has
 *  room for (enum um_computer). */
UM_API UM_CHECKED um_status um_config_init_for(um_config* config, uint32_t sensor,
                                               uint32_t computer);

/** How a sensor scans. */
enum um_scan_pattern { UM_SCAN_SPINNING = 0, UM_SCAN_RASTER = 1, UM_SCAN_NON_REPETITIVE = 2 };

/** Data-sheet figures of a LiDAR that enum um_sensor does not know. Fill in every member. 0 is a
 *  valid figure only for pattern (spinning), the elevations, range_min_m, and rings of a pattern
 *  that is not spinning; elsewhere it is refused. */
typedef struct um_sensor_model {
  uint32_t pattern;         /**< one of enum um_scan_pattern */
  float horizontal_fov_deg; /**< full width about the x axis, [10, 360] */
  float elevation_min_deg;  /**< lowest ray, at least 1 degree below the highest, [-90, 90] */
  float elevation_max_deg;  /**< highest ray */
  float range_min_m;        /**< [0, 500], below range_max_m */
  float range_max_m;        /**< largest range, at most 500 */
  uint32_t rings;           /**< scan lines, [2, 1024]; needed where pattern is UM_SCAN_SPINNING */
  uint32_t points_per_scan; /**< rays per scan at scan_rate_hz, [100, 3300000] */
  float scan_rate_hz;       /**< (0, 200] */
} um_sensor_model;

/** Fills in the recommended parameters for a LiDAR from its data sheet and a computer (enum
 *  um_computer). UM_INVALID_CONFIG: a figure cannot be right, and *message (may be null) says which
 *  and why in one sentence; nothing is written then. */
UM_API UM_CHECKED um_status um_config_from_model(um_config* config, const um_sensor_model* model,
                                                 uint32_t computer, const char** message);

/** Whether a configuration has room for what a sensor may see. Cells that do not fit are those of
 *  the last scans, near ones too: their points are labelled static without having been looked at
 *  (UM_DROP_CELLS_FULL), so a shorter range is better than cells that are full. */
typedef struct um_sensor_fit {
  uint32_t fits;         /**< 1 if there is room for all cells needed */
  uint32_t cells_needed; /**< fine cells that a keyframe may occupy in a dense street */
  uint32_t cells;        /**< fine cells that there is room for: voxel_max_cells */
  float range_m;         /**< keyframe_range_max_m with which they fit, metres */
} um_sensor_fit;

/** An estimate from the data sheet of a sensor (enum um_sensor), before the first scan, for
 *  outdoors; docs/porting.md compares it with recordings. Statuses are those of um_config_check and
 *  UM_UNKNOWN_SENSOR; nothing is written then. */
UM_API UM_CHECKED um_status um_sensor_fit_get(const um_config* config, uint32_t sensor,
                                              um_sensor_fit* fit);

/** As um_sensor_fit_get, for a LiDAR from its data sheet. On UM_INVALID_CONFIG *message (may be
 *  null) says which figure of the sheet or member of the configuration is wrong. */
UM_API UM_CHECKED um_status um_sensor_fit_from_model(const um_config* config,
                                                     const um_sensor_model* model,
                                                     um_sensor_fit* fit, const char** message);

/** Sets a parameter by its name in docs/parameters.md, e.g. "removal.window" to "10". Switches take
 *  true, false, 1 and 0, choices one of their names. Members of um_config may be set this way too.
 *
 *  UM_UNKNOWN_PARAMETER, UM_INVALID_CONFIG (no such value, or out of range): nothing has changed,
 *  and *message (may be null) says why, with the nearest name that there is; it lies in *config and
 *  is valid until the next um_config_set on it. Whether parameters fit each other is checked by
 *  um_config_check and um_init. */
UM_API UM_CHECKED um_status um_config_set(um_config* config, const char* name, const char* value,
                                          const char** message);

/** Writes a parameter's value as um_config_set reads it, ended by zero; UM_CAPACITY_EXCEEDED if
 *  `capacity` bytes are too few (32 are enough). */
UM_API UM_CHECKED um_status um_config_get(const um_config* config, const char* name, char* value,
                                          size_t capacity);

/** Whether um_init will accept a configuration. If not, *message (may be null) says in one
 *  sentence which member is wrong and what it must be; if so, it is "". */
UM_API UM_CHECKED um_status um_config_check(const um_config* config, const char** message);

/* ---- A pipeline in the caller's memory ------------------------------------------------------ */

/** Opaque; lives at the start of the block given to um_init. */
typedef struct um_pipeline um_pipeline;

/** Alignment of the block. */
#define UM_ALIGNMENT 64

/** Exactly the bytes um_init needs; 0 if the configuration is refused (see um_config_check).
 *  Cost: microseconds. */
UM_API size_t um_required_bytes(const um_config* config);

/** Makes a pipeline in `memory` (64-byte aligned, at least um_required_bytes), which stays the
 *  caller's and must not be touched or moved while the pipeline is used. The configuration is
 *  copied. On success *pipeline is the handle; otherwise it is null, and *message (may be null)
 *  says why in one sentence. Writes every byte of the block once, which also faults its pages in.
 */
UM_API UM_CHECKED um_status um_init(const um_config* config, void* memory, size_t bytes,
                                    um_pipeline** pipeline, const char** message);

/** Starts anew in the same memory with the same configuration: the same input gives the same
 *  results again. Stored places are forgotten, scan and keyframe numbers start from 0. Costs as
 *  much as um_init: not for the control loop. */
UM_API UM_CHECKED um_status um_reset(um_pipeline* pipeline);

/** What exactly the last call on this pipeline had to say; "" if all was well. Never null. */
UM_API const char* um_message(const um_pipeline* pipeline);

/* ---- Scans in ------------------------------------------------------------------------------- */

/** Points as they lie in the driver's memory; nothing is copied. Coordinates are float32 in the
 *  machine's byte order (little endian on all supported ones), sensor frame, metres, motion
 *  compensated. They need no alignment. NaN and infinite points are skipped and counted. */
typedef struct um_points {
  const void* data; /**< the first point; needed only during the call */
  size_t count;     /**< points */
  size_t stride;    /**< bytes from one point to the next, at least 4 */
  size_t offset_x;  /**< bytes from the start of a point to its x */
  size_t offset_y;  /**< bytes from the start of a point to its y */
  size_t offset_z;  /**< bytes from the start of a point to its z */
} um_points;

/** A rigid transform as the upper three rows of its matrix, row by row: r00 r01 r02 tx r10 ... */
typedef struct um_pose {
  double m[12]; /**< row by row, translation in metres */
} um_pose;

/** A pose from a quaternion (x, y, z, w; need not be normalised) and a translation in metres.
 *  UM_INVALID_POSE if the quaternion is zero or anything is not finite. */
UM_API UM_CHECKED um_status um_pose_from_quaternion(const double xyzw[4],
                                                    const double translation[3], um_pose* pose);

/** Adds one scan with its pose in the odometry world and its time.
 *
 *  *keyframe_ready (may be null) becomes 1 if a keyframe became ready, else 0. Refused scans
 *  (UM_INVALID_POSE, UM_TIME_REVERSED, UM_EMPTY_SCAN, UM_POSE_JUMP, UM_TIME_JUMP) get no labels but
 *  take a scan index. A jump also closes the keyframe that was open: look at both answers. If the
 *  scan after it agrees with a jump of the pose, the odometry was restarted and mapping goes on
 *  there with the evidence of earlier keyframes forgotten; a jump of the clock forgets nothing. A
 *  clock that is set ahead by more than a minute costs one scan, one that is set back two.
 *  UM_INVALID_POINTS, UM_NULL_ARGUMENT: nothing has happened.
 *
 *  Cost: proportional to the points; the call that closes a keyframe also does its processing, see
 *  budget_us and, for calls that cost about the same, um_work. */
UM_API UM_CHECKED um_status um_add_scan(um_pipeline* pipeline, const um_points* points,
                                        const um_pose* T_odometry_sensor, int64_t stamp_ns,
                                        int32_t* keyframe_ready);

/** um_add_scan with the intensities of the points, one byte each, `stride` bytes apart, which lie
 *  in the order of the points and are needed only during the call; null: not known. With the
 *  parameter `intensity` (um_config_set) cells carry their mean; else they are not read.
 *  UM_INVALID_POINTS, too, for a stride with which they do not fit into memory. */
UM_API UM_CHECKED um_status um_add_scan_with_intensities(um_pipeline* pipeline,
                                                         const um_points* points,
                                                         const uint8_t* intensities, size_t stride,
                                                         const um_pose* T_odometry_sensor,
                                                         int64_t stamp_ns, int32_t* keyframe_ready);

/** Tells what the pose of the next scan is uncertain by, since that of the scan before, along axes
 *  that the odometry did not determine (um_odometry_slip): covariance of the translation along the
 *  odometry frame's axes, square metres, row by row. Keyframes carry it to the base, whose pose
 *  graph then gives way along these axes alone. Several calls add up. UM_INVALID_POSE, with nothing
 *  changed: it is no covariance. */
UM_API UM_CHECKED um_status um_add_slip(um_pipeline* pipeline, const double covariance[9]);

/** Closes a keyframe that has fewer scans than configured (end of a run) and finishes it.
 *  *keyframe_ready (may be null) is 0 if there was none. With the parameter `deferred` the keyframe
 *  before may have to be finished first: call until it is 0 and um_finished_get has none any more.
 */
UM_API UM_CHECKED um_status um_flush(um_pipeline* pipeline, int32_t* keyframe_ready);

/** With the parameter `deferred` (um_config_set), what closes a keyframe is done in slices by the
 *  calls that follow, and final labels, description and loop search after that: um_add_scan does
 * its share, scans wait meanwhile, and um_work does more for a program that has time before the
 * next scan. One slice, and as many more as begin within `budget_us` by clock_ns, until a keyframe
 * is ready, which um_keyframe_get then tells. *work_left (may be null) becomes 1 if a scan waits or
 * a keyframe is not finished yet. Whether and when it is called changes no result. */
UM_API UM_CHECKED um_status um_work(um_pipeline* pipeline, uint32_t budget_us, int32_t* work_left);

/* ---- Keyframes out -------------------------------------------------------------------------- */

/** One scan of a keyframe. */
typedef struct um_scan {
  uint32_t scan_index;       /**< running number of the um_add_scan call, from 0 */
  uint32_t reserved;         /**< 0 */
  int64_t stamp_ns;          /**< as handed to um_add_scan */
  um_pose T_odometry_sensor; /**< sensor frame to odometry frame */
} um_scan;

/** One occupied fine cell: the mean of its points, keyframe frame, metres. */
typedef struct um_cell {
  float position[3]; /**< mean of its points */
  uint16_t points;   /**< scan points in the cell, saturating */
  uint8_t ground;    /**< 1 if it belongs to the ground */
  uint8_t intensity; /**< mean of its points, from 1; 0: not known */
} um_cell;

/** A repeatable spot of the static scene, keyframe frame. */
typedef struct um_keypoint {
  float position[3];    /**< metres */
  float normal[3];      /**< unit length */
  uint64_t occupancy;   /**< which heights of its column are occupied, one bit a slice */
  uint16_t strength;    /**< larger is stronger */
  uint16_t reserved[3]; /**< 0 */
} um_keypoint;

/** One planar coarse voxel, keyframe frame. */
typedef struct um_plane {
  float center[3]; /**< metres */
  float normal[3]; /**< unit length, towards the sensor's origin */
} um_plane;

/** A possible revisit of an earlier keyframe. */
typedef struct um_loop {
  uint32_t session;      /**< 0: the pipeline's own run */
  uint32_t keyframe;     /**< sequence of the keyframe it looks like */
  float confidence;      /**< [0, 1], rises with the evidence */
  uint32_t accepted;     /**< 1 if it passed the configured thresholds */
  uint32_t votes;        /**< of triangles that agree on the pose, weighted by their normals */
  uint32_t inliers;      /**< keypoints that agree with the pose */
  float plane_overlap;   /**< share of commonly visible planes that coincide */
  uint32_t reserved;     /**< 0 */
  um_pose T_match_query; /**< from this keyframe's frame to that one's */
} um_loop;

/** Why something was left out; indices of um_statistics.dropped. */
enum um_drop_cause {
  UM_DROP_NOT_FINITE = 0,         /**< points with NaN or infinite coordinates */
  UM_DROP_OUT_OF_RANGE = 1,       /**< points nearer or farther than configured */
  UM_DROP_SCAN_TOO_LARGE = 2,     /**< points beyond keyframe.max_points_per_scan */
  UM_DROP_CELLS_FULL = 3,         /**< points that found no room among the cells or blocks */
  UM_DROP_VOXELS_FULL = 4,        /**< fine cells that found no room among the coarse voxels */
  UM_DROP_EVIDENCE_FULL = 5,      /**< columns, and blocks to be relabelled, that found no room */
  UM_DROP_DESCRIPTION_FULL = 6,   /**< cells, voxels or keypoints the describer refused */
  UM_DROP_TRIANGLE_TABLE_FULL = 7 /**< triangles loop search refused */
};

/** The timed parts; indices of um_statistics.stage_us. */
enum um_stage {
  UM_STAGE_INGEST = 0,      /**< all scans into fine cells and range images */
  UM_STAGE_REMOVAL = 1,     /**< voxels, ground, free space, static / dynamic */
  UM_STAGE_DESCRIPTION = 2, /**< keypoints and planes */
  UM_STAGE_SEARCH = 3,      /**< loop search and insertion */
  UM_STAGE_TOTAL = 4        /**< everything spent inside um_add_scan, um_flush and um_work */
};

/** The containers whose fill is reported; indices of um_statistics.capacity. */
enum um_capacity_kind {
  UM_CAPACITY_POINTS_PER_SCAN = 0,
  UM_CAPACITY_CELLS = 1,
  UM_CAPACITY_VOXELS = 2,
  UM_CAPACITY_BLOCKS = 3,
  UM_CAPACITY_PLACES = 4
};

/** Names for log files, e.g. "out_of_range"; null for a number that stands for nothing. */
UM_API const char* um_drop_cause_name(uint32_t cause);
UM_API const char* um_stage_name(uint32_t stage);
UM_API const char* um_capacity_name(uint32_t capacity);

/** Fill of a fixed-capacity container. */
typedef struct um_capacity {
  uint64_t used;     /**< elements in use */
  uint64_t capacity; /**< elements there is room for */
} um_capacity;

/** Counts and times of one keyframe. Array elements without a meaning yet are 0. */
typedef struct um_statistics {
  uint64_t points_in;       /**< points handed over in its scans */
  uint64_t points_valid;    /**< finite and within range */
  uint64_t points_static;   /**< labelled static */
  uint64_t points_dynamic;  /**< labelled dynamic */
  uint32_t cells;           /**< occupied fine cells */
  uint32_t dynamic_cells;   /**< occupied fine cells labelled dynamic */
  uint32_t voxels;          /**< occupied coarse voxels */
  uint32_t ground_voxels;   /**< occupied coarse voxels with a ground plane */
  uint32_t components;      /**< connected obstacles that may have moved */
  uint32_t deadline_missed; /**< 1 if it took longer than budget_us */
  uint64_t dropped[16];     /**< by enum um_drop_cause */
  um_capacity capacity[16]; /**< by enum um_capacity_kind */
  float stage_us[16];       /**< by enum um_stage, microseconds; 0 without a clock */
  float attitude_noise_deg; /**< as in um_input */
  uint32_t reserved;        /**< 0 */
} um_statistics;

/** What the scans tell of the sensor and of the poses that came with them; docs/limits.md says what
 *  follows for the map. */
typedef struct um_input {
  float ray_spacing_deg; /**< between two rays of a ring; 0 = not known, or not a spinning sensor */
  float ring_spacing_deg;        /**< from ring to ring; 0 = not known */
  float image_elevation_min_deg; /**< field of view of the free-space images */
  float image_elevation_max_deg; /**< field of view of the free-space images */
  uint32_t rays_differ;          /**< 1: the spacing is not as configured, and was used instead */
  uint32_t elevations_differ;    /**< 1: rays left the configured field of view, by more than the
                                    sensor turned in a sweep */
  uint32_t mode_changes;         /**< how often the sensor has changed its mode since the start */
  float attitude_noise_deg;      /**< scatter of the scans' roll and pitch against the ground of the
                                    scans before; 0: not clearly more than the measurement's error,
                                    or too little ground is seen */
  float sweep_tilt_deg;    /**< scatter of roll and pitch where it follows the sensor's rotation, as
                              with sweeps that are not motion-compensated; else 0 */
  uint32_t aligned_scans;  /**< scans of the keyframe that were aligned to the ground for it */
  uint32_t up_known;       /**< as in um_keyframe */
  float odometry_tilt_deg; /**< between up and the odometry's z axis; 0 where up is unknown */
  float up_sigma_deg;      /**< standard deviation of up about its less certain axis; 0 where up is
                              unknown */
} um_input;

/** A keyframe. Pointers lead into the pipeline's memory and stay valid until the next call of
 *  um_add_scan, um_flush, um_work or um_reset. */
typedef struct um_keyframe {
  uint32_t sequence;            /**< running number, from 0 */
  uint32_t reference_scan;      /**< index into `scans`: the keyframe lies at this scan's sensor */
  uint32_t scan_count;          /**< at most 32 */
  um_pose T_odometry_keyframe;  /**< the levelled frame */
  um_statistics statistics;     /**< counts and times of this keyframe */
  const um_scan* scans;         /**< in order of time */
  const um_cell* static_cells;  /**< the map's contribution */
  size_t static_cell_count;     /**< length of `static_cells` */
  const um_cell* dynamic_cells; /**< what was removed */
  size_t dynamic_cell_count;    /**< length of `dynamic_cells` */
  const um_keypoint* keypoints; /**< with `planes`: the description of the place */
  size_t keypoint_count;        /**< length of `keypoints` */
  const um_plane* planes;       /**< planar voxels */
  size_t plane_count;           /**< length of `planes` */
  const um_loop* loops;         /**< best first; look at `accepted` */
  size_t loop_count;            /**< length of `loops` */
  /** 1: the frame's z axis points up with the covariance below; 0: it is the odometry's z axis,
   *  and nothing tells how level that is. */
  uint32_t up_known;
  uint32_t up_contradicted; /**< 1: up is not where odometry.up_sigma_deg says, by three sigma */
  float up_covariance[3];   /**< of up's x and y in the keyframe's frame, rad^2: xx, xy, yy */
  float odometry_tilt_deg;  /**< between up and the odometry's z axis; 0 where up is unknown */
  um_input input;           /**< what the scans tell of sensor and poses */
  /** 1: the robot stands and sees nothing new; the keyframe repeats the one of `sequence`. It has
   *  labels, cells and counts, but no place and no images, and is never finished: it is not to be
   *  sent. */
  uint32_t repeats;
  uint32_t reserved; /**< 0 */
} um_keyframe;

/** The keyframe that became ready in the last call of um_add_scan, um_flush or um_work.
 *  UM_NO_KEYFRAME if none did. Cost: about a kilobyte copied. */
UM_API UM_CHECKED um_status um_keyframe_get(um_pipeline* pipeline, um_keyframe* keyframe);

/** The keyframe that the last call of um_add_scan, um_flush or um_work finished: with keypoints,
 *  planes, loops and all counts. It is the one that um_keyframe_get gives, unless the parameter
 *  `deferred` is set; then that one has none of these yet, and this is an earlier one, or after
 *  um_flush the same. UM_NO_KEYFRAME if that call finished none, as after one that repeats others.
 */
UM_API UM_CHECKED um_status um_finished_get(um_pipeline* pipeline, um_keyframe* keyframe);

/** Most scans, and free-space images, of a keyframe. */
#define UM_MAX_SCANS 32

/** Free-space images of a keyframe: how far single scans of it could see. Pixels lie row by row
 *  about the sensor's x axis; columns are even in azimuth, rows in the sine of the elevation. A
 *  pixel is the range up to which nothing was in the way, in 1/128 m; 0: unknown. */
typedef struct um_images {
  uint32_t count;                 /**< images; all have the same shape */
  uint32_t columns;               /**< of one image */
  uint32_t rows;                  /**< of one image */
  float horizontal_fov_deg;       /**< full width about the x axis */
  float azimuth_resolution_deg;   /**< width of a pixel */
  float elevation_min_deg;        /**< lower edge */
  float elevation_max_deg;        /**< upper edge */
  float elevation_resolution_deg; /**< height of a pixel */
  /** Farther out, what was seen through counts in proportion less, metres; 0: never. */
  float full_weight_range_m;
  uint32_t scans[UM_MAX_SCANS];         /**< of each image, index into the keyframe's scans */
  const uint16_t* pixels[UM_MAX_SCANS]; /**< of each image, valid as long as the keyframe */
} um_images;

/** The images of the keyframe that the last call closed. UM_NO_KEYFRAME if that call closed none.
 */
UM_API UM_CHECKED um_status um_images_get(um_pipeline* pipeline, um_images* images);

/** Labels of points. */
enum um_label {
  UM_LABEL_UNKNOWN = 0, /**< not finite, or out of range */
  UM_LABEL_STATIC = 1,
  UM_LABEL_DYNAMIC = 2
};

/** Labels (enum um_label) of the points of scan `scan` (index into keyframe.scans) of the keyframe
 *  that the last call closed, in input order. Writes at most `capacity` of them and tells in
 *  *written how many. Cost: proportional to the points. */
UM_API UM_CHECKED um_status um_labels(um_pipeline* pipeline, uint32_t scan, uint8_t* labels,
                                      size_t capacity, size_t* written);

/* ---- Keyframes as bytes --------------------------------------------------------------------- */

/** Who sends: one robot, one boot. */
typedef struct um_session {
  uint32_t robot;     /**< number of the robot */
  uint32_t reserved;  /**< 0 */
  uint64_t boot_high; /**< upper half of a random number of 128 bits, another one for every start */
  uint64_t boot_low;  /**< lower half */
} um_session;

/** What became of a keyframe that was encoded. */
typedef struct um_encoded {
  size_t bytes;       /**< it takes, also if the buffer is too small */
  size_t image_bytes; /**< bytes of free-space images */
  uint64_t left_out;  /**< cells and keypoints too far away for the message's grid (819 m) */
} um_encoded;

/** Bytes of scratch memory um_keyframe_encode needs with this pipeline; 0 for no pipeline. */
UM_API size_t um_encode_scratch_bytes(const um_pipeline* pipeline);

/** Writes the keyframe of um_finished_get to `buffer` as the bytes a base station reads
 *  (docs/wire-format.md), to be sent or stored by any means. `scratch` is 64-byte aligned, holds
 *  um_encode_scratch_bytes and is free for other use between calls. encoded->bytes tells how many
 *  bytes the keyframe takes; UM_BUFFER_TOO_SMALL if that is more than `capacity`: nothing in the
 *  buffer is valid then. With a capacity of 0 (buffer may be null) only the size is told, at the
 *  same cost. Nothing is allocated. Cost: proportional to cells and pixels, a few milliseconds at
 *  most. UM_NO_KEYFRAME if the last call finished none, as after a keyframe that repeats earlier
 *  ones: there is nothing to send. */
UM_API UM_CHECKED um_status um_keyframe_encode(um_pipeline* pipeline, const um_session* session,
                                               void* scratch, size_t scratch_bytes, void* buffer,
                                               size_t capacity, um_encoded* encoded);

/* ---- Places of earlier runs ----------------------------------------------------------------- */

/** The place descriptor of a keyframe of an earlier run, as um_keyframe told it then. */
typedef struct um_place {
  uint32_t session;             /**< number of the earlier run, from 1; 0 is the pipeline's own */
  uint32_t keyframe;            /**< its sequence in that run */
  um_pose T_odometry_keyframe;  /**< levelled keyframe frame to the odometry frame of that run */
  const um_keypoint* keypoints; /**< needed only during the call, as the planes */
  size_t keypoint_count;        /**< length of `keypoints` */
  const um_plane* planes;       /**< planar voxels */
  size_t plane_count;           /**< length of `planes` */
} um_place;

/** Lets loop search find a place of an earlier run: um_loop.session is its number. Beyond
 *  loop_search_max_places, the place that another one can stand in for makes room. UM_INVALID_INDEX
 * for session 0. Cost: that of the insertion of a keyframe. um_reset forgets these places too. A
 * place without keypoints is found by nothing. */
UM_API UM_CHECKED um_status um_place_insert(um_pipeline* pipeline, const um_place* place);

/** As um_place_insert, for a keyframe with up_known: `up_covariance` is that of um_keyframe. Loops
 *  to places inserted without it may be tilted by more. */
UM_API UM_CHECKED um_status um_place_insert_level(um_pipeline* pipeline, const um_place* place,
                                                  const float up_covariance[3]);

/* ---- Health --------------------------------------------------------------------------------- */

/** Totals since um_init or um_reset. Array elements without a meaning yet are 0. */
typedef struct um_health {
  uint64_t scans;             /**< handed over */
  uint64_t scans_refused;     /**< scans that were refused */
  uint64_t keyframes;         /**< finished */
  uint64_t points_in;         /**< in the scans of finished keyframes */
  uint64_t points_dynamic;    /**< points of finished keyframes labelled dynamic */
  uint64_t deadline_misses;   /**< keyframes that took longer than budget_us */
  uint64_t dropped[16];       /**< by enum um_drop_cause */
  um_capacity fullest[16];    /**< by enum um_capacity_kind: highest fill of any keyframe */
  float longest_stage_us[16]; /**< by enum um_stage; 0 without a clock */
} um_health;

/** How the pipeline has been doing. */
UM_API UM_CHECKED um_status um_health_get(um_pipeline* pipeline, um_health* health);

/* ---- Final labels --------------------------------------------------------------------------- */

/** Final labels of a keyframe that was evicted from the window; um_labels gives the online ones. */
typedef struct um_relabelled {
  uint32_t available;         /**< 1 if there is one; the rest is 0 otherwise */
  uint32_t sequence;          /**< of the keyframe */
  uint32_t later_keyframes;   /**< whose evidence was used */
  uint32_t cells_now_dynamic; /**< cells that were static online */
  uint32_t cells_now_static;  /**< cells that were dynamic online */
  uint32_t reserved[3];       /**< 0 */
} um_relabelled;

/** The keyframe that was evicted by the one of um_finished_get, or by um_relabel_next. */
UM_API UM_CHECKED um_status um_relabelled_get(um_pipeline* pipeline, um_relabelled* relabelled);

/** Replaces the online labels of a scan of that keyframe by the final ones. The caller kept them,
 *  and the scan: hand in the points and the pose that um_add_scan got. *changed (may be null) tells
 *  how many labels changed. Cost: proportional to the points. */
UM_API UM_CHECKED um_status um_relabel(um_pipeline* pipeline, const um_points* points,
                                       const um_pose* T_odometry_sensor, uint8_t* labels,
                                       size_t count, size_t* changed);

/** After the last scan and um_flush: relabels the oldest keyframe still in the window. *relabelled
 *  becomes 1, or 0 if there is none left; call until then. */
UM_API UM_CHECKED um_status um_relabel_next(um_pipeline* pipeline, int32_t* relabelled);

/* ---- Events --------------------------------------------------------------------------------- */

/** What an event tells; values[] in the order given. Numbers never change their meaning. */
enum um_event_id {
  UM_EVENT_KEYFRAME_CLOSED = 1, /**< sequence, scans, static cells, dynamic cells */
  UM_EVENT_SCAN_REFUSED = 2,    /**< um_status, scan index */
  UM_EVENT_POSE_JUMP = 3,       /**< scan index */
  UM_EVENT_DROPPED = 4,         /**< enum um_drop_cause, count, sequence of the keyframe */
  UM_EVENT_DEADLINE_MISSED = 6, /**< microseconds taken, budget, sequence of the keyframe */
  /** The scene contradicts odometry.up_sigma_deg: tilt of the odometry's z axis and the promised
   *  sigma in 1/1000 degree, sequence of the keyframe. */
  UM_EVENT_UP_CONTRADICTED = 7,
  UM_EVENT_SAMPLING_DIFFERS = 8,  /**< thousandths of a degree between rays of a ring, from ring to
                                       ring, as measured; the same as configured */
  UM_EVENT_ELEVATIONS_DIFFER = 9, /**< lowest and highest elevation of the range images, thousandths
                                       of a degree; the same as configured */
  UM_EVENT_ATTITUDE_NOISE =
      10, /**< thousandths of a degree, scans aligned, sequence of the keyframe */
  /** Sweeps begin to look as if they were not motion-compensated: thousandths of a degree by which
   *  scans tilt with the sensor's rotation, scans aligned, sequence of the keyframe. */
  UM_EVENT_SWEEPS_UNCOMPENSATED = 11,
  /** The scans begin to contradict the odometry: thousandths of the keyframe's cells that are
   *  dynamic, the same as usual, sequence of the keyframe. Both are 0 where the robot was shut in,
   *  as in a lift, and the odometry did not rise. */
  UM_EVENT_ODOMETRY_CONTRADICTED = 12,
  /** The scans begin to move as if the LiDAR were mounted otherwise than the poses say: which of
   *  roll, pitch, yaw, x, y, z (0 to 5), by how much, standard deviation (thousandths of a degree,
   *  or millimetres), sequence of the keyframe. */
  UM_EVENT_MOUNT_CONTRADICTED = 13,
  /** The poses are late (positive) or early against the scans: milliseconds, standard deviation,
   *  sequence of the keyframe. */
  UM_EVENT_CLOCK_CONTRADICTED = 14,
  /** The given motions are shorter (positive) or longer than the scans show: by how many
   *  thousandths, standard deviation, sequence of the keyframe. */
  UM_EVENT_SCALE_CONTRADICTED = 15,
  /** The scans move otherwise than the poses say: the number of the mistake that explains it
   *  (docs/design/plausibility.md; 0: none), length of the given motions in thousandths of what the
   *  scans show, sequence of the keyframe. */
  UM_EVENT_MOTION_CONTRADICTED = 16
};

/** One event. */
typedef struct um_event {
  uint32_t id;       /**< enum um_event_id; ignore numbers you do not know */
  uint32_t reserved; /**< 0 */
  int64_t stamp_ns;  /**< of the scan at hand */
  int64_t values[4]; /**< as the id defines them; unused ones are 0 */
} um_event;

/** Takes the oldest event; UM_NO_EVENT if there is none. May be called by one other thread than the
 *  pipeline's, at any time but during um_init and um_reset: neither ever waits for the other. */
UM_API UM_CHECKED um_status um_event_pop(um_pipeline* pipeline, um_event* event);

/** Events lost since um_init or um_reset because the ring was full; wraps at 2^32. Any thread. */
UM_API uint32_t um_events_lost(const um_pipeline* pipeline);

#ifdef __cplusplus
}
#endif

#endif /* UNIMAPPER_H */
