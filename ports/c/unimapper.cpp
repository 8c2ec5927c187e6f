// C interface of the onboard pipeline.
#include "ports/c/unimapper.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <span>
#include <string_view>

#include "ports/c/config.hpp"
#include "ports/c/convert.hpp"
#include "ports/c/handle.hpp"
#include "ports/c/health.hpp"
#include "unimapper/onboard/pipeline.hpp"

using namespace unimapper;
using namespace unimapper::c;

namespace {

static_assert(std::endian::native == std::endian::little, "points are little-endian float32");
static_assert(sizeof(um_pipeline) % UM_ALIGNMENT == 0 && Arena::kAlignment == UM_ALIGNMENT);
static_assert(UM_VERSION_MAJOR == UNIMAPPER_VERSION_MAJOR &&
                  UM_VERSION_MINOR == UNIMAPPER_VERSION_MINOR &&
                  UM_VERSION_PATCH == UNIMAPPER_VERSION_PATCH,
              "the header's version is the project's");

#define UM_TEXT_OF(number) #number
#define UM_TEXT(number) UM_TEXT_OF(number)
constexpr const char* kVersionText =
    UM_TEXT(UM_VERSION_MAJOR) "." UM_TEXT(UM_VERSION_MINOR) "." UM_TEXT(UM_VERSION_PATCH);
#undef UM_TEXT
#undef UM_TEXT_OF

/// Whether its intensities may lie in memory.
bool is_possible(const PointView& points) noexcept {
  return points.intensities == nullptr || points.intensity_stride == 0 ||
         points.count <= SIZE_MAX / 4 / points.intensity_stride;
}

/// The core's own names are constants that end in zero.
const char* text_of(std::string_view name) noexcept { return name.data(); }

/// Bytes of the ring, rounded up so that what follows it is aligned.
std::size_t ring_bytes(const um_config& config) noexcept {
  if (config.event_capacity == 0) return 0;
  const std::size_t bytes = EventRing::required_bytes(config.event_capacity);
  return (bytes + UM_ALIGNMENT - 1) / UM_ALIGNMENT * UM_ALIGNMENT;
}

um_status make_core(um_pipeline& pipeline) noexcept {
  pipeline.config.events = nullptr;
  if (pipeline.event_capacity > 0) {
    const auto ring =
        EventRing::create(pipeline.event_capacity, {pipeline.ring_memory, pipeline.ring_bytes});
    if (!ring.ok()) return tell(pipeline, ring.error());
    pipeline.config.events = ring.value();
  }
  const auto created =
      Pipeline::create(pipeline.config, {pipeline.core_memory, pipeline.core_bytes});
  pipeline.core = created.ok() ? created.value() : nullptr;
  pipeline.keyframe_ready = pipeline.keyframe_finished = false;
  pipeline.health = {};
  return tell(pipeline, created.error());
}

void finish(um_pipeline& pipeline, bool keyframe_finished) noexcept {
  pipeline.keyframe_finished = keyframe_finished;
  if (!keyframe_finished) return;
  add_keyframe(pipeline.health, *pipeline.core->finished_keyframe().statistics);
}

um_status finish(um_pipeline& pipeline, const ScanResult& result,
                 std::int32_t* keyframe_ready) noexcept {
  pipeline.keyframe_ready = result.keyframe_ready;
  if (keyframe_ready != nullptr) *keyframe_ready = result.keyframe_ready ? 1 : 0;
  finish(pipeline, result.keyframe_finished);
  return tell(pipeline, result.error);
}

um_status write_keyframe(um_pipeline& pipeline, bool available, const KeyframeView& view,
                         um_scan* scans, um_loop* loops, um_keyframe* keyframe) noexcept {
  if (keyframe == nullptr) return refuse(pipeline, UM_NULL_ARGUMENT);
  if (!available) return refuse(pipeline, UM_NO_KEYFRAME);
  *keyframe = to_c(view, scans, loops);
  return tell(pipeline, {});
}

}  // namespace

