// Tests of the C interface: agreement with C++, misuse and invalid input.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "c_pipeline.hpp"
#include "tests/onboard/run.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr int kScans = 30;

std::vector<LabelledScan> walker_scans() {
  const Scene scene = scene_with_walker();
  std::vector<LabelledScan> scans;
  for (int i = 0; i < kScans; ++i) scans.push_back(scene.scan(driving(i), 0.1 * i));
  return scans;
}

/// Everything a keyframe says.
struct Keyframe {
  um_keyframe view;
  std::vector<um_scan> scans;
  std::vector<std::vector<std::uint8_t>> labels;
  std::vector<um_cell> static_cells;
  std::vector<um_cell> dynamic_cells;
  std::vector<um_keypoint> keypoints;
  std::vector<um_plane> planes;
};

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

Keyframe read_keyframe(um_pipeline* pipeline, const std::vector<LabelledScan>& scans) {
  Keyframe out;
  out.view.struct_size = sizeof(um_keyframe);
  REQUIRE(um_keyframe_get(pipeline, &out.view) == UM_OK);
  const um_keyframe& view = out.view;
  out.scans.assign(view.scans, view.scans + view.scan_count);
  out.static_cells.assign(view.static_cells, view.static_cells + view.static_cell_count);
  out.dynamic_cells.assign(view.dynamic_cells, view.dynamic_cells + view.dynamic_cell_count);
  out.keypoints.assign(view.keypoints, view.keypoints + view.keypoint_count);
  out.planes.assign(view.planes, view.planes + view.plane_count);
  for (std::uint32_t s = 0; s < view.scan_count; ++s) {
    std::vector<std::uint8_t> labels(scans[out.scans[s].scan_index].points.size() + 1);
    std::size_t written = 0;
    REQUIRE(um_labels(pipeline, s, labels.data(), labels.size(), &written) == UM_OK);
    REQUIRE(written + 1 == labels.size());
    labels.pop_back();
    out.labels.push_back(labels);
  }
  return out;
}

std::vector<Keyframe> run_c(um_pipeline* pipeline, const std::vector<LabelledScan>& scans) {
  std::vector<Keyframe> keyframes;
  for (int i = 0; i < kScans; ++i) {
    const um_points points = points_of(scans[static_cast<std::size_t>(i)]);
    const um_pose pose = pose_of(driving(i));
    std::int32_t ready = -1;
    REQUIRE(um_add_scan(pipeline, &points, &pose, 1 + i * std::int64_t{100000000}, &ready) ==
            UM_OK);
    if (ready == 1) keyframes.push_back(read_keyframe(pipeline, scans));
  }
  return keyframes;
}

um_status add_one(um_pipeline* pipeline, const um_points& points, std::int64_t stamp_ns) {
  const um_pose pose = pose_of(driving(0));
  return um_add_scan(pipeline, &points, &pose, stamp_ns, nullptr);
}

bool says_something(const char* sentence) {
  return sentence != nullptr && std::strlen(sentence) > 15;
}

}  // namespace

