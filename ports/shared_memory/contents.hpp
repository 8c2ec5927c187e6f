// Layout of the messages a robot shares: keyframes, labels of scans, health.
//
// No pointers: every list is a section, an offset from the first byte of the message. Numbers are
// in the processor's own byte order. docs/shared-memory.md has the same as tables.
#pragma once

#include <cstddef>
#include <cstdint>

namespace unimapper::shared_memory {

/// What a message is; also `WriterOptions::content`, in whose upper half the version stands.
enum class ContentKind : std::uint16_t { kKeyframe = 1, kLabels = 2, kHealth = 3 };

inline constexpr std::uint32_t kContentMagic = 0x43534D55;  ///< "UMSC" in a little-endian file
/// Grows with every change that an older reader would not understand. Elements may grow at their
/// end without: readers go by the section's stride.
inline constexpr std::uint16_t kContentVersion = 3;

/// `WriterOptions::content` of a topic.
[[nodiscard]] constexpr std::uint32_t content_of(ContentKind kind) noexcept {
  return std::uint32_t{kContentVersion} << 16U | static_cast<std::uint32_t>(kind);
}

inline constexpr char kKeyframeTopic[] = "keyframe";  ///< finished keyframes
inline constexpr char kLabelsTopic[] = "labels";      ///< online labels, a message per scan
inline constexpr char kHealthTopic[] = "health";      ///< after every keyframe

/// A list in a message.
struct Section {
  std::uint32_t offset;  ///< of the first element from the message's first byte; a multiple of 8
  std::uint32_t count;   ///< elements
  std::uint32_t stride;  ///< bytes from one element to the next
  std::uint32_t unused;  ///< 0
};

/// First bytes of every message.
struct ContentHead {
  std::uint32_t magic;      ///< `kContentMagic`
  std::uint16_t kind;       ///< a `ContentKind`
  std::uint16_t version;    ///< `kContentVersion`
  std::uint64_t bytes;      ///< of the message
  std::uint64_t boot_high;  ///< as in `BootId`
  std::uint64_t boot_low;   ///< as in `BootId`
  std::uint32_t robot;      ///< as in `SessionId`
  std::uint32_t number;     ///< `sequence` of the keyframe; `scan_index` of the labels' scan
};
static_assert(sizeof(ContentHead) == 40);

/// A `KeyframeScan`.
struct SharedScan {
  std::uint32_t scan_index;      ///< running number in the session
  std::uint32_t unused;          ///< 0
  std::int64_t stamp_ns;         ///< by the caller's clock
  double T_odometry_sensor[12];  ///< rotation row by row, then translation, metres
};
static_assert(sizeof(SharedScan) == 112);

/// A `FineCell`.
struct SharedCell {
  float position[3];       ///< levelled keyframe frame, metres
  std::uint16_t points;    ///< scan points in the cell, saturating
  std::uint8_t ground;     ///< 1 if the cell belongs to the ground
  std::uint8_t intensity;  ///< mean of its points, from 1; 0: not known
};
static_assert(sizeof(SharedCell) == 16);

/// A `Keypoint`.
struct SharedKeypoint {
  float position[3];        ///< levelled keyframe frame, metres
  float normal[3];          ///< unit length
  std::uint64_t occupancy;  ///< heights of its column, one bit a slice
  std::uint16_t strength;   ///< larger is stronger
  std::uint16_t unused[3];  ///< 0
};
static_assert(sizeof(SharedKeypoint) == 40);

/// A `PlanePatch`.
struct SharedPlane {
  float center[3];  ///< levelled keyframe frame, metres
  float normal[3];  ///< unit length, towards the sensor
};
static_assert(sizeof(SharedPlane) == 24);

/// A `LoopCandidate` of this keyframe.
struct SharedLoop {
  std::uint32_t match_session;   ///< session of the keyframe that was found; 0: this one
  std::uint32_t match_keyframe;  ///< its number
  std::uint32_t accepted;        ///< 1 if the confidence reaches the threshold
  float confidence;              ///< [0, 1]
  std::uint32_t votes;           ///< of triangles
  std::uint32_t inliers;         ///< keypoints that agree
  float plane_overlap;           ///< share of planes that coincide
  std::uint32_t unused;          ///< 0
  double T_match_query[12];      ///< rotation row by row, then translation, metres
};
static_assert(sizeof(SharedLoop) == 128);

/// A container's fill.
struct SharedCapacity {
  std::uint64_t used;      ///< elements in use
  std::uint64_t capacity;  ///< elements there is room for
};

/// Counts and times of a keyframe: `KeyframeStatistics`, indexed by its enumerations.
struct SharedStatistics {
  std::uint64_t points_in;        ///< points handed over in its scans
  std::uint64_t points_valid;     ///< finite and within range
  std::uint64_t points_static;    ///< labelled static
  std::uint64_t points_dynamic;   ///< labelled dynamic
  std::uint64_t dropped[8];       ///< by `DropCause`
  SharedCapacity capacity[5];     ///< by `Capacity`
  float stage_us[5];              ///< by `Stage`, microseconds
  std::uint32_t deadline_missed;  ///< 1 if it took longer than its budget
};
static_assert(sizeof(SharedStatistics) == 200);

/// A keyframe: this, then its sections.
struct SharedKeyframe {
  ContentHead head;                ///< `number`: its sequence
  Section scans;                   ///< of `SharedScan`, in order of time
  Section static_cells;            ///< of `SharedCell`: the map's contribution
  Section dynamic_cells;           ///< of `SharedCell`: what was removed
  Section keypoints;               ///< of `SharedKeypoint`
  Section planes;                  ///< of `SharedPlane`
  Section loops;                   ///< of `SharedLoop`, best first
  std::uint32_t reference_scan;    ///< index into the scans
  std::uint32_t up_known;          ///< 1 if z is known to point up
  float up_covariance[3];          ///< of up's x and y: xx, xy, yy, rad²
  std::uint32_t unused;            ///< 0
  double T_odometry_keyframe[12];  ///< rotation row by row, then translation, metres
  SharedStatistics statistics;     ///< counts and times
};
static_assert(sizeof(SharedKeyframe) == 456);

/// Labels of a scan: this, then one byte per point.
struct SharedLabels {
  ContentHead head;        ///< `number`: the scan's index
  Section labels;          ///< of bytes: `PointLabel` of every point, in input order
  std::int64_t stamp_ns;   ///< of the scan
  std::uint32_t keyframe;  ///< sequence of the keyframe it belongs to
  std::uint32_t unused;    ///< 0
};
static_assert(sizeof(SharedLabels) == 72);

/// How the pipeline is doing since its start.
struct SharedHealth {
  ContentHead head;               ///< `number`: of the keyframe closed last
  std::uint64_t scans;            ///< handed to the pipeline
  std::uint64_t scans_refused;    ///< scans that the pipeline refused
  std::uint64_t keyframes;        ///< finished
  std::uint64_t points_in;        ///< points in the scans of finished keyframes
  std::uint64_t points_dynamic;   ///< points that were removed from finished keyframes
  std::uint64_t deadline_misses;  ///< keyframes that took longer than they may
  std::uint64_t not_shared;       ///< messages that did not fit their topic
  std::uint64_t dropped[8];       ///< by `DropCause`
  SharedCapacity fullest[5];      ///< by `Capacity`: the largest fill
  float longest_stage_us[5];      ///< by `Stage`, microseconds
  std::uint32_t loops_accepted;   ///< loop candidates that were accepted
};
static_assert(sizeof(SharedHealth) == 264);

}  // namespace unimapper::shared_memory
