// Tests of the C interface: agreement with C++, misuse and invalid input.
#include "c_pipeline.hpp"
#include "tests/onboard/run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

bool says_something(const char* sentence) {
  return sentence != nullptr && std::strlen(sentence) > 15;
}

bool same(const um_pose& c, const Pose& cpp) {
  const um_pose expected = pose_of(cpp);
  return std::memcmp(&c, &expected, sizeof c) == 0;
}

template <typename C, typename Cpp>
bool same_bytes(const C* c, std::size_t count, std::span<const Cpp> cpp) {
  static_assert(sizeof(C) == sizeof(Cpp));
  return count == cpp.size() && (count == 0 || std::memcmp(c, cpp.data(), cpp.size_bytes()) == 0);
}

void check_same(const um_input& c, const KeyframeStatistics& cpp) {
  const SamplingStatistics& sampling = cpp.sampling;
  CHECK(std::tuple(c.ray_spacing_deg, c.ring_spacing_deg, c.image_elevation_min_deg,
                   c.image_elevation_max_deg, c.mode_changes) ==
        std::tuple(sampling.ray_spacing_deg, sampling.ring_spacing_deg,
                   sampling.image_elevation_min_deg, sampling.image_elevation_max_deg,
                   sampling.changes));
  CHECK(std::tuple(c.attitude_noise_deg, c.sweep_tilt_deg, c.aligned_scans, c.odometry_tilt_deg) ==
        std::tuple(cpp.attitude_noise_deg, cpp.sweep_tilt_deg, cpp.aligned_scans,
                   cpp.odometry_tilt_deg));
  CHECK((c.rays_differ == 1) == sampling.rays_differ);
  CHECK((c.elevations_differ == 1) == sampling.elevations_differ);
  CHECK((c.up_known == 1) == cpp.up_known);
}

void check_same(const um_keyframe& c, const KeyframeView& cpp) {
  CHECK(c.sequence == cpp.sequence);
  CHECK(c.reference_scan == cpp.reference_scan);
  CHECK(same(c.T_odometry_keyframe, cpp.T_odometry_keyframe));
  REQUIRE(c.scan_count == cpp.scans.size());
  for (std::size_t s = 0; s < cpp.scans.size(); ++s) {
    CHECK(c.scans[s].scan_index == cpp.scans[s].scan_index);
    CHECK(c.scans[s].stamp_ns == cpp.scans[s].stamp_ns);
    CHECK(same(c.scans[s].T_odometry_sensor, cpp.scans[s].T_odometry_sensor));
  }
  CHECK(same_bytes(c.static_cells, c.static_cell_count, cpp.static_cells));
  CHECK(same_bytes(c.dynamic_cells, c.dynamic_cell_count, cpp.dynamic_cells));
  CHECK(same_bytes(c.planes, c.plane_count, cpp.place.planes));
  CHECK(c.keypoint_count == cpp.place.keypoints.size());
  CHECK(KeyframeUp{c.up_known == 1, c.up_covariance[0], c.up_covariance[1], c.up_covariance[2]} ==
        cpp.up);
  CHECK(c.statistics.points_dynamic == cpp.statistics->points_dynamic);
  CHECK(c.statistics.cells == cpp.statistics->cells);
  CHECK(c.statistics.capacity[UM_CAPACITY_CELLS].capacity == small_config().voxel.max_cells);
  const auto& dropped = cpp.statistics->dropped;
  CHECK(std::equal(dropped.begin(), dropped.end(), c.statistics.dropped));
  CHECK(c.statistics.attitude_noise_deg == cpp.statistics->attitude_noise_deg);
  check_same(c.input, *cpp.statistics);
}

/// The same scans through both interfaces.
struct Twins {
  const CPipeline& c;
  OwnedPipeline cpp{small_config()};