TEST_CASE("C gives the labels, cells and places that C++ gives") {
  const auto scans = walker_scans();
  const CPipeline pipeline;
  const auto from_c = run_c(pipeline.get(), scans);
  const auto from_cpp = run_scene(scene_with_walker(), small_config(), kScans, [](double t) {
    return driving(static_cast<int>(10.0 * t + 0.5));
  });
  REQUIRE(from_c.size() == 3);
  REQUIRE(from_cpp.size() == from_c.size());
  std::uint64_t dynamic_points = 0;
  for (std::size_t k = 0; k < from_c.size(); ++k) {
    const Keyframe& c = from_c[k];
    const KeyframeRun& cpp = from_cpp[k];
    REQUIRE(c.labels.size() == cpp.labels.size());
    for (std::size_t s = 0; s < c.labels.size(); ++s) {
      REQUIRE(c.labels[s].size() == cpp.labels[s].size());
      CHECK(std::memcmp(c.labels[s].data(), cpp.labels[s].data(), c.labels[s].size()) == 0);
    }
    CHECK(c.static_cells.size() == cpp.static_cells.size());
    CHECK(c.dynamic_cells.size() == cpp.dynamic_cells.size());
    for (std::size_t i = 0; i < c.static_cells.size(); ++i) {
      REQUIRE(std::memcmp(c.static_cells[i].position, cpp.static_cells[i].position.data(), 12) ==
              0);
      REQUIRE(c.static_cells[i].points == cpp.static_cells[i].points);
      REQUIRE(c.static_cells[i].ground == cpp.static_cells[i].ground);
    }
    CHECK(c.view.sequence == k);
    CHECK(c.view.reference_scan == 5);
    CHECK(c.scans[3].scan_index == 10 * k + 3);
    CHECK(c.view.statistics.points_dynamic == cpp.statistics.points_dynamic);
    CHECK(c.view.statistics.cells == cpp.statistics.cells);
    CHECK(c.view.statistics.capacity[UM_CAPACITY_CELLS].capacity == 65536);
    CHECK(c.view.statistics.dropped[UM_DROP_OUT_OF_RANGE] ==
          cpp.statistics.dropped_by(DropCause::kOutOfRange));
    dynamic_points += c.view.statistics.points_dynamic;
  }
  // The walker is seen: equality of nothing would prove nothing.
  CHECK(dynamic_points > 100);
  CHECK_FALSE(from_c[0].planes.empty());
}

TEST_CASE("C tells what the scans say of the sensor, of the poses and of up") {
  Scene scene;  // 40 rings of 720 columns: no HDL-64E
  scene.boxes = {standing_box({20.0, 9.0, 3.0}, {40.0, 0.5, 3.0}),
                 standing_box({30.0, 0.0, 3.0}, {0.5, 9.0, 3.0}),
                 standing_box({12.0, -4.0, 0.8}, {2.0, 0.9, 0.8})};
  const auto given = [](double t) {
    Pose pose = sensor_at(2.0 * t, 0.0);
    // Noise of a degree, as the sine of large numbers.
    const double angle = 0.0175 * std::sin(1000.0 * t * t);
    pose.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    return pose;
  };
  OwnedPipeline cpp(small_config());
  REQUIRE(cpp);
  const CPipeline c;
  bool noisy = false;
  bool up_known = false;
  for (int i = 0; i < kScans; ++i) {
    const double t = 0.1 * i;
    const LabelledScan scan = scene.scan(sensor_at(2.0 * t, 0.0), t);
    const um_points points = points_of(scan);
    const um_pose pose = pose_of(given(t));
    std::int32_t ready = 0;
    REQUIRE(um_add_scan(c.get(), &points, &pose, 1 + i, &ready) == UM_OK);
    REQUIRE(cpp->add_scan(scan.view(), given(t), 1 + i).keyframe_ready == (ready == 1));
    if (ready == 0) continue;
    um_keyframe keyframe;
    keyframe.struct_size = sizeof keyframe;
    REQUIRE(um_keyframe_get(c.get(), &keyframe) == UM_OK);
    const um_input& input = keyframe.input;
    const KeyframeStatistics& expected = *cpp->keyframe().statistics;
    CHECK(input.ray_spacing_deg == Approx(0.5).epsilon(0.1));
    CHECK(input.ray_spacing_deg == expected.sampling.ray_spacing_deg);
    CHECK(input.ring_spacing_deg == expected.sampling.ring_spacing_deg);
    CHECK(input.rays_differ == 1);
    CHECK(input.elevations_differ == (expected.sampling.elevations_differ ? 1U : 0U));
    CHECK(input.image_elevation_min_deg == expected.sampling.image_elevation_min_deg);
    CHECK(input.image_elevation_max_deg == expected.sampling.image_elevation_max_deg);
    CHECK(input.mode_changes == expected.sampling.changes);
    CHECK(input.attitude_noise_deg == expected.attitude_noise_deg);
    CHECK(keyframe.statistics.attitude_noise_deg == expected.attitude_noise_deg);
    CHECK(input.sweep_tilt_deg == expected.sweep_tilt_deg);
    CHECK(input.aligned_scans == expected.aligned_scans);
    CHECK(input.up_known == (expected.up_known ? 1U : 0U));
    CHECK(input.odometry_tilt_deg == expected.odometry_tilt_deg);
    CHECK((input.up_sigma_deg > 0.01F) == expected.up_known);
    CHECK(input.up_sigma_deg < 3.0F);
    noisy |= input.attitude_noise_deg > 0.3F && input.aligned_scans > 0;
    up_known |= input.up_known == 1;
  }
  // Equality of nothing would prove nothing.
  CHECK(noisy);
  CHECK(up_known);
}