extern "C" {

std::uint32_t um_version(void) { return UM_VERSION; }

const char* um_version_text(void) { return kVersionText; }

const char* um_status_text(um_status status) {
  switch (status) {
    case UM_OK:
      return "";
    case UM_INVALID_CONFIG:
      return "a member of the configuration is out of its range; um_config_check says which";
    case UM_MEMORY_TOO_SMALL:
      return "the memory is smaller than um_required_bytes(config)";
    case UM_MEMORY_MISALIGNED:
      return "the memory must start on a 64-byte boundary";
    case UM_INVALID_POSE:
      return "the pose is not finite or its rotation is not a rotation";
    case UM_TIME_REVERSED:
      return "the stamp is not later than that of the scan before";
    case UM_EMPTY_SCAN:
      return "the scan has no point that is finite and within the sensor's range";
    case UM_POSE_JUMP:
      return "the pose moved farther than configured since the last scan";
    case UM_CAPACITY_EXCEEDED:
      return "a fixed-capacity container is full";
    case UM_INVALID_KEYFRAME:
      return "what was handed over is no keyframe";
    case UM_BUFFER_TOO_SMALL:
      return "the result needs more bytes than the buffer has";
    case UM_TIME_JUMP:
      return "the stamp lies a minute ahead of the scan before, or the clock was set back";
    case UM_NULL_ARGUMENT:
      return "a pointer that is needed is null";
    case UM_INVALID_HANDLE:
      return "this is no pipeline made by um_init, or its memory was overwritten";
    case UM_INVALID_POINTS:
      return "the points have no address, a stride below 4 bytes, or lie beyond the address space";
    case UM_NO_KEYFRAME:
      return "the last call closed no keyframe";
    case UM_INVALID_INDEX:
      return "the keyframe has no scan with this index";
    case UM_UNKNOWN_SENSOR:
      return "no sensor of this number or name is known";
    case UM_UNKNOWN_COMPUTER:
      return "no class of computer has this number";
    case UM_NO_EVENT:
      return "the event ring is empty, or the configuration asks for none";
    case UM_UNKNOWN_PARAMETER:
      return "no parameter has this name; docs/parameters.md lists them";
    default:
      return "unknown status";
  }
}

um_status um_config_init(um_config* config, std::uint32_t sensor) {
  return um_config_init_for(config, sensor, UM_COMPUTER_SERVER);
}

um_status um_config_init_for(um_config* config, std::uint32_t sensor, std::uint32_t computer) {
  PipelineConfig preset;
  const um_status status = preset_config(sensor, computer, preset);
  return status == UM_OK ? init_config(preset, config) : status;
}

um_status um_config_set(um_config* config, const char* name, const char* value,
                        const char** message) {
  const ConfigStatus result = set_config(config, name, value);
  return say(result.status, result.message, message);
}

um_status um_config_get(const um_config* config, const char* name, char* value,
                        std::size_t capacity) {
  if (value == nullptr) return UM_NULL_ARGUMENT;
  ParameterMessage text;
  const um_status status = get_config(config, name, text);
  if (status != UM_OK) return status;
  if (text.view().size() >= capacity) return UM_CAPACITY_EXCEEDED;
  std::memcpy(value, text.c_str(), text.view().size() + 1);
  return UM_OK;
}

um_status um_config_check(const um_config* config, const char** message) {
  PipelineConfig converted;
  const ConfigStatus result = read_config(config, converted);
  return say(result.status, result.message, message);
}

std::size_t um_required_bytes(const um_config* config) {
  PipelineConfig converted;
  if (read_config(config, converted).status != UM_OK) return 0;
  return sizeof(um_pipeline) + ring_bytes(*config) + Pipeline::required_bytes(converted);
}

um_status um_init(const um_config* config, void* memory, std::size_t bytes, um_pipeline** pipeline,
                  const char** message) {
  const auto fail = [message](um_status status) {
    return say(status, um_status_text(status), message);
  };
  if (pipeline == nullptr) return fail(UM_NULL_ARGUMENT);
  *pipeline = nullptr;
  PipelineConfig converted;
  const ConfigStatus result = read_config(config, converted);
  if (result.status != UM_OK) return say(result.status, result.message, message);
  if (memory == nullptr) return fail(UM_NULL_ARGUMENT);
  if (!is_aligned(memory)) return fail(UM_MEMORY_MISALIGNED);
  const std::size_t core_bytes = Pipeline::required_bytes(converted);
  const std::size_t before_core = sizeof(um_pipeline) + ring_bytes(*config);
  if (bytes < before_core || bytes - before_core < core_bytes) {
    return fail(UM_MEMORY_TOO_SMALL);
  }
  std::memset(memory, 0, sizeof(um_pipeline));
  auto* const made = new (memory) um_pipeline;
  made->config = converted;
  made->ring_memory = static_cast<std::byte*>(memory) + sizeof(um_pipeline);
  made->ring_bytes = ring_bytes(*config);
  made->event_capacity = config->event_capacity;
  made->core_memory = static_cast<std::byte*>(memory) + before_core;
  made->core_bytes = core_bytes;
  const um_status status = make_core(*made);
  if (status != UM_OK) return say(status, made->message, message);
  made->magic = kMagic;
  *pipeline = made;
  return say(UM_OK, "", message);
}

um_status um_reset(um_pipeline* pipeline) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  return make_core(*pipeline);
}

