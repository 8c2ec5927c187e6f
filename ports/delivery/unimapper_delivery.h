/* Delivery of keyframes for C: over LCM to a base station, kept on the robot's disk until it has
 * them.
 *
 * Order of use: um_delivery_options_init, um_delivery_create, um_delivery_session (whose numbers go
 * to um_keyframe_encode), um_delivery_publish for every keyframe, um_delivery_finish,
 * um_delivery_destroy. docs/examples/deliver.c is complete; docs/wire-format.md says what is sent
 * again and when, docs/spool.md what the disk keeps.
 *
 * Memory    From the heap. Nothing of the caller's is kept but `report` and its context.
 * Threads   Sending and writing have threads of their own. um_delivery_publish and
 *           um_delivery_set_health are for one thread at a time; um_delivery_status_get and
 *           um_delivery_map_pose for any thread at any time, also during um_delivery_finish;
 *           nothing may run beside
 *           um_delivery_create and um_delivery_destroy. With queue_keyframes um_delivery_publish is
 *           for a thread with deadlines: no heap, no lock, a copy and at most one system call that
 *           wakes a thread. All other calls, and without a queue this one too, use the heap and
 *           take locks.
 * Errors    0, or a value of errno: EINVAL for what an argument cannot be, ENOMEM. No exception
 *           leaves the library.
 */
#ifndef UNIMAPPER_DELIVERY_H
#define UNIMAPPER_DELIVERY_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Beginning ------------------------------------------------------------------------------ */

/** Where keyframes go, and what that may take. Strings are copied. */
typedef struct um_delivery_options {
  uint32_t robot;     /**< number of the robot; 0 with a key: the key's */
  uint64_t boot_high; /**< upper half of this start's number; both 0: the kernel's random number */
  uint64_t boot_low;  /**< lower half; no other start of the robot may have the same */
  const char* name;   /**< of the session, must be set: 1 to 64 letters, digits, '.', '_', '-', no
                           '.' first */
  const char* sensor; /**< of the LiDAR, must be set: written like a name ("generic") */
  /** LCM's URL ("udpm://239.255.76.67:7667?ttl=0", which stays on this computer; ttl=1 leaves it).
   *  Null or "": nothing is sent, the spool keeps everything for a later start. */
  const char* url;
  uint32_t datagram_bytes;     /**< largest datagram, 256 to 60000 (60000); 1300 for Wi-Fi */
  uint32_t finish_timeout_ms;  /**< longest that um_delivery_finish waits for bases (30000) */
  double bytes_per_second;     /**< highest average rate, 1e3 to 1e10 (20e6) */
  double min_bytes_per_second; /**< lowest average rate, whatever the link loses; 500 to the highest
                                  (4000) */
  uint64_t unacknowledged_bytes; /**< memory for keyframes that no base has yet (64000000) */
  /** Folder that keeps keyframes until a base has them, over restarts; made if it is not there.
   *  Null or "": memory alone. What earlier starts left in it is delivered too. */
  const char* spool;
  uint64_t spool_bytes;     /**< disk space of it, 1e6 to 1e15 (2000000000); then the oldest go */
  uint32_t spool_max_age_s; /**< what is older by the robot's clock goes; 0: never (0) */
  /** Keyframes that may wait for the library's thread after um_delivery_publish, 2 to 64, or 0:
   * there is no such thread, and the call itself signs and stores (0). */
  uint32_t queue_keyframes;
  uint64_t queue_bytes; /**< room for each keyframe that waits, 1e3 to 1e9 (4000000) */
  const char* key;      /**< file of the robot's key (unimapper keys); null or "": none */
  /** Told in one sentence when the disk fails, when it works again, and what was damaged; from
   *  threads of the library, and during um_delivery_create. May be null; must not call back. */
  void (*report)(void* context, const char* sentence);
  void* report_context; /**< handed to report */
} um_delivery_options;

