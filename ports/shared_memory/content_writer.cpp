#include "ports/shared_memory/content_writer.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "ports/shared_memory/section_writer.hpp"

namespace unimapper::shared_memory {

namespace {

static_assert(sizeof(SharedStatistics::dropped) / 8 == kDropCauses);
static_assert(sizeof(SharedStatistics::capacity) / sizeof(SharedCapacity) == kCapacities);
static_assert(sizeof(SharedStatistics::stage_us) / 4 == kStages);
// Cells are copied as they are.
static_assert(sizeof(FineCell) == sizeof(SharedCell));
static_assert(offsetof(FineCell, points) == offsetof(SharedCell, points));
static_assert(offsetof(FineCell, ground) == offsetof(SharedCell, ground));
static_assert(sizeof(PlanePatch) == sizeof(SharedPlane));
static_assert(offsetof(PlanePatch, normal) == offsetof(SharedPlane, normal));

void put_pose(const Pose& pose, double* out) noexcept {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) *out++ = pose.rotation(row, column);
  }
  for (int row = 0; row < 3; ++row) *out++ = pose.translation[row];
}

void put_vector(const Eigen::Vector3f& vector, float* out) noexcept {
  for (int i = 0; i < 3; ++i) out[i] = vector[i];
}

SharedScan shared(const KeyframeScan& scan) noexcept {
  SharedScan out = {};
  out.scan_index = scan.scan_index;
  out.stamp_ns = scan.stamp_ns;
  put_pose(scan.T_odometry_sensor, out.T_odometry_sensor);
  return out;
}

SharedKeypoint shared(const Keypoint& keypoint) noexcept {
  SharedKeypoint out = {};
  put_vector(keypoint.position, out.position);
  put_vector(keypoint.normal, out.normal);
  out.occupancy = keypoint.occupancy;
  out.strength = keypoint.strength;
  return out;
}

SharedLoop shared(const LoopCandidate& loop) noexcept {
  SharedLoop out = {};
  out.match_session = loop.match.session;
  out.match_keyframe = loop.match.keyframe;
  out.accepted = loop.accepted ? 1 : 0;
  out.confidence = loop.confidence;
  out.votes = loop.votes;
  out.inliers = loop.inliers;
  out.plane_overlap = loop.plane_overlap;
  put_pose(loop.T_match_query, out.T_match_query);
  return out;
}

SharedStatistics shared(const KeyframeStatistics& statistics) noexcept {
  SharedStatistics out = {};
  out.points_in = statistics.points_in;
  out.points_valid = statistics.points_valid;
  out.points_static = statistics.points_static;
  out.points_dynamic = statistics.points_dynamic;
  std::copy(statistics.dropped.begin(), statistics.dropped.end(), out.dropped);
  for (std::size_t i = 0; i < kCapacities; ++i) {
    out.capacity[i] = {statistics.capacity[i].used, statistics.capacity[i].capacity};
  }
  std::copy(statistics.stage_us.begin(), statistics.stage_us.end(), out.stage_us);
  out.deadline_missed = statistics.deadline_missed ? 1 : 0;
  return out;
}

constexpr auto kShared = [](const auto& element) noexcept { return shared(element); };

}  // namespace

std::uint64_t max_keyframe_bytes(const PipelineConfig& config) noexcept {
  // Each section may need up to 7 bytes to end on a multiple of 8.
  return sizeof(SharedKeyframe) + std::uint64_t{config.keyframe.scans} * sizeof(SharedScan) +
         std::uint64_t{config.voxel.max_cells} * sizeof(SharedCell) +
         std::uint64_t{config.descriptor.max_keypoints} * sizeof(SharedKeypoint) +
         std::uint64_t{config.descriptor.max_planes} * sizeof(SharedPlane) +
         std::uint64_t{config.loop_search.max_results} * sizeof(SharedLoop) + 48;
}

std::uint64_t max_labels_bytes(const PipelineConfig& config) noexcept {
  return sizeof(SharedLabels) + aligned(config.keyframe.max_points_per_scan);
}