TEST_CASE("a keyframe is told to programs that know fewer of its members") {
  const auto scan = walker_scans()[0];
  const CPipeline pipeline;
  REQUIRE(add_one(pipeline.get(), points_of(scan), 1) == UM_OK);
  REQUIRE(um_flush(pipeline.get(), nullptr) == UM_OK);
  for (const std::size_t size : {offsetof(um_keyframe, up_known), offsetof(um_keyframe, input),
                                 offsetof(um_keyframe, repeats)}) {
    um_keyframe keyframe;
    std::memset(static_cast<void*>(&keyframe), 0x5A, sizeof keyframe);
    keyframe.struct_size = static_cast<std::uint32_t>(size);
    REQUIRE(um_keyframe_get(pipeline.get(), &keyframe) == UM_OK);
    CHECK(keyframe.struct_size == size);
    CHECK(keyframe.scan_count == 1);
    const auto* const bytes = reinterpret_cast<const unsigned char*>(&keyframe);
    CHECK(std::all_of(bytes + size, bytes + sizeof keyframe,
                      [](unsigned char byte) { return byte == 0x5A; }));
  }
}

TEST_CASE("the pose of a keyframe levels its reference scan") {
  const auto scans = walker_scans();
  const CPipeline pipeline;
  const auto keyframes = run_c(pipeline.get(), scans);
  const um_pose& keyframe = keyframes[0].view.T_odometry_keyframe;
  const um_pose& reference = keyframes[0].scans[keyframes[0].view.reference_scan].T_odometry_sensor;
  CHECK(std::memcmp(&reference, pose_of(driving(5)).m, sizeof reference) == 0);
  for (const int row : {0, 1, 2}) CHECK(keyframe.m[4 * row + 3] == reference.m[4 * row + 3]);
  CHECK(keyframe.m[10] == 1.0);
}

TEST_CASE("after a reset the same input gives the same results") {
  const auto scans = walker_scans();
  const CPipeline pipeline;
  const auto first = run_c(pipeline.get(), scans);
  REQUIRE(um_reset(pipeline.get()) == UM_OK);
  const auto second = run_c(pipeline.get(), scans);
  REQUIRE(first.size() == second.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    CHECK(first[k].view.sequence == second[k].view.sequence);
    CHECK(first[k].labels == second[k].labels);
    CHECK(same_bytes(first[k].scans, second[k].scans));
    CHECK(same_bytes(first[k].static_cells, second[k].static_cells));
    CHECK(same_bytes(first[k].dynamic_cells, second[k].dynamic_cells));
    CHECK(same_bytes(first[k].planes, second[k].planes));
    CHECK(first[k].keypoints.size() == second[k].keypoints.size());
  }
}

TEST_CASE("points are read through any stride and offsets") {
  const auto scan = walker_scans()[0];
  std::vector<std::byte> bytes(scan.points.size() * 21 + 1);
  const auto put = [&](std::size_t at, float value) { std::memcpy(&bytes[at], &value, 4); };
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    put(1 + 21 * i + 5, scan.points[i].z());
    put(1 + 21 * i + 9, scan.points[i].x());
    put(1 + 21 * i + 13, scan.points[i].y());
  }
  const um_points odd = {&bytes[1], scan.points.size(), 21, 9, 13, 5};
  const um_points plain = points_of(scan);
  std::vector<Keyframe> keyframes;
  for (const um_points& points : {odd, plain}) {
    const CPipeline pipeline;
    REQUIRE(add_one(pipeline.get(), points, 1) == UM_OK);
    std::int32_t ready = 0;
    REQUIRE(um_flush(pipeline.get(), &ready) == UM_OK);
    REQUIRE(ready == 1);
    keyframes.push_back(read_keyframe(pipeline.get(), {scan}));
  }
  CHECK(keyframes[0].labels == keyframes[1].labels);
  CHECK(same_bytes(keyframes[0].static_cells, keyframes[1].static_cells));
}