/** Fills in the defaults, which stand in brackets above. Leaves `name` null. */
int um_delivery_options_init(um_delivery_options* options);

/** Opaque. */
typedef struct um_delivery um_delivery;

/** Opens spool and network and begins to send. On success *delivery is to be destroyed; otherwise
 * it is null, and `message` (may be null) holds as much of one sentence as fits into
 * `message_bytes`, ended by zero. EINVAL also for neither a URL nor a spool; EACCES for a key file
 * that cannot be used, ENOTSUP where the library was built without keys, EIO for a spool that
 * cannot be opened or that another process uses, ENETUNREACH for an LCM that will not open. A disk
 * that is full or fails is no error. Blocks for the disk. */
int um_delivery_create(const um_delivery_options* options, um_delivery** delivery, char* message,
                       size_t message_bytes);

/** Whose keyframes it takes: the numbers for um_session, each of which may be null. */
int um_delivery_session(const um_delivery* delivery, uint32_t* robot, uint64_t* boot_high,
                        uint64_t* boot_low);

/* ---- Keyframes ------------------------------------------------------------------------------ */

/** Hands over a keyframe that um_keyframe_encode wrote, with the stamp of its last scan. Its bytes
 *  are copied, its sequence is read from them. Never waits for disk or network; O(bytes), with a
 *  key and without a queue the time of a signature more. EPROTO: the bytes do not begin as a
 *  keyframe of this schema and session; EMSGSIZE, ENOBUFS: it is larger than queue_bytes, or the
 *  queue is full (`refused` counts both); ESHUTDOWN after um_delivery_finish. */
int um_delivery_publish(um_delivery* delivery, const void* bytes, size_t size, int64_t stamp_ns);

struct um_health;
/** From now on this (see um_health_get) is sent every second, over a thin
 *  link less often, for the base's display. Of the stages
 *  the base is told the longest time alone. */
int um_delivery_set_health(um_delivery* delivery, const struct um_health* health);

/* ---- What became of them -------------------------------------------------------------------- */

/** State and counts since um_delivery_create. */
typedef struct um_delivery_status {
  uint32_t base_answers; /**< 1 once a base has said what it has of this session */
  uint32_t rate_adapts;  /**< 1 once the rate follows the link */
  uint32_t end_is_known; /**< 1 once a base has confirmed the session's end */
  uint64_t published;    /**< keyframes handed over */
  uint64_t refused;      /**< keyframes that found no room in the queue */
  uint64_t acknowledged; /**< published keyframes stored by a base */
  uint64_t waiting;      /**< published keyframes in queue, memory or spool for a base */
  uint64_t sent;         /**< published keyframes handed to the network whole */
  uint64_t dropped;      /**< published keyframes pushed out of the full queue without being sent */
  uint64_t lost; /**< published keyframes that neither a base nor the robot has, dropped ones too */
  uint64_t pieces_resent;        /**< since a base said that they are missing */
  uint64_t bytes_sent;           /**< of all messages */
  uint64_t send_failures;        /**< datagrams that the network refused */
  uint64_t answers_refused;      /**< of bases, for their key; 0 without one */
  double bytes_per_second;       /**< highest rate of keyframes now */
  double loss;                   /**< share of the pieces lost lately */
  int64_t round_trip_ns;         /**< to the base and back; 0: not measured */
  uint64_t window_bytes;         /**< what the base lets be on the way; 0: it has not said */
  int64_t clock_offset_ns;       /**< the base's clock less the robot's, where clock_is_known */
  int64_t clock_uncertainty_ns;  /**< bound of its error */
  uint32_t clock_is_known;       /**< 1 once it is measured */
  uint32_t has_spool;            /**< 1 if there is one; the rest is 0 otherwise */
  uint32_t spool_failing;        /**< 1 while nothing can be written */
  uint32_t reserved;             /**< 0 */
  uint64_t spool_bytes;          /**< on disk */
  uint64_t spool_keyframes;      /**< on disk, of all sessions */
  uint64_t spool_durable;        /**< of this start: written, and survive a loss of power */
  uint64_t spool_refused;        /**< of this start: never written, the disk failed or was slow */
  uint64_t spool_lost;           /**< removed without a base having them */
  uint64_t spool_damaged;        /**< not read back, or with a wrong checksum */
  uint64_t earlier_sessions;     /**< found in the spool, not wholly delivered */
  uint64_t earlier_delivered;    /**< earlier sessions delivered since, and their end confirmed */
  uint64_t earlier_keyframes;    /**< keyframes of earlier sessions that waited */
  uint64_t earlier_acknowledged; /**< keyframes of earlier sessions that a base has stored since */
  uint64_t earlier_lost;         /**< keyframes of earlier sessions damaged, or removed on disk */
} um_delivery_status;