  /// True if both have a keyframe, which is the same then.
  bool add(const LabelledScan& scan, const Pose& T_odometry_sensor, std::int64_t stamp_ns) {
    const um_points points = points_of(scan);
    const um_pose pose = pose_of(T_odometry_sensor);
    std::int32_t ready = -1;
    REQUIRE(um_add_scan(c, &points, &pose, stamp_ns, &ready) == UM_OK);
    const ScanResult result = cpp->add_scan(scan.view(), T_odometry_sensor, stamp_ns);
    REQUIRE(ready == (result.keyframe_ready ? 1 : 0));
    if (result.keyframe_ready) check_same(c.keyframe(), cpp->keyframe());
    return result.keyframe_ready;
  }
  /// Labels of a scan of the keyframe, which are the same; there is room for one more.
  std::vector<std::uint8_t> labels(std::size_t scan, std::size_t points) {
    std::vector<std::uint8_t> from_c(points + 1);
    std::vector<PointLabel> expected(points);
    std::size_t written = 0;
    REQUIRE(um_labels(c, static_cast<std::uint32_t>(scan), from_c.data(), from_c.size(),
                      &written) == UM_OK);
    REQUIRE(written == points);
    REQUIRE(cpp->labels(scan, expected) == points);
    from_c.pop_back();
    CHECK(std::memcmp(from_c.data(), expected.data(), points) == 0);
    return from_c;
  }
};

}  // namespace

TEST_CASE("C gives the labels, cells, places and final labels that C++ gives, after a reset too") {
  const CPipeline pipeline;
  for (int round = 0; round < 2; ++round) {
    Twins twins{pipeline};
    std::vector<std::vector<std::uint8_t>> labels;
    std::uint64_t dynamic_points = 0;
    for (int i = 0; i < kScans; ++i) {
      if (!twins.add(walker_scan(i), driving(i), stamp_of(i))) continue;
      for (std::size_t s = 0; s < 10; ++s) {
        labels.push_back(
            twins.labels(s, walker_scan(static_cast<int>(labels.size())).points.size()));
      }
      dynamic_points += pipeline.keyframe().statistics.points_dynamic;
      CHECK(pipeline.keyframe().plane_count > 0);
    }
    // The walker is seen: equality of nothing would prove nothing.
    CHECK(dynamic_points > 100);
    REQUIRE(labels.size() == kScans);

    um_relabelled relabelled;
    REQUIRE(um_relabelled_get(pipeline, &relabelled) == UM_OK);
    CHECK(relabelled.available == 0);
    std::int32_t there = 0;
    for (int i = 0; i < kScans; ++i) {
      if (i % 10 == 0) {
        REQUIRE(um_relabel_next(pipeline, &there) == UM_OK);
        REQUIRE(there == 1);
        REQUIRE(twins.cpp->relabel_next());
        REQUIRE(um_relabelled_get(pipeline, &relabelled) == UM_OK);
        CHECK(relabelled.sequence == static_cast<std::uint32_t>(i / 10));
        CHECK(relabelled.later_keyframes == static_cast<std::uint32_t>(2 - i / 10));
        const RelabelledKeyframe& expected = twins.cpp->finished_keyframe().relabelled;
        CHECK(relabelled.cells_now_dynamic == expected.cells_now_dynamic);
        CHECK(relabelled.cells_now_static == expected.cells_now_static);
      }
      std::vector<std::uint8_t>& of_scan = labels[static_cast<std::size_t>(i)];
      std::vector<PointLabel> expected(of_scan.size());
      std::memcpy(expected.data(), of_scan.data(), of_scan.size());
      const um_points points = points_of(walker_scan(i));
      const um_pose pose = pose_of(driving(i));
      std::size_t changed = 0;
      REQUIRE(um_relabel(pipeline, &points, &pose, of_scan.data(), of_scan.size(), &changed) ==
              UM_OK);
      CHECK(changed == twins.cpp->relabel(walker_scan(i).view(), driving(i), expected));
      CHECK(std::memcmp(of_scan.data(), expected.data(), of_scan.size()) == 0);
    }
    CHECK(um_relabel_next(pipeline, &there) == UM_OK);
    CHECK(there == 0);
    REQUIRE(um_reset(pipeline) == UM_OK);
  }
}

