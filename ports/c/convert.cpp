#include "ports/c/convert.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <type_traits>

#include "unimapper/onboard/events.hpp"

namespace unimapper::c {
namespace {

// Cells, keypoints and planes are handed out as they lie in the pipeline's memory.
static_assert(sizeof(um_cell) == sizeof(FineCell) && alignof(um_cell) == alignof(FineCell));
static_assert(offsetof(um_cell, position) == offsetof(FineCell, position) &&
              offsetof(um_cell, points) == offsetof(FineCell, points) &&
              offsetof(um_cell, ground) == offsetof(FineCell, ground) &&
              offsetof(um_cell, intensity) == offsetof(FineCell, intensity));
static_assert(sizeof(um_keypoint) == sizeof(Keypoint) && alignof(um_keypoint) == alignof(Keypoint));
static_assert(offsetof(um_keypoint, position) == offsetof(Keypoint, position) &&
              offsetof(um_keypoint, normal) == offsetof(Keypoint, normal) &&
              offsetof(um_keypoint, occupancy) == offsetof(Keypoint, occupancy) &&
              offsetof(um_keypoint, strength) == offsetof(Keypoint, strength));
static_assert(sizeof(um_plane) == sizeof(PlanePatch) && alignof(um_plane) == alignof(PlanePatch));
static_assert(offsetof(um_plane, center) == offsetof(PlanePatch, center) &&
              offsetof(um_plane, normal) == offsetof(PlanePatch, normal));
static_assert(sizeof(PointLabel) == 1 &&
              static_cast<int>(PointLabel::kUnknown) == UM_LABEL_UNKNOWN &&
              static_cast<int>(PointLabel::kStatic) == UM_LABEL_STATIC &&
              static_cast<int>(PointLabel::kDynamic) == UM_LABEL_DYNAMIC);

// Numbers that C programs and logs rely on.
template <typename Enum>
constexpr bool same(Enum value, int number) noexcept {
  return static_cast<int>(value) == number;
}
static_assert(same(ErrorCode::kOk, UM_OK) && same(ErrorCode::kInvalidConfig, UM_INVALID_CONFIG) &&
              same(ErrorCode::kMemoryTooSmall, UM_MEMORY_TOO_SMALL) &&
              same(ErrorCode::kMemoryMisaligned, UM_MEMORY_MISALIGNED) &&
              same(ErrorCode::kInvalidPose, UM_INVALID_POSE) &&
              same(ErrorCode::kTimeReversed, UM_TIME_REVERSED) &&
              same(ErrorCode::kEmptyScan, UM_EMPTY_SCAN) &&
              same(ErrorCode::kPoseJump, UM_POSE_JUMP) &&
              same(ErrorCode::kCapacityExceeded, UM_CAPACITY_EXCEEDED) &&
              same(ErrorCode::kInvalidKeyframe, UM_INVALID_KEYFRAME) &&
              same(ErrorCode::kBufferTooSmall, UM_BUFFER_TOO_SMALL) &&
              same(ErrorCode::kTimeJump, UM_TIME_JUMP));
static_assert(same(SensorKind::kGeneric, UM_SENSOR_GENERIC) &&
              same(SensorKind::kHdl64e, UM_SENSOR_HDL_64E) &&
              same(SensorKind::kVlp16, UM_SENSOR_VLP_16) &&
              same(SensorKind::kOs1_64, UM_SENSOR_OS1_64) &&
              same(SensorKind::kOs2_128, UM_SENSOR_OS2_128) &&
              same(SensorKind::kAevaAeries2, UM_SENSOR_AEVA_AERIES_2) &&
              same(SensorKind::kLivoxAvia, UM_SENSOR_LIVOX_AVIA) &&
              same(SensorKind::kLivoxMid360, UM_SENSOR_LIVOX_MID_360));
static_assert(same(Computer::kServer, UM_COMPUTER_SERVER) &&
              same(Computer::kJetson, UM_COMPUTER_JETSON) &&
              same(Computer::kRaspberryPi, UM_COMPUTER_RASPBERRY_PI) &&
              same(Computer::kArmv7With64Mb, UM_COMPUTER_ARMV7_WITH_64_MB));
static_assert(same(EventId::kKeyframeClosed, UM_EVENT_KEYFRAME_CLOSED) &&
              same(EventId::kScanRefused, UM_EVENT_SCAN_REFUSED) &&
              same(EventId::kPoseJump, UM_EVENT_POSE_JUMP) &&
              same(EventId::kDropped, UM_EVENT_DROPPED) &&
              same(EventId::kDeadlineMissed, UM_EVENT_DEADLINE_MISSED) &&
              same(EventId::kUpContradicted, UM_EVENT_UP_CONTRADICTED) &&
              same(EventId::kSamplingDiffers, UM_EVENT_SAMPLING_DIFFERS) &&
              same(EventId::kElevationsDiffer, UM_EVENT_ELEVATIONS_DIFFER) &&
              same(EventId::kAttitudeNoise, UM_EVENT_ATTITUDE_NOISE) &&
              same(EventId::kSweepsUncompensated, UM_EVENT_SWEEPS_UNCOMPENSATED) &&
              same(EventId::kOdometryContradicted, UM_EVENT_ODOMETRY_CONTRADICTED) &&
              same(EventId::kMountContradicted, UM_EVENT_MOUNT_CONTRADICTED) &&
              same(EventId::kClockContradicted, UM_EVENT_CLOCK_CONTRADICTED) &&
              same(EventId::kScaleContradicted, UM_EVENT_SCALE_CONTRADICTED) &&
              same(EventId::kMotionContradicted, UM_EVENT_MOTION_CONTRADICTED));
static_assert(same(DropCause::kNotFinite, UM_DROP_NOT_FINITE) &&
              same(DropCause::kOutOfRange, UM_DROP_OUT_OF_RANGE) &&
              same(DropCause::kScanTooLarge, UM_DROP_SCAN_TOO_LARGE) &&
              same(DropCause::kCellsFull, UM_DROP_CELLS_FULL) &&
              same(DropCause::kVoxelsFull, UM_DROP_VOXELS_FULL) &&
              same(DropCause::kEvidenceFull, UM_DROP_EVIDENCE_FULL) &&
              same(DropCause::kDescriptionFull, UM_DROP_DESCRIPTION_FULL) &&
              same(DropCause::kTriangleTableFull, UM_DROP_TRIANGLE_TABLE_FULL));
static_assert(same(Stage::kIngest, UM_STAGE_INGEST) && same(Stage::kRemoval, UM_STAGE_REMOVAL) &&
              same(Stage::kDescription, UM_STAGE_DESCRIPTION) &&
              same(Stage::kSearch, UM_STAGE_SEARCH) && same(Stage::kTotal, UM_STAGE_TOTAL));
static_assert(same(Capacity::kPointsPerScan, UM_CAPACITY_POINTS_PER_SCAN) &&
              same(Capacity::kCells, UM_CAPACITY_CELLS) &&
              same(Capacity::kVoxels, UM_CAPACITY_VOXELS) &&
              same(Capacity::kBlocks, UM_CAPACITY_BLOCKS) &&
              same(Capacity::kPlaces, UM_CAPACITY_PLACES));

// The layout programs were compiled against, the same on 32 and 64 bits where no pointer is in it.
static_assert(sizeof(um_pose) == 96 && sizeof(um_scan) == 112 && sizeof(um_cell) == 16 &&
              sizeof(um_keypoint) == 40 && sizeof(um_plane) == 24 && sizeof(um_loop) == 128);
static_assert(sizeof(um_statistics) == 512 && offsetof(um_statistics, dropped) == 56 &&
              offsetof(um_statistics, capacity) == 184 &&
              offsetof(um_statistics, stage_us) == 440 &&
              offsetof(um_statistics, attitude_noise_deg) == 504);
static_assert(offsetof(um_keyframe, statistics) == 112 && offsetof(um_keyframe, scans) == 624);
static_assert(sizeof(um_input) == 52);
static_assert(kDropCauses <= 16 && kStages <= 16 && kCapacities <= 16);

um_statistics to_c(const KeyframeStatistics& from) noexcept {
  um_statistics to{};
  to.points_in = from.points_in;
  to.points_valid = from.points_valid;
  to.points_static = from.points_static;
  to.points_dynamic = from.points_dynamic;
  to.cells = from.cells;
  to.dynamic_cells = from.dynamic_cells;
  to.voxels = from.voxels;
  to.ground_voxels = from.ground_voxels;
  to.components = from.components;
  to.deadline_missed = from.deadline_missed ? 1 : 0;
  to.attitude_noise_deg = from.attitude_noise_deg;
  std::copy(from.dropped.begin(), from.dropped.end(), to.dropped);
  std::copy(from.stage_us.begin(), from.stage_us.end(), to.stage_us);
  for (std::size_t i = 0; i < kCapacities; ++i) {
    to.capacity[i] = {from.capacity[i].used, from.capacity[i].capacity};
  }
  return to;
}

um_input input_of(const KeyframeView& view) noexcept {
  const KeyframeStatistics& from = *view.statistics;
  um_input to{};
  to.ray_spacing_deg = from.sampling.ray_spacing_deg;
  to.ring_spacing_deg = from.sampling.ring_spacing_deg;
  to.image_elevation_min_deg = from.sampling.image_elevation_min_deg;
  to.image_elevation_max_deg = from.sampling.image_elevation_max_deg;
  to.rays_differ = from.sampling.rays_differ ? 1 : 0;
  to.elevations_differ = from.sampling.elevations_differ ? 1 : 0;
  to.mode_changes = from.sampling.changes;
  to.attitude_noise_deg = from.attitude_noise_deg;
  to.sweep_tilt_deg = from.sweep_tilt_deg;
  to.aligned_scans = from.aligned_scans;
  to.up_known = view.up.known ? 1 : 0;
  to.odometry_tilt_deg = from.odometry_tilt_deg;
  to.up_sigma_deg = static_cast<float>(view.up.sigma() * kDegreesPerRadian);
  return to;
}

um_loop to_c(const LoopCandidate& from) noexcept {
  um_loop to{};
  to.session = from.match.session;
  to.keyframe = from.match.keyframe;
  to.confidence = from.confidence;
  to.accepted = from.accepted ? 1 : 0;
  to.votes = from.votes;
  to.inliers = from.inliers;
  to.plane_overlap = from.plane_overlap;
  to.T_match_query = c::to_c(from.T_match_query);
  return to;
}

}  // namespace

um_status to_c(ErrorCode code) noexcept { return static_cast<um_status>(code); }

um_pose to_c(const Pose& pose) noexcept {
  um_pose out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      out.m[4 * row + column] = pose.rotation(row, column);
    }
    out.m[4 * row + 3] = pose.translation(row);
  }
  return out;
}