/** How the delivery is doing. */
int um_delivery_status_get(const um_delivery* delivery, um_delivery_status* status);

/* ---- Place in the base's map ---------------------------------------------------------------- */

/** How far the base is with this robot's place in its map. */
enum {
  UM_MAP_POSE_NOT_YET = 0,   /**< too little connects the robot to the map, or it was lost */
  UM_MAP_POSE_AMBIGUOUS = 1, /**< something else would explain what connects it as well */
  UM_MAP_POSE_LOCALISED = 2  /**< the pose holds */
};

/** Where this robot is in the map of a base that localises robots (`unimapper base --localise`).
 *  From any pose of the robot's odometry it makes one in the map, also of scans since:
 *  T_map_sensor = T_map_odometry * T_odometry_sensor. All robots that a base has localised in one
 *  epoch are in one frame. When the base corrects its answer the pose jumps. */
typedef struct um_map_pose {
  uint32_t state;       /**< UM_MAP_POSE_...; position to since_loop_m hold if localised alone */
  int64_t epoch;        /**< of the map in the base's store, from 1; another one, another frame */
  uint32_t sequence;    /**< of the newest keyframe that the answer rests on */
  uint32_t loops;       /**< loops to the map that support the pose */
  int64_t stamp_ns;     /**< of that keyframe's reference scan */
  double position[3];   /**< of T_map_odometry: x, y, z in metres */
  double quaternion[4]; /**< of T_map_odometry: x, y, z, w; of unit length */
  /** Of that keyframe's pose in the map: upper triangle, row by row, of translation along the axes
   *  of the map (m^2), then the rotation vector in the keyframe's frame (rad^2). */
  double covariance[21];
  double since_loop_m; /**< by odometry alone since the latest of the loops */
  int64_t age_ns;      /**< since the answer, repeated every second, was last heard; steady clock */
  uint64_t refused;    /**< answers that were outdated or impossible; none of them was taken */
  char reason[208];    /**< why the robot is not localised; ended by zero, empty if it is */
} um_map_pose;

/** The newest answer of a base about this session. EAGAIN while none has come, also without a URL;
 * pose is as it was then. Takes a lock for a moment. For any thread at any time, as
 * um_delivery_status_get. */
int um_delivery_map_pose(const um_delivery* delivery, um_map_pose* pose);

/* ---- End ------------------------------------------------------------------------------------ */

/** Ends the session: sends until bases have all, earlier sessions included, at most
 *  finish_timeout_ms; where none has ever answered, for seconds. Then waits for the disk, at most
 *  10 s. 0 also where something is left: see the status. Once. */
int um_delivery_finish(um_delivery* delivery);

/** Stops at once and gives everything back; null is allowed. Without um_delivery_finish before, no
 *  end is announced, and what is not acknowledged is left to the spool. Waits for the disk. */
void um_delivery_destroy(um_delivery* delivery);

#ifdef __cplusplus
}
#endif

#endif /* UNIMAPPER_DELIVERY_H */