TEST_CASE("C tells what the scans say of the sensor, of the poses and of up") {
  Scene scene;  // 40 rings of 720 columns: no HDL-64E
  scene.boxes = {standing_box({20.0, 9.0, 3.0}, {40.0, 0.5, 3.0}),
                 standing_box({30.0, 0.0, 3.0}, {0.5, 9.0, 3.0}),
                 standing_box({12.0, -4.0, 0.8}, {2.0, 0.9, 0.8})};
  const CPipeline pipeline;
  Twins twins{pipeline};
  bool noisy = false;
  bool up_known = false;
  for (int i = 0; i < kScans; ++i) {
    const double t = 0.1 * i;
    Pose pose = sensor_at(2.0 * t, 0.0);
    const LabelledScan scan = scene.scan(pose, t);
    // Noise of a degree, as the sine of large numbers.
    const double angle = 0.0175 * std::sin(1000.0 * t * t);
    pose.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    if (!twins.add(scan, pose, 1 + i)) continue;
    const um_input input = pipeline.keyframe().input;
    CHECK(input.ray_spacing_deg == Approx(0.5).epsilon(0.1));
    CHECK(input.rays_differ == 1);
    CHECK((input.up_sigma_deg > 0.01F) == (input.up_known == 1));
    CHECK(input.up_sigma_deg < 3.0F);
    noisy |= input.attitude_noise_deg > 0.3F && input.aligned_scans > 0;
    up_known |= input.up_known == 1;
  }
  // Equality of nothing would prove nothing.
  CHECK(noisy);
  CHECK(up_known);
}

TEST_CASE("points are read through any stride and offsets") {
  const LabelledScan& scan = walker_scan(0);
  std::vector<std::byte> bytes(scan.points.size() * 21 + 1);
  const auto put = [&](std::size_t at, float value) { std::memcpy(&bytes[at], &value, 4); };
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    put(1 + 21 * i + 5, scan.points[i].z());
    put(1 + 21 * i + 9, scan.points[i].x());
    put(1 + 21 * i + 13, scan.points[i].y());
  }
  const CPipeline pipeline;
  Twins twins{pipeline};
  REQUIRE(pipeline.add({&bytes[1], scan.points.size(), 21, 9, 13, 5}, 1) == UM_OK);
  REQUIRE(twins.cpp->add_scan(scan.view(), driving(0), 1).error.ok());
  std::int32_t ready = 0;
  REQUIRE(um_flush(pipeline, &ready) == UM_OK);
  REQUIRE(ready == 1);
  REQUIRE(twins.cpp->flush().keyframe_ready);
  check_same(pipeline.keyframe(), twins.cpp->keyframe());
  (void)twins.labels(0, scan.points.size());
}

TEST_CASE("views of points that cannot be right are refused and leave no trace") {
  const um_points good = points_of(walker_scan(0));
  const CPipeline pipeline;
  um_points bad[4] = {good, good, good, good};
  bad[0].data = nullptr;
  bad[1].stride = 3;
  bad[2].count = static_cast<std::size_t>(-1) / 2;
  bad[3].offset_z = static_cast<std::size_t>(-1);
  for (const um_points& points : bad) {
    CHECK(pipeline.add(points, 1) == UM_INVALID_POINTS);
    CHECK(says_something(um_message(pipeline)));
  }
  // A stride of one float is the least there is.
  um_points every_float = good;
  every_float.stride = 4;
  CHECK(CPipeline().add(every_float, 1) == UM_OK);
  CHECK(pipeline.add({nullptr, 0, 0, 0, 0, 0}, 1) == UM_EMPTY_SCAN);
  REQUIRE(pipeline.add(good, 1) == UM_OK);
  CHECK(std::string(um_message(pipeline)).empty());
  CHECK(pipeline.add(good, 1) == UM_TIME_REVERSED);
  CHECK(says_something(um_message(pipeline)));
  um_pose nothing;
  std::memset(&nothing, 0, sizeof nothing);
  CHECK(um_add_scan(pipeline, &good, &nothing, 2, nullptr) == UM_INVALID_POSE);
  CHECK(pipeline.add(good, 2) == UM_OK);
}