std::size_t write_keyframe(const KeyframeView& keyframe, const SessionId& session,
                           std::span<std::byte> out) noexcept {
  SharedKeyframe fixed = {};
  SectionWriter sections(sizeof fixed, out);
  fixed.scans = sections.convert(keyframe.scans, kShared);
  fixed.static_cells = sections.copy<SharedCell>(keyframe.static_cells);
  fixed.dynamic_cells = sections.copy<SharedCell>(keyframe.dynamic_cells);
  fixed.keypoints = sections.convert(keyframe.place.keypoints, kShared);
  fixed.planes = sections.copy<SharedPlane>(keyframe.place.planes);
  fixed.loops = sections.convert(keyframe.loops, kShared);
  if (!sections.fits() || sections.bytes() > ~std::uint32_t{0}) return 0;
  fixed.head = head_of(ContentKind::kKeyframe, sections.bytes(), session, keyframe.sequence);
  fixed.reference_scan = keyframe.reference_scan;
  fixed.up_known = keyframe.up.known ? 1 : 0;
  fixed.up_covariance[0] = keyframe.up.variance_x;
  fixed.up_covariance[1] = keyframe.up.covariance_xy;
  fixed.up_covariance[2] = keyframe.up.variance_y;
  put_pose(keyframe.T_odometry_keyframe, fixed.T_odometry_keyframe);
  if (keyframe.statistics != nullptr) fixed.statistics = shared(*keyframe.statistics);
  std::memcpy(out.data(), &fixed, sizeof fixed);
  return static_cast<std::size_t>(sections.bytes());
}

std::span<PointLabel> label_memory(std::span<std::byte> out) noexcept {
  if (out.size() < sizeof(SharedLabels)) return {};
  static_assert(sizeof(PointLabel) == 1);
  return {reinterpret_cast<PointLabel*>(out.data() + sizeof(SharedLabels)),
          out.size() - sizeof(SharedLabels)};
}

std::size_t finish_labels(const KeyframeScan& scan, std::uint32_t keyframe,
                          const SessionId& session, std::size_t count,
                          std::span<std::byte> out) noexcept {
  const std::size_t bytes = sizeof(SharedLabels) + count;
  if (out.size() < bytes) return 0;
  SharedLabels fixed = {};
  fixed.head = head_of(ContentKind::kLabels, bytes, session, scan.scan_index);
  fixed.labels = {sizeof(SharedLabels), static_cast<std::uint32_t>(count), 1, 0};
  fixed.stamp_ns = scan.stamp_ns;
  fixed.keyframe = keyframe;
  std::memcpy(out.data(), &fixed, sizeof fixed);
  return bytes;
}

void HealthSum::add_scan(const Error& error) noexcept {
  ++sum_.scans;
  sum_.scans_refused += error.ok() ? 0 : 1;
}

void HealthSum::add_keyframe(const KeyframeView& keyframe) noexcept {
  sum_.head.number = keyframe.sequence;
  ++sum_.keyframes;
  sum_.points_in += keyframe.points_in;
  sum_.points_dynamic += keyframe.points_dynamic;
  for (const LoopCandidate& loop : keyframe.loops) sum_.loops_accepted += loop.accepted ? 1 : 0;
  if (keyframe.statistics == nullptr) return;
  const KeyframeStatistics& statistics = *keyframe.statistics;
  sum_.deadline_misses += statistics.deadline_missed ? 1 : 0;
  for (std::size_t i = 0; i < kDropCauses; ++i) sum_.dropped[i] += statistics.dropped[i];
  for (std::size_t i = 0; i < kCapacities; ++i) {
    sum_.fullest[i] = {std::max(sum_.fullest[i].used, statistics.capacity[i].used),
                       statistics.capacity[i].capacity};
  }
  for (std::size_t i = 0; i < kStages; ++i) {
    sum_.longest_stage_us[i] = std::max(sum_.longest_stage_us[i], statistics.stage_us[i]);
  }
}

std::size_t HealthSum::write(const SessionId& session, std::span<std::byte> out) const noexcept {
  if (out.size() < sizeof(SharedHealth)) return 0;
  SharedHealth message = sum_;
  message.head = head_of(ContentKind::kHealth, sizeof message, session, sum_.head.number);
  std::memcpy(out.data(), &message, sizeof message);
  return sizeof message;
}

}  // namespace unimapper::shared_memory
