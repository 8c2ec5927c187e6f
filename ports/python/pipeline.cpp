#include "ports/python/pipeline.hpp"

#include <algorithm>
#include <stdexcept>

#include "ports/python/bindings.hpp"

namespace unimapper::python {

LockedPipeline::LockedPipeline(const PipelineConfig& config) : pipeline_(config) {
  require_ok(pipeline_.error());
}

void LockedPipeline::note(bool ready, bool finished) {
  ready_ = ready;
  finished_ = finished;
  relabelled_ = finished && pipeline_->finished_keyframe().relabelled.available;
  if (!ready || pipeline_->keyframe().scans.empty()) return;
  const std::size_t first = pipeline_->keyframe().scans.front().scan_index;
  for (; first_scan_ < first && !points_.empty(); ++first_scan_) points_.pop_front();
}

ScanResult LockedPipeline::add_scan(const PointView& points, const Pose& T_odometry_sensor,
                                    std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  points_.push_back(points.count);
  const ScanResult result = pipeline_->add_scan(points, T_odometry_sensor, stamp_ns);
  note(result.keyframe_ready, result.keyframe_finished);
  return result;
}

ScanResult LockedPipeline::flush() {
  const std::lock_guard lock(mutex_);
  const ScanResult result = pipeline_->flush();
  note(result.keyframe_ready, result.keyframe_finished);
  return result;
}

WorkResult LockedPipeline::work(std::uint32_t budget_us) {
  const std::lock_guard lock(mutex_);
  const WorkResult result = pipeline_->work(budget_us);
  note(result.keyframe_ready, result.keyframe_finished);
  return result;
}

std::unique_ptr<Keyframe> LockedPipeline::keyframe(bool finished) {
  const std::lock_guard lock(mutex_);
  if (finished ? !finished_ : !ready_) {
    throw std::runtime_error(finished ? "no keyframe: ask right after a call with keyframe_finished"
                                      : "no keyframe: ask right after a call with keyframe_ready");
  }
  return std::make_unique<Keyframe>(finished ? pipeline_->finished_keyframe()
                                             : pipeline_->keyframe());
}

std::size_t LockedPipeline::points_of_scan(std::int64_t scan_in_keyframe, std::size_t& scan) {
  if (!ready_) throw std::runtime_error("no labels: ask right after a call with keyframe_ready");
  const auto scans = pipeline_->keyframe().scans;
  scan = checked_index(scan_in_keyframe, scans.size(), "scans of the keyframe");
  return points_.at(scans[scan].scan_index - first_scan_);
}

void LockedPipeline::fill(std::size_t scan, std::span<std::uint8_t> out) {
  const std::size_t known =
      pipeline_->labels(scan, {reinterpret_cast<PointLabel*>(out.data()), out.size()});
  // Points beyond `KeyframeConfig::max_points_per_scan`.
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(known), out.end(),
            static_cast<std::uint8_t>(PointLabel::kStatic));
}

std::vector<std::uint8_t> LockedPipeline::labels(std::int64_t scan_in_keyframe) {
  const std::lock_guard lock(mutex_);
  std::size_t scan = 0;
  std::vector<std::uint8_t> labels(points_of_scan(scan_in_keyframe, scan));
  fill(scan, labels);
  return labels;
}

void LockedPipeline::labels_into(std::int64_t scan_in_keyframe, std::span<std::uint8_t> out) {
  const std::lock_guard lock(mutex_);
  std::size_t scan = 0;
  const std::size_t count = points_of_scan(scan_in_keyframe, scan);
  if (out.size() != count) {
    throw py::value_error("out: the scan has " + std::to_string(count) + " points, not " +
                          std::to_string(out.size()));
  }
  fill(scan, out);
}

RelabelledKeyframe LockedPipeline::relabelled() {
  const std::lock_guard lock(mutex_);
  return relabelled_ ? pipeline_->finished_keyframe().relabelled : RelabelledKeyframe{};
}