TEST_CASE("views of points that cannot be right are refused and leave no trace") {
  const auto scan = walker_scans()[0];
  const um_points good = points_of(scan);
  const CPipeline pipeline;
  um_points bad[4] = {good, good, good, good};
  bad[0].data = nullptr;
  bad[1].stride = 3;
  bad[2].count = static_cast<std::size_t>(-1) / 2;
  bad[3].offset_z = static_cast<std::size_t>(-1);
  for (const um_points& points : bad) {
    CHECK(add_one(pipeline.get(), points, 1) == UM_INVALID_POINTS);
    CHECK(says_something(um_message(pipeline.get())));
  }
  // A stride of one float is the least there is.
  um_points every_float = good;
  every_float.stride = 4;
  CHECK(add_one(CPipeline().get(), every_float, 1) == UM_OK);
  const um_points none = {nullptr, 0, 0, 0, 0, 0};
  CHECK(add_one(pipeline.get(), none, 1) == UM_EMPTY_SCAN);
  REQUIRE(add_one(pipeline.get(), good, 1) == UM_OK);
  CHECK(std::string(um_message(pipeline.get())).empty());
  CHECK(add_one(pipeline.get(), good, 1) == UM_TIME_REVERSED);
  CHECK(says_something(um_message(pipeline.get())));
  um_pose nothing;
  std::memset(&nothing, 0, sizeof nothing);
  CHECK(um_add_scan(pipeline.get(), &good, &nothing, 2, nullptr) == UM_INVALID_POSE);
  CHECK(add_one(pipeline.get(), good, 2) == UM_OK);
}

TEST_CASE("a jump refuses the scan and closes the keyframe, both are told") {
  const auto scan = walker_scans()[0];
  const um_points points = points_of(scan);
  const CPipeline pipeline;
  REQUIRE(add_one(pipeline.get(), points, 1) == UM_OK);
  const um_pose far = pose_of(sensor_at(50.0, 0.0));
  std::int32_t ready = 0;
  CHECK(um_add_scan(pipeline.get(), &points, &far, 2, &ready) == UM_POSE_JUMP);
  CHECK(ready == 1);
  CHECK(read_keyframe(pipeline.get(), {scan}).view.scan_count == 1);
}

TEST_CASE("there is a keyframe only right after the call that closed it") {
  const auto scan = walker_scans()[0];
  const CPipeline pipeline;
  um_keyframe keyframe;
  keyframe.struct_size = sizeof keyframe;
  std::uint8_t label = 7;
  std::size_t written = 1;
  std::int32_t ready = 1;
  CHECK(um_keyframe_get(pipeline.get(), &keyframe) == UM_NO_KEYFRAME);
  CHECK(um_labels(pipeline.get(), 0, &label, 1, &written) == UM_NO_KEYFRAME);
  CHECK(written == 0);
  CHECK(um_flush(pipeline.get(), &ready) == UM_OK);
  CHECK(ready == 0);
  REQUIRE(add_one(pipeline.get(), points_of(scan), 1) == UM_OK);
  CHECK(um_keyframe_get(pipeline.get(), &keyframe) == UM_NO_KEYFRAME);
  REQUIRE(um_flush(pipeline.get(), &ready) == UM_OK);
  REQUIRE(ready == 1);
  CHECK(um_labels(pipeline.get(), 1, &label, 1, &written) == UM_INVALID_INDEX);
  CHECK(um_labels(pipeline.get(), 0, &label, 1, &written) == UM_OK);
  CHECK(written == 1);
  CHECK(label == UM_LABEL_STATIC);
  REQUIRE(add_one(pipeline.get(), points_of(scan), 2) == UM_OK);
  CHECK(um_keyframe_get(pipeline.get(), &keyframe) == UM_NO_KEYFRAME);
}