Pose from_c(const um_pose& pose) noexcept {
  Pose out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      out.rotation(row, column) = pose.m[4 * row + column];
    }
    out.translation(row) = pose.m[4 * row + 3];
  }
  return out;
}

PointView to_view(const um_points& points) noexcept {
  return {.data = static_cast<const std::byte*>(points.data),
          .count = points.count,
          .stride = points.stride,
          .offset_x = points.offset_x,
          .offset_y = points.offset_y,
          .offset_z = points.offset_z};
}

bool is_possible(const um_points& points) noexcept {
  if (points.count == 0) return true;
  if (points.data == nullptr || points.stride < sizeof(float)) return false;
  constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max() / 4;
  const std::size_t offset = std::max({points.offset_x, points.offset_y, points.offset_z});
  return offset <= kMost && points.count <= kMost / points.stride;
}

um_keyframe to_c(const KeyframeView& view, um_scan* scans, um_loop* loops) noexcept {
  for (std::size_t i = 0; i < view.scans.size(); ++i) {
    scans[i] = {view.scans[i].scan_index, 0, view.scans[i].stamp_ns,
                to_c(view.scans[i].T_odometry_sensor)};
  }
  for (std::size_t i = 0; i < view.loops.size(); ++i) loops[i] = to_c(view.loops[i]);
  um_keyframe to{};
  to.sequence = view.sequence;
  to.reference_scan = view.reference_scan;
  to.scan_count = static_cast<std::uint32_t>(view.scans.size());
  to.T_odometry_keyframe = to_c(view.T_odometry_keyframe);
  to.statistics = to_c(*view.statistics);
  to.scans = scans;
  to.static_cells = reinterpret_cast<const um_cell*>(view.static_cells.data());
  to.static_cell_count = view.static_cells.size();
  to.dynamic_cells = reinterpret_cast<const um_cell*>(view.dynamic_cells.data());
  to.dynamic_cell_count = view.dynamic_cells.size();
  to.keypoints = reinterpret_cast<const um_keypoint*>(view.place.keypoints.data());
  to.keypoint_count = view.place.keypoints.size();
  to.planes = reinterpret_cast<const um_plane*>(view.place.planes.data());
  to.plane_count = view.place.planes.size();
  to.loops = loops;
  to.loop_count = view.loops.size();
  to.up_known = view.up.known ? 1 : 0;
  to.up_contradicted = view.statistics->up_contradicted ? 1 : 0;
  to.up_covariance[0] = view.up.variance_x;
  to.up_covariance[1] = view.up.covariance_xy;
  to.up_covariance[2] = view.up.variance_y;
  to.odometry_tilt_deg = view.statistics->odometry_tilt_deg;
  to.input = input_of(view);
  to.repeats = view.repeats ? 1 : 0;
  return to;
}

}  // namespace unimapper::c