RelabelledKeyframe LockedPipeline::relabel_next() {
  const std::lock_guard lock(mutex_);
  ready_ = finished_ = false;
  relabelled_ = pipeline_->relabel_next();
  return relabelled_ ? pipeline_->finished_keyframe().relabelled : RelabelledKeyframe{};
}

std::size_t LockedPipeline::relabel(const PointView& points, const Pose& pose,
                                    std::span<std::uint8_t> labels) {
  const std::lock_guard lock(mutex_);
  if (!relabelled_) {
    throw std::runtime_error("no final labels: ask where `relabelled` names a keyframe");
  }
  return pipeline_->relabel(points, pose,
                            {reinterpret_cast<PointLabel*>(labels.data()), labels.size()});
}

wire::KeyframeEncoder& LockedPipeline::encoder() {
  if (encoder_memory_.data() != nullptr) return encoder_;
  const std::uint32_t cells = pipeline_->config().voxel.max_cells;
  MemoryBlock memory(wire::KeyframeEncoder::required_bytes(cells));
  if (memory.data() == nullptr) throw std::runtime_error("no memory to encode keyframes");
  const auto created = wire::KeyframeEncoder::create(cells, memory.span());
  require_ok(created.error());
  encoder_ = *created;
  encoder_memory_ = std::move(memory);
  return encoder_;
}

std::vector<std::uint8_t> LockedPipeline::encode(const SessionId& session) {
  const std::lock_guard lock(mutex_);
  if (!finished_) {
    throw std::runtime_error("no keyframe: ask right after a call with keyframe_finished");
  }
  std::vector<std::uint8_t> bytes(std::size_t{1} << 19U);
  const KeyframeView& keyframe = pipeline_->finished_keyframe();
  wire::EncodeResult result = encoder().encode(keyframe, session, bytes);
  if (result.error.code == ErrorCode::kBufferTooSmall) {
    bytes.resize(result.bytes);
    result = encoder().encode(keyframe, session, bytes);
  }
  require_ok(result.error);
  bytes.resize(result.bytes);
  return bytes;
}

void LockedPipeline::insert_place(const Place& place, KeyframeId id, const Pose& T_session_place) {
  const std::lock_guard lock(mutex_);
  pipeline_->places().insert(place.view(), id, T_session_place);
}

