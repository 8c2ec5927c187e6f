/* Uni-Mapper's shared memory for C: topics of a robot read, and written, without copying.
 *
 * The same topics as those of writer.hpp and reader.hpp; docs/shared-memory.md describes them.
 * Objects live in the caller's memory and stay where they are between open and close. Nothing here
 * uses the heap. Calls on one object must not overlap in time. Calls that open return 0 or a value
 * of errno, and a constant sentence that says what was refused.
 */
#ifndef UNIMAPPER_SHARE_H
#define UNIMAPPER_SHARE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Reading -------------------------------------------------------------------------------- */

/** Content of the topics "keyframe", "labels" and "health". */
#define UM_SHARE_KEYFRAME 0x00030001u
#define UM_SHARE_LABELS 0x00030002u
#define UM_SHARE_HEALTH 0x00030003u

/** One consumer of a topic, which holds one message at a time. Set it to zeros first. */
typedef struct um_share_reader {
  uint64_t opaque[32]; /**< of the library */
} um_share_reader;

/** A message on lease. */
typedef struct um_share_message {
  const void* bytes; /**< in shared memory; as it is until it is released */
  size_t size;       /**< of the message */
  int64_t stamp_ns;  /**< by the writer */
  uint32_t sequence; /**< on its topic, from 1 */
  uint32_t writer;   /**< another one has started since where it differs */
  uint32_t missed;   /**< messages between the one taken before and this one */
} um_share_message;

/** Becomes a consumer of `topic` of `share`. Begins with the latest message, or with the oldest
 * that is there if `oldest` is not 0. Refuses with ENOENT where nobody has published it yet, with
 * EBUSY where every slot is in use. `message` may be null. */
int um_share_open(um_share_reader* reader, const char* share, const char* topic, uint32_t content,
                  int oldest, const char** message);
/** Releases what it holds, and its slot. */
void um_share_close(um_share_reader* reader);
/** Sleeps until there is a message, at most `timeout_ns`; 1 if there is one, else 0. */
int um_share_wait(um_share_reader* reader, int64_t timeout_ns);
/** Releases the message held and takes the next one: 1; 0 if there is none; -1 if it is not open or
 * the lease cannot be written. */
int um_share_take(um_share_reader* reader, um_share_message* message);
/** 1 if the message held has been whole up to now; 0 after the writer took it back. */
int um_share_intact(const um_share_reader* reader);
/** Gives the message back. */
void um_share_release(um_share_reader* reader);
/** 1 if the topic was removed or made anew: open it again. */
int um_share_is_replaced(const um_share_reader* reader);
/** 1 if a writer says that it lives. */
int um_share_has_writer(const um_share_reader* reader);

/* ---- Keyframes ------------------------------------------------------------------------------ */

/** One occupied fine cell. */
typedef struct um_share_cell {
  float position[3]; /**< levelled keyframe frame, metres */
  uint16_t points;   /**< scan points in the cell, saturating */
  uint8_t ground;    /**< 1 if it belongs to the ground */
  uint8_t intensity; /**< mean of its points, from 1; 0: not known */
} um_share_cell;

/** Cells where they lie. */
typedef struct um_share_cells {
  const unsigned char* first; /**< first byte of the first */
  size_t count;               /**< cells */
  size_t stride;              /**< bytes from one to the next */
} um_share_cells;

/** A keyframe in shared memory; to be used while its message is held. */
typedef struct um_share_keyframe {
  uint64_t boot_high;           /**< upper half of a number that every start of a robot has anew */
  uint64_t boot_low;            /**< lower half */
  uint32_t robot;               /**< its number */
  uint32_t sequence;            /**< of the keyframe in its session */
  double rotation[9];           /**< of T_odometry_keyframe, row by row */
  double translation[3];        /**< of T_odometry_keyframe, metres */
  um_share_cells static_cells;  /**< the map's contribution */
  um_share_cells dynamic_cells; /**< what was removed */
} um_share_keyframe;

/** 1, and the keyframe in `message`; 0 if there is none that is sound. */
int um_share_read_keyframe(const um_share_message* message, um_share_keyframe* keyframe);

/** Cell `index`, below `count`. */
static inline um_share_cell um_share_cell_at(const um_share_cells* cells, size_t index) {
  um_share_cell cell;
  memcpy(&cell, cells->first + index * cells->stride, sizeof cell);
  return cell;
}

/* ---- Writing -------------------------------------------------------------------------------- */

/** The writer of a topic. Set it to zeros first. */
typedef struct um_share_writer {
  uint64_t opaque[320]; /**< of the library */
} um_share_writer;

/** Size of a topic. */
typedef struct um_share_options {
  uint32_t message_bytes; /**< room for the largest message, 1 to 2^28 */
  uint32_t consumers;     /**< at a time, 1 to 16 */
  uint32_t leases;        /**< messages that one consumer may hold, 1 to 8 */
  uint32_t history;       /**< messages kept for late consumers, at least 1 */
  uint32_t content;       /**< what the messages are; readers must ask for the same */
  uint32_t audience;      /**< who may read: 0 the same user, 1 the same group, 2 everyone */
} um_share_options;

/** Becomes the writer of `topic` of `share`; all memory is taken here. Refuses with EBUSY where
 * there is one. `message` may be null. */
int um_share_writer_open(um_share_writer* writer, const char* share, const char* topic,
                         const um_share_options* options, const char** message);
/** Memory of the next message and its size; the same until it is published. Null before open. */
void* um_share_loan(um_share_writer* writer, size_t* bytes);
/** Publishes the first `bytes` of the loan; its sequence, or 0 if nothing was loaned or it does not
 * hold so many. Neither waits nor drops. */
uint32_t um_share_publish(um_share_writer* writer, size_t bytes, int64_t stamp_ns);
/** Gives back what dead consumers hold; how many leases. Not for the real-time thread. */
uint32_t um_share_reclaim(um_share_writer* writer);
/** Bytes for any keyframe of a pipeline: um_share_options.message_bytes of its topic. `cells` and
 * `planes` are its parameters voxel.max_cells and descriptor.max_planes (um_config_get). */
size_t um_share_keyframe_room(uint32_t cells, uint32_t planes);
struct um_keyframe;
/** Publishes a keyframe that um_finished_get (unimapper.h) gave, with the stamp of its last scan,
 * as the topic "keyframe" with the content UM_SHARE_KEYFRAME has it; `robot` and `boot` as in
 * um_session. Its sequence on the topic; 0 if the writer is not open, the topic is too small for
 * it, or it is of another version of unimapper.h. One copy of the cells; no heap, no wait. */
uint32_t um_share_publish_keyframe(um_share_writer* writer, const struct um_keyframe* keyframe,
                                   uint32_t robot, uint64_t boot_high, uint64_t boot_low);
/** Ends the writer; the topic stays for late joiners and for the next writer. */
void um_share_writer_close(um_share_writer* writer);
/** Ends the writer and takes the topic out of /dev/shm. */
void um_share_writer_remove(um_share_writer* writer);

#ifdef __cplusplus
}
#endif

#endif