TEST_CASE("a jump refuses the scan and closes the keyframe, both are told") {
  const um_points points = points_of(walker_scan(0));
  const CPipeline pipeline;
  REQUIRE(pipeline.add(points, 1) == UM_OK);
  const um_pose far = pose_of(sensor_at(50.0, 0.0));
  std::int32_t ready = 0;
  CHECK(um_add_scan(pipeline, &points, &far, 2, &ready) == UM_POSE_JUMP);
  CHECK(ready == 1);
  CHECK(pipeline.keyframe().scan_count == 1);
}

TEST_CASE("there is a keyframe only right after the call that closed it") {
  const um_points points = points_of(walker_scan(0));
  const CPipeline pipeline;
  um_keyframe keyframe;
  std::uint8_t label = 7;
  std::size_t written = 1;
  std::int32_t ready = 1;
  CHECK(um_keyframe_get(pipeline, &keyframe) == UM_NO_KEYFRAME);
  CHECK(um_labels(pipeline, 0, &label, 1, &written) == UM_NO_KEYFRAME);
  CHECK(written == 0);
  CHECK(um_flush(pipeline, &ready) == UM_OK);
  CHECK(ready == 0);
  REQUIRE(pipeline.add(points, 1) == UM_OK);
  CHECK(um_keyframe_get(pipeline, &keyframe) == UM_NO_KEYFRAME);
  REQUIRE(um_flush(pipeline, &ready) == UM_OK);
  REQUIRE(ready == 1);
  CHECK(um_labels(pipeline, 1, &label, 1, &written) == UM_INVALID_INDEX);
  CHECK(um_labels(pipeline, 0, &label, 1, &written) == UM_OK);
  CHECK(written == 1);
  CHECK(label == UM_LABEL_STATIC);
  REQUIRE(pipeline.add(points, 2) == UM_OK);
  CHECK(um_keyframe_get(pipeline, &keyframe) == UM_NO_KEYFRAME);
}

TEST_CASE("C takes intensities, which cells carry if they are asked for") {
  const bool is_asked = GENERATE(false, true);
  um_config config = small_c_config();
  if (is_asked) REQUIRE(um_config_set(&config, "intensity", "true", nullptr) == UM_OK);
  const CPipeline pipeline(config);
  for (int i = 0; i < 10; ++i) {
    const um_points points = points_of(walker_scan(i));
    const um_pose pose = pose_of(driving(i));
    const std::vector<std::uint8_t> intensities(2 * points.count, 77);
    REQUIRE(um_add_scan_with_intensities(pipeline, &points, intensities.data(), 2, &pose,
                                         stamp_of(i), nullptr) == UM_OK);
    CHECK(um_add_scan_with_intensities(pipeline, &points, intensities.data(), SIZE_MAX / 2, &pose,
                                       stamp_of(i), nullptr) == UM_INVALID_POINTS);
  }
  const um_keyframe keyframe = pipeline.keyframe();
  REQUIRE(keyframe.static_cell_count > 0);
  CHECK(std::all_of(keyframe.static_cells, keyframe.static_cells + keyframe.static_cell_count,
                    [&](const um_cell& cell) { return cell.intensity == (is_asked ? 77 : 0); }));
}