TEST_CASE("every keyframe is relabelled once, and its labels follow") {
  const auto scans = walker_scans();
  const CPipeline pipeline;
  const std::vector<Keyframe> keyframes = run_c(pipeline.get(), scans);
  REQUIRE(keyframes.size() == 3);
  um_relabelled relabelled;
  REQUIRE(um_relabelled_get(pipeline.get(), &relabelled) == UM_OK);
  CHECK(relabelled.available == 0);
  for (std::uint32_t k = 0; k < 3; ++k) {
    std::int32_t there = 0;
    REQUIRE(um_relabel_next(pipeline.get(), &there) == UM_OK);
    REQUIRE(there == 1);
    REQUIRE(um_relabelled_get(pipeline.get(), &relabelled) == UM_OK);
    CHECK(relabelled.sequence == k);
    CHECK(relabelled.later_keyframes == 2 - k);
    std::size_t all = 0;
    for (std::size_t s = 0; s < keyframes[k].scans.size(); ++s) {
      const std::uint32_t index = keyframes[k].scans[s].scan_index;
      std::vector<std::uint8_t> labels = keyframes[k].labels[s];
      const um_points points = points_of(scans[index]);
      const um_pose pose = pose_of(driving(static_cast<int>(index)));
      std::size_t changed = 0;
      REQUIRE(um_relabel(pipeline.get(), &points, &pose, labels.data(), labels.size(), &changed) ==
              UM_OK);
      std::size_t different = 0;
      for (std::size_t i = 0; i < labels.size(); ++i) {
        different += labels[i] != keyframes[k].labels[s][i] ? 1 : 0;
      }
      CHECK(different == changed);
      all += changed;
    }
    CHECK((all > 0) == (relabelled.cells_now_dynamic + relabelled.cells_now_static > 0));
  }
  std::int32_t there = 1;
  CHECK(um_relabel_next(pipeline.get(), &there) == UM_OK);
  CHECK(there == 0);
}