const char* um_message(const um_pipeline* pipeline) {
  return is_pipeline(pipeline) ? pipeline->message : um_status_text(UM_INVALID_HANDLE);
}

um_status um_pose_from_quaternion(const double xyzw[4], const double translation[3],
                                  um_pose* pose) {
  if (xyzw == nullptr || translation == nullptr || pose == nullptr) return UM_NULL_ARGUMENT;
  const Eigen::Vector3d t(translation[0], translation[1], translation[2]);
  const Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  const double norm = q.norm();
  if (!t.allFinite() || !std::isfinite(norm) || norm < 1e-6) return UM_INVALID_POSE;
  *pose = to_c(Pose(q, t));
  return UM_OK;
}

um_status um_add_scan(um_pipeline* pipeline, const um_points* points,
                      const um_pose* T_odometry_sensor, std::int64_t stamp_ns,
                      std::int32_t* keyframe_ready) {
  return um_add_scan_with_intensities(pipeline, points, nullptr, 1, T_odometry_sensor, stamp_ns,
                                      keyframe_ready);
}

um_status um_add_scan_with_intensities(um_pipeline* pipeline, const um_points* points,
                                       const std::uint8_t* intensities, std::size_t stride,
                                       const um_pose* T_odometry_sensor, std::int64_t stamp_ns,
                                       std::int32_t* keyframe_ready) {
  if (keyframe_ready != nullptr) *keyframe_ready = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (points == nullptr || T_odometry_sensor == nullptr) {
    return refuse(*pipeline, UM_NULL_ARGUMENT);
  }
  PointView view = to_view(*points);
  view.intensities = intensities;
  view.intensity_stride = stride;
  if (!is_possible(*points) || !is_possible(view)) return refuse(*pipeline, UM_INVALID_POINTS);
  const ScanResult result = pipeline->core->add_scan(view, from_c(*T_odometry_sensor), stamp_ns);
  ++pipeline->health.scans;
  if (result.error.code != ErrorCode::kOk) ++pipeline->health.scans_refused;
  return finish(*pipeline, result, keyframe_ready);
}

um_status um_add_slip(um_pipeline* pipeline, const double covariance[9]) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (covariance == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  const Eigen::Map<const Eigen::Matrix3d> symmetric(covariance);
  if (!pipeline->core->add_slip(symmetric)) return refuse(*pipeline, UM_INVALID_POSE);
  return tell(*pipeline, {});
}

um_status um_flush(um_pipeline* pipeline, std::int32_t* keyframe_ready) {
  if (keyframe_ready != nullptr) *keyframe_ready = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  return finish(*pipeline, pipeline->core->flush(), keyframe_ready);
}

um_status um_work(um_pipeline* pipeline, std::uint32_t budget_us, std::int32_t* work_left) {
  if (work_left != nullptr) *work_left = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  const WorkResult result = pipeline->core->work(budget_us);
  if (work_left != nullptr) *work_left = result.work_left ? 1 : 0;
  return finish(*pipeline, {{}, result.keyframe_ready, result.keyframe_finished}, nullptr);
}