TEST_CASE("null pointers and things that are no pipeline are refused") {
  um_event no_event;
  CHECK(um_event_pop(nullptr, &no_event) == UM_INVALID_HANDLE);
  CHECK(um_events_lost(nullptr) == 0);
  const CPipeline pipeline;
  const um_points points = {nullptr, 0, 0, 0, 0, 0};
  const um_pose pose = pose_of(driving(0));
  CHECK(um_add_scan(pipeline, nullptr, &pose, 1, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_add_scan(pipeline, &points, nullptr, 1, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_keyframe_get(pipeline, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_labels(pipeline, 0, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabelled_get(pipeline, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel_next(pipeline, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel(pipeline, nullptr, &pose, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_relabel(nullptr, &points, &pose, nullptr, 0, nullptr) == UM_INVALID_HANDLE);
  CHECK(um_pose_from_quaternion(nullptr, nullptr, nullptr) == UM_NULL_ARGUMENT);

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
    CHECK(um_event_pop(silent, &event) == UM_NO_EVENT);
    CHECK(um_events_lost(silent) == 0);
  }
  config.event_capacity = 4;
  const CPipeline pipeline(config);
  const um_points nothing{nullptr, 0, 12, 0, 4, 8};
  CHECK(pipeline.add(nothing, 5) == UM_EMPTY_SCAN);
  CHECK(um_event_pop(pipeline, nullptr) == UM_NULL_ARGUMENT);
  REQUIRE(um_event_pop(pipeline, &event) == UM_OK);
  CHECK(event.id == UM_EVENT_SCAN_REFUSED);
  CHECK(event.stamp_ns == 5);
  CHECK(event.values[0] == UM_EMPTY_SCAN);
  CHECK(um_event_pop(pipeline, &event) == UM_NO_EVENT);

  REQUIRE(pipeline.add(points_of(walker_scan(0)), 6) == UM_OK);
  REQUIRE(um_flush(pipeline, nullptr) == UM_OK);
  REQUIRE(um_event_pop(pipeline, &event) == UM_OK);
  CHECK(event.id == UM_EVENT_KEYFRAME_CLOSED);
  CHECK(event.values[0] == 0);
  CHECK(event.values[1] == 1);
  // That scan was measured: the empty one before it was not.
  REQUIRE(um_event_pop(pipeline, &event) == UM_OK);
  CHECK(event.id == UM_EVENT_SAMPLING_DIFFERS);
  while (um_event_pop(pipeline, &event) == UM_OK) {
  }

  for (int i = 0; i < 7; ++i) CHECK(pipeline.add(nothing, 10 + i) == UM_EMPTY_SCAN);
  CHECK(um_events_lost(pipeline) == 3);
  REQUIRE(um_event_pop(pipeline, &event) == UM_OK);
  CHECK(event.stamp_ns == 10);

  REQUIRE(um_reset(pipeline) == UM_OK);
  CHECK(um_event_pop(pipeline, &event) == UM_NO_EVENT);
  CHECK(um_events_lost(pipeline) == 0);
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

TEST_CASE("every status has a sentence, every number a name, and the library a version") {
  for (const auto& [first, last] : {std::pair{UM_INVALID_CONFIG, UM_TIME_JUMP},
                                    std::pair{UM_NULL_ARGUMENT, UM_UNKNOWN_PARAMETER}}) {
    for (um_status status = first; status <= last; ++status) {
      CHECK(says_something(um_status_text(status)));
    }
  }
  CHECK(std::string(um_status_text(-5)) == "unknown status");
  CHECK(std::string(um_drop_cause_name(UM_DROP_CELLS_FULL)) == "cells_full");
  CHECK(std::string(um_stage_name(UM_STAGE_TOTAL)) == "total");
  CHECK(std::string(um_capacity_name(UM_CAPACITY_PLACES)) == "places");
  CHECK(um_drop_cause_name(8) == nullptr);
  CHECK(um_stage_name(5) == nullptr);
  CHECK(um_capacity_name(5) == nullptr);
  CHECK(um_version() == UM_VERSION);
  CHECK(std::string(um_version_text()) == "0.1.0");
}