TEST_CASE("null pointers and things that are no pipeline are refused") {
  um_event no_event;
  CHECK(um_event_pop(nullptr, &no_event) == UM_INVALID_HANDLE);
  CHECK(um_events_lost(nullptr) == 0);
  const CPipeline pipeline;
  const um_points points = {nullptr, 0, 0, 0, 0, 0};
  const um_pose pose = pose_of(driving(0));
  CHECK(um_add_scan(pipeline.get(), nullptr, &pose, 1, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_add_scan(pipeline.get(), &points, nullptr, 1, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_keyframe_get(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_labels(pipeline.get(), 0, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabelled_get(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel_next(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel(pipeline.get(), nullptr, &pose, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel(nullptr, &points, &pose, nullptr, 0, nullptr) == UM_INVALID_HANDLE);
  CHECK(um_pose_from_quaternion(nullptr, nullptr, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_sensor_find(nullptr, nullptr) == UM_NULL_ARGUMENT);

  alignas(UM_ALIGNMENT) static unsigned char garbage[65536];
  std::memset(garbage, 0x5A, sizeof garbage);
  auto* const no_pipeline = reinterpret_cast<um_pipeline*>(garbage);
  auto* const crooked = reinterpret_cast<um_pipeline*>(garbage + 1);
  for (um_pipeline* const wrong : {static_cast<um_pipeline*>(nullptr), no_pipeline, crooked}) {
    CHECK(um_add_scan(wrong, &points, &pose, 1, nullptr) == UM_INVALID_HANDLE);
    CHECK(um_flush(wrong, nullptr) == UM_INVALID_HANDLE);
    CHECK(um_reset(wrong) == UM_INVALID_HANDLE);
    CHECK(says_something(um_message(wrong)));
  }
}

TEST_CASE("events are taken out one by one, oldest first, and a full ring counts what it lost") {
  um_config config = small_c_config();
  um_event event;
  {
    const CPipeline silent(config);
    CHECK(um_event_pop(silent.get(), &event) == UM_NO_EVENT);
    CHECK(um_events_lost(silent.get()) == 0);
  }
  config.event_capacity = 4;
  CPipeline pipeline(config);
  const auto scans = walker_scans();
  const um_points nothing{nullptr, 0, 12, 0, 4, 8};
  CHECK(add_one(pipeline.get(), nothing, 5) == UM_EMPTY_SCAN);
  CHECK(um_event_pop(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
  REQUIRE(um_event_pop(pipeline.get(), &event) == UM_OK);
  CHECK(event.id == UM_EVENT_SCAN_REFUSED);
  CHECK(event.stamp_ns == 5);
  CHECK(event.values[0] == UM_EMPTY_SCAN);
  CHECK(um_event_pop(pipeline.get(), &event) == UM_NO_EVENT);

  REQUIRE(add_one(pipeline.get(), points_of(scans[0]), 6) == UM_OK);
  REQUIRE(um_flush(pipeline.get(), nullptr) == UM_OK);
  REQUIRE(um_event_pop(pipeline.get(), &event) == UM_OK);
  CHECK(event.id == UM_EVENT_KEYFRAME_CLOSED);
  CHECK(event.values[0] == 0);
  CHECK(event.values[1] == 1);

  // That scan was measured: the empty one before it was not.
  REQUIRE(um_event_pop(pipeline.get(), &event) == UM_OK);
  CHECK(event.id == UM_EVENT_SAMPLING_DIFFERS);
  while (um_event_pop(pipeline.get(), &event) == UM_OK) {
  }

  for (int i = 0; i < 7; ++i) CHECK(add_one(pipeline.get(), nothing, 10 + i) == UM_EMPTY_SCAN);
  CHECK(um_events_lost(pipeline.get()) == 3);
  REQUIRE(um_event_pop(pipeline.get(), &event) == UM_OK);
  CHECK(event.stamp_ns == 10);

  REQUIRE(um_reset(pipeline.get()) == UM_OK);
  CHECK(um_event_pop(pipeline.get(), &event) == UM_NO_EVENT);
  CHECK(um_events_lost(pipeline.get()) == 0);
}

TEST_CASE("a keyframe struct of another version is refused") {
  const auto scan = walker_scans()[0];
  const CPipeline pipeline;
  REQUIRE(add_one(pipeline.get(), points_of(scan), 1) == UM_OK);
  REQUIRE(um_flush(pipeline.get(), nullptr) == UM_OK);
  um_keyframe keyframe;
  for (const std::size_t size : {std::size_t{0}, sizeof keyframe + 8, sizeof keyframe - 8}) {
    keyframe.struct_size = static_cast<std::uint32_t>(size);
    CHECK(um_keyframe_get(pipeline.get(), &keyframe) == UM_UNKNOWN_VERSION);
    CHECK(says_something(um_message(pipeline.get())));
  }
}

TEST_CASE("a quaternion and a translation make a pose") {
  const double quarter_turn[4] = {0.0, 0.0, 2.0, 2.0};
  const double translation[3] = {1.0, 2.0, 3.0};
  um_pose pose;
  REQUIRE(um_pose_from_quaternion(quarter_turn, translation, &pose) == UM_OK);
  const double expected[12] = {0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3};
  for (int i = 0; i < 12; ++i) CHECK(pose.m[i] == Approx(expected[i]).margin(1e-12));
  const double zero[4] = {};
  const double nan[4] = {0.0, 0.0, std::nan(""), 1.0};
  CHECK(um_pose_from_quaternion(zero, translation, &pose) == UM_INVALID_POSE);
  CHECK(um_pose_from_quaternion(nan, translation, &pose) == UM_INVALID_POSE);
}

TEST_CASE("every status has a sentence, every number of the statistics a name") {
  for (um_status status = UM_INVALID_CONFIG; status <= UM_TIME_JUMP; ++status) {
    CHECK(says_something(um_status_text(status)));
  }
  for (um_status status = UM_NULL_ARGUMENT; status <= UM_UNKNOWN_SENSOR; ++status) {
    CHECK(says_something(um_status_text(status)));
  }
  CHECK(std::string(um_status_text(-5)) == "unknown status");
  CHECK(std::string(um_drop_cause_name(UM_DROP_CELLS_FULL)) == "cells_full");
  CHECK(std::string(um_stage_name(UM_STAGE_TOTAL)) == "total");
  CHECK(std::string(um_capacity_name(UM_CAPACITY_PLACES)) == "places");
  CHECK(um_drop_cause_name(8) == nullptr);
  CHECK(um_stage_name(5) == nullptr);
  CHECK(um_capacity_name(5) == nullptr);
}

TEST_CASE("the library tells its version") {
  CHECK(um_version() == UM_VERSION);
  CHECK(std::string(um_version_text()) == "0.1.0");
}