um_status um_keyframe_get(um_pipeline* pipeline, um_keyframe* keyframe) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  return write_keyframe(*pipeline, pipeline->keyframe_ready, pipeline->core->keyframe(),
                        pipeline->scans, pipeline->loops, keyframe);
}

um_status um_finished_get(um_pipeline* pipeline, um_keyframe* keyframe) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  return write_keyframe(*pipeline, pipeline->keyframe_finished, pipeline->core->finished_keyframe(),
                        pipeline->finished_scans, pipeline->loops, keyframe);
}

um_status um_labels(um_pipeline* pipeline, std::uint32_t scan, std::uint8_t* labels,
                    std::size_t capacity, std::size_t* written) {
  if (written != nullptr) *written = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (written == nullptr || (labels == nullptr && capacity > 0)) {
    return refuse(*pipeline, UM_NULL_ARGUMENT);
  }
  if (!pipeline->keyframe_ready) return refuse(*pipeline, UM_NO_KEYFRAME);
  if (scan >= pipeline->core->keyframe().scans.size()) return refuse(*pipeline, UM_INVALID_INDEX);
  // PointLabel is one byte with the values of um_label.
  *written = pipeline->core->labels(scan, {reinterpret_cast<PointLabel*>(labels), capacity});
  return tell(*pipeline, {});
}

um_status um_relabelled_get(um_pipeline* pipeline, um_relabelled* relabelled) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (relabelled == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  *relabelled = {};
  const RelabelledKeyframe& last = pipeline->core->finished_keyframe().relabelled;
  if (last.available) {
    *relabelled = {
        1, last.sequence, last.later_keyframes, last.cells_now_dynamic, last.cells_now_static, {}};
  }
  return tell(*pipeline, {});
}

um_status um_relabel(um_pipeline* pipeline, const um_points* points,
                     const um_pose* T_odometry_sensor, std::uint8_t* labels, std::size_t count,
                     std::size_t* changed) {
  if (changed != nullptr) *changed = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (points == nullptr || T_odometry_sensor == nullptr || (labels == nullptr && count > 0)) {
    return refuse(*pipeline, UM_NULL_ARGUMENT);
  }
  if (!is_possible(*points)) return refuse(*pipeline, UM_INVALID_POINTS);
  const Pose pose = from_c(*T_odometry_sensor);
  if (!pose.is_rigid()) return refuse(*pipeline, UM_INVALID_POSE);
  // PointLabel is one byte with the values of um_label.
  const std::size_t relabelled = pipeline->core->relabel(
      to_view(*points), pose, {reinterpret_cast<PointLabel*>(labels), count});
  if (changed != nullptr) *changed = relabelled;
  return tell(*pipeline, {});
}

um_status um_relabel_next(um_pipeline* pipeline, std::int32_t* relabelled) {
  if (relabelled != nullptr) *relabelled = 0;
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (relabelled == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  *relabelled = pipeline->core->relabel_next() ? 1 : 0;
  return tell(*pipeline, {});
}

um_status um_event_pop(um_pipeline* pipeline, um_event* event) {
  // No message is left: this may be another thread than the one whose message it is.
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (event == nullptr) return UM_NULL_ARGUMENT;
  EventRecord record;
  if (pipeline->config.events == nullptr || !pipeline->config.events->pop(record)) {
    return UM_NO_EVENT;
  }
  *event = {record.id, 0, record.stamp_ns, {}};
  std::copy_n(record.values, 4, event->values);
  return UM_OK;
}

std::uint32_t um_events_lost(const um_pipeline* pipeline) {
  const bool has_ring = is_pipeline(pipeline) && pipeline->config.events != nullptr;
  return has_ring ? pipeline->config.events->overflow() : 0;
}

const char* um_drop_cause_name(std::uint32_t cause) {
  return cause < kDropCauses ? text_of(drop_cause_name(static_cast<DropCause>(cause))) : nullptr;
}
const char* um_stage_name(std::uint32_t stage) {
  return stage < kStages ? text_of(stage_name(static_cast<Stage>(stage))) : nullptr;
}
const char* um_capacity_name(std::uint32_t capacity) {
  return capacity < kCapacities ? text_of(capacity_name(static_cast<Capacity>(capacity))) : nullptr;
}

}  // extern "C"