namespace {

/// What Python may write to, one-dimensional and contiguous.
std::span<std::uint8_t> writable_labels(const py::object& object, const char* name) {
  const auto array = vector_of<std::uint8_t>(object, name);
  if (array.ptr() != object.ptr()) {
    throw py::value_error(std::string(name) + ": a contiguous array is needed, to be written to");
  }
  auto writable = array;
  return {writable.mutable_data(), static_cast<std::size_t>(array.size())};  // throws if it is not
}

ScanResult add_scan(LockedPipeline& pipeline, const py::object& points, const py::object& pose,
                    std::int64_t stamp_ns, const py::object& intensities) {
  PointArray scan = points_of(points, "points");
  py::array_t<std::uint8_t> bytes;
  if (!intensities.is_none()) {
    bytes = vector_of<std::uint8_t>(intensities, "intensities");
    if (static_cast<std::size_t>(bytes.size()) != scan.view.count) {
      throw py::value_error("intensities: one for each point is needed");
    }
    scan.view.intensities = bytes.data();
  }
  const Pose T_odometry_sensor = pose_of(pose, "T_odometry_sensor");
  const py::gil_scoped_release release;
  return pipeline.add_scan(scan.view, T_odometry_sensor, stamp_ns);
}

py::object labels_of(LockedPipeline& pipeline, std::int64_t scan, const py::object& out) {
  if (out.is_none()) {
    std::vector<std::uint8_t> labels;
    {
      const py::gil_scoped_release release;
      labels = pipeline.labels(scan);
    }
    return array_from(std::move(labels));
  }
  const std::span<std::uint8_t> target = writable_labels(out, "out");
  const py::gil_scoped_release release;
  pipeline.labels_into(scan, target);
  return out;
}

std::size_t relabel(LockedPipeline& pipeline, const py::object& points, const py::object& pose,
                    const py::object& labels) {
  const PointArray scan = points_of(points, "points");
  const Pose T_odometry_sensor = rigid_pose_of(pose, "T_odometry_sensor");
  const std::span<std::uint8_t> target = writable_labels(labels, "labels");
  if (target.size() != scan.view.count) {
    throw py::value_error("labels: there are " + std::to_string(scan.view.count) + " points, not " +
                          std::to_string(target.size()));
  }
  const py::gil_scoped_release release;
  return pipeline.relabel(scan.view, T_odometry_sensor, target);
}

py::object sequence_or_none(const RelabelledKeyframe& relabelled) {
  if (!relabelled.available) return py::none();
  return py::int_(relabelled.sequence);
}

py::bytes encoded(LockedPipeline& pipeline, std::uint32_t robot, std::uint64_t boot) {
  std::vector<std::uint8_t> bytes;
  {
    const py::gil_scoped_release release;
    bytes = pipeline.encode({robot, boot});
  }
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

py::object relabelled(LockedPipeline& pipeline) {
  RelabelledKeyframe keyframe;
  {
    const py::gil_scoped_release release;
    keyframe = pipeline.relabelled();
  }
  return sequence_or_none(keyframe);
}

py::object relabel_next(LockedPipeline& pipeline) {
  RelabelledKeyframe keyframe;
  {
    const py::gil_scoped_release release;
    keyframe = pipeline.relabel_next();
  }
  return sequence_or_none(keyframe);
}

void insert_place(LockedPipeline& pipeline, const Place& place, std::uint32_t session,
                  std::uint32_t keyframe, const py::object& T_session_place) {
  if (session == 0) throw py::value_error("session: 0 is the pipeline's own; others begin at 1");
  const Pose pose = rigid_pose_of(T_session_place, "T_session_place");
  const py::gil_scoped_release release;
  pipeline.insert_place(place, {session, keyframe}, pose);
}

void bind_results(py::module_& module) {
  py::enum_<ErrorCode>(module, "ErrorCode", "Why a scan was refused.")
      .value("OK", ErrorCode::kOk)
      .value("INVALID_CONFIG", ErrorCode::kInvalidConfig)
      .value("MEMORY_TOO_SMALL", ErrorCode::kMemoryTooSmall)
      .value("MEMORY_MISALIGNED", ErrorCode::kMemoryMisaligned)
      .value("INVALID_POSE", ErrorCode::kInvalidPose)
      .value("TIME_REVERSED", ErrorCode::kTimeReversed)
      .value("EMPTY_SCAN", ErrorCode::kEmptyScan)
      .value("POSE_JUMP", ErrorCode::kPoseJump)
      .value("CAPACITY_EXCEEDED", ErrorCode::kCapacityExceeded)
      .value("INVALID_KEYFRAME", ErrorCode::kInvalidKeyframe)
      .value("BUFFER_TOO_SMALL", ErrorCode::kBufferTooSmall)
      .value("TIME_JUMP", ErrorCode::kTimeJump);
  py::class_<ScanResult>(module, "ScanResult",
                         "What became of a scan. A refused one may close a keyframe, too.")
      .def_property_readonly(
          "ok", [](const ScanResult& r) { return r.error.ok(); }, "Whether the scan was accepted.")
      .def_property_readonly(
          "error", [](const ScanResult& r) { return r.error.code; }, "`ErrorCode`.")
      .def_property_readonly(
          "message", [](const ScanResult& r) { return std::string(r.error.message); },
          "Why it was refused, or empty.")
      .def_readonly("keyframe_ready", &ScanResult::keyframe_ready,
                    "`keyframe()` and `labels()` may be asked.")
      .def_readonly("keyframe_finished", &ScanResult::keyframe_finished,
                    "`finished_keyframe()`, `encode()` and `relabel()` may be asked.");
  py::class_<WorkResult>(module, "WorkResult", "What a call of `Pipeline.work` left.")
      .def_readonly("work_left", &WorkResult::work_left)
      .def_readonly("keyframe_ready", &WorkResult::keyframe_ready)
      .def_readonly("keyframe_finished", &WorkResult::keyframe_finished);
}

}  // namespace

void bind_pipeline(py::module_& module) {
  bind_results(module);
  module.attr("UNKNOWN") = static_cast<int>(PointLabel::kUnknown);
  module.attr("STATIC") = static_cast<int>(PointLabel::kStatic);
  module.attr("DYNAMIC") = static_cast<int>(PointLabel::kDynamic);
  using Release = py::call_guard<py::gil_scoped_release>;
  py::class_<LockedPipeline>(
      module, "Pipeline",
      "Scans and odometry poses in, labels and keyframes out.\n\n"
      "One block of memory, taken here. Long calls release the GIL; calls of several threads\n"
      "wait for each other. `unimapper.STATIC`, `DYNAMIC` and `UNKNOWN` are the labels.")
      .def(py::init<const PipelineConfig&>(), py::arg("config"), Release())
      .def("add_scan", &add_scan, py::arg("points"), py::arg("T_odometry_sensor"),
           py::arg("stamp_ns"), py::arg("intensities") = py::none(),
           "Adds a motion-compensated scan; returns a `ScanResult`.\n\n"
           "points: (N, 3) or (N, 4) float32, metres in the sensor's frame; not copied; NaN is "
           "skipped.\nT_odometry_sensor: (4, 4), metres; the odometry's z points up.\n"
           "stamp_ns: nanoseconds, later than the last one.\n"
           "intensities: (N,) uint8, of each point; read with the parameter `intensity`.")
      .def("flush", &LockedPipeline::flush, Release(),
           "Closes a keyframe that has fewer scans than configured: at the end, until neither is "
           "set.")
      .def("work", &LockedPipeline::work, py::arg("budget_us") = 0, Release(),
           "With `deferred`: does more of the work between scans; returns a `WorkResult`.")
      .def(
          "keyframe", [](LockedPipeline& p) { return p.keyframe(false); }, Release(),
          "The keyframe that is ready, copied.")
      .def(
          "finished_keyframe", [](LockedPipeline& p) { return p.keyframe(true); }, Release(),
          "The keyframe that is finished, copied: with place and loops.")
      .def("labels", &labels_of, py::arg("scan_in_keyframe"), py::arg("out") = py::none(),
           "Labels of a scan of `keyframe()`: (N,) uint8 in the order of its points.\n\n"
           "out: a (N,) uint8 array that they are written into, and which is returned.")
      .def("relabelled", &relabelled,
           "Number of the keyframe that left the window in the last call, or None: its labels are "
           "final.")
      .def("relabel_next", &relabel_next,
           "After `flush`: relabels the next keyframe of the window; its number, or None.")
      .def("relabel", &relabel, py::arg("points"), py::arg("T_odometry_sensor"), py::arg("labels"),
           "Applies the final labels of the keyframe that `relabelled` or `relabel_next` named to "
           "one of\nits scans: points and pose as given to `add_scan`, labels changed in place. "
           "Returns how many.")
      .def("encode", &encoded, py::arg("robot") = 0, py::arg("boot") = 0,
           "The finished keyframe as bytes (docs/wire-format.md), for `Session.add_keyframe`.\n"
           "robot, boot: identity of the session.")
      .def("insert_place", &insert_place, py::arg("place"), py::arg("session"), py::arg("keyframe"),
           py::arg("T_session_place"),
           "Lets loop search find a place of an earlier run; sessions begin at 1.")
      .def_property_readonly(
          "config", [](LockedPipeline& p) { return PipelineConfig(p.config()); },
          "A copy of its configuration.")
      .def_property_readonly("bytes", &LockedPipeline::bytes, "Memory of the pipeline.");
}

}  // namespace unimapper::python
