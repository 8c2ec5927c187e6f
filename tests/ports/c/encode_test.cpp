// Tests of what C programs send and keep: encoded keyframes, images, earlier places, health.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "c_pipeline.hpp"
#include "ports/c/handle.hpp"
#include "tests/onboard/run.hpp"
#include "tests/random.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/core/voxel_key.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr int kScans = 30;
constexpr um_session kSession{7, 0, 0xFEDCBA9876543210ULL, 0x0123456789ABCDEFULL};

/// Drives past the walker and calls `look` whenever there is a keyframe.
void drive(um_pipeline* pipeline, const std::function<void()>& look) {
  const Scene scene = scene_with_walker();
  for (int i = 0; i < kScans; ++i) {
    const LabelledScan scan = scene.scan(driving(i), 0.1 * i);
    const um_points points = points_of(scan);
    const um_pose pose = pose_of(driving(i));
    std::int32_t ready = 0;
    REQUIRE(um_add_scan(pipeline, &points, &pose, 1 + i * std::int64_t{100000000}, &ready) ==
            UM_OK);
    if (ready == 1) look();
  }
}

um_keyframe keyframe_of(um_pipeline* pipeline) {
  um_keyframe keyframe;
  keyframe.struct_size = sizeof keyframe;
  REQUIRE(um_keyframe_get(pipeline, &keyframe) == UM_OK);
  return keyframe;
}

/// What the C++ interface makes of the same drive.
template <typename Look>
void drive_cpp(const Look& look) {
  OwnedPipeline pipeline(small_config());
  const Scene scene = scene_with_walker();
  for (int i = 0; i < kScans; ++i) {
    const LabelledScan scan = scene.scan(driving(i), 0.1 * i);
    if (pipeline->add_scan(scan.view(), driving(i), 1 + i * std::int64_t{100000000})
            .keyframe_ready) {
      look(pipeline->keyframe());
    }
  }
}

}  // namespace

TEST_CASE("C encodes a keyframe to the bytes that C++ encodes it to") {
  std::vector<std::vector<std::uint8_t>> expected;
  const std::uint32_t cells = small_config().voxel.max_cells;
  const MemoryBlock scratch_cpp(wire::KeyframeEncoder::required_bytes(cells));
  drive_cpp([&](const KeyframeView& view) {
    auto encoder = wire::KeyframeEncoder::create(cells, scratch_cpp.span());
    std::vector<std::uint8_t> bytes(1U << 20U);
    const wire::EncodeResult result =
        encoder->encode(view, {kSession.robot, {kSession.boot_high, kSession.boot_low}}, bytes);
    REQUIRE(result.error.code == ErrorCode::kOk);
    bytes.resize(result.bytes);
    expected.push_back(bytes);
  });

  const CPipeline pipeline;
  const std::size_t scratch_bytes = um_encode_scratch_bytes(pipeline.get());
  REQUIRE(scratch_bytes == wire::KeyframeEncoder::required_bytes(cells));
  const MemoryBlock scratch(scratch_bytes);
  std::size_t keyframes = 0;
  um_encoded encoded;
  CHECK(um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes, nullptr, 0,
                           &encoded) == UM_NO_KEYFRAME);
  drive(pipeline.get(), [&] {
    REQUIRE(um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes, nullptr, 0,
                               &encoded) == UM_BUFFER_TOO_SMALL);
    std::vector<std::uint8_t> bytes(encoded.bytes);
    const std::size_t needed = encoded.bytes;
    CHECK(um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes, bytes.data(),
                             needed - 1, &encoded) == UM_BUFFER_TOO_SMALL);
    REQUIRE(um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes,
                               bytes.data(), needed, &encoded) == UM_OK);
    CHECK(encoded.bytes == needed);
    CHECK(encoded.left_out == 0);
    CHECK(encoded.image_bytes > 0);
    REQUIRE(keyframes < expected.size());
    CHECK(bytes == expected[keyframes++]);
  });
  CHECK(keyframes == expected.size());
  CHECK(keyframes == 3);
}

TEST_CASE("with deferred work C encodes keyframes when they are finished, to the same bytes") {
  // Bytes by keyframe, and how often work was left after a scan.
  using Encoded = std::vector<std::vector<std::uint8_t>>;
  const auto run = [](const char* deferred, int& work_left) {
    um_config config = small_c_config();
    REQUIRE(um_config_set(&config, "deferred", deferred, nullptr) == UM_OK);
    const CPipeline pipeline(config);
    const std::size_t scratch_bytes = um_encode_scratch_bytes(pipeline.get());
    const MemoryBlock scratch(scratch_bytes);
    Encoded result;
    const auto look = [&] {
      um_keyframe keyframe;
      keyframe.struct_size = sizeof keyframe;
      um_encoded encoded;
      std::vector<std::uint8_t> bytes(1U << 20U);
      const um_status finished = um_finished_get(pipeline.get(), &keyframe);
      const um_status written =
          um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes, bytes.data(),
                             bytes.size(), &encoded);
      REQUIRE(finished == written);
      if (finished == UM_NO_KEYFRAME) return;
      REQUIRE(finished == UM_OK);
      CHECK(keyframe.sequence == result.size());
      CHECK(keyframe.plane_count > 0);
      bytes.resize(encoded.bytes);
      result.push_back(bytes);
    };
    const Scene scene = scene_with_walker();
    for (int i = 0; i < kScans; ++i) {
      const LabelledScan scan = scene.scan(driving(i), 0.1 * i);
      const um_points points = points_of(scan);
      const um_pose pose = pose_of(driving(i));
      REQUIRE(um_add_scan(pipeline.get(), &points, &pose, 1 + i * std::int64_t{100000000},
                          nullptr) == UM_OK);
      look();
      std::int32_t left = 0;
      REQUIRE(um_work(pipeline.get(), 0, &left) == UM_OK);
      work_left += left;
      look();
    }
    std::size_t before = 0;
    do {
      before = result.size();
      REQUIRE(um_flush(pipeline.get(), nullptr) == UM_OK);
      look();
    } while (result.size() > before);
    um_health health;
    health.struct_size = sizeof health;
    REQUIRE(um_health_get(pipeline.get(), &health) == UM_OK);
    CHECK(health.keyframes == 3);
    return result;
  };
  int never = 0;
  int often = 0;
  const Encoded at_once = run("false", never);
  CHECK(at_once.size() == 3);
  CHECK(run("true", often) == at_once);
  CHECK(never == 0);
  CHECK(often > 5);
  CHECK(um_work(nullptr, 0, nullptr) == UM_INVALID_HANDLE);
  CHECK(um_finished_get(nullptr, nullptr) == UM_INVALID_HANDLE);
}

TEST_CASE("a keyframe that repeats others is told, and there is nothing to encode") {
  const CPipeline pipeline;
  const std::size_t scratch_bytes = um_encode_scratch_bytes(pipeline.get());
  const MemoryBlock scratch(scratch_bytes);
  const LabelledScan scan = scene_with_walker().scan(driving(0), 0.0);
  const um_points points = points_of(scan);
  const um_pose pose = pose_of(driving(0));
  const auto window = small_config().removal.window;
  std::uint32_t keyframes = 0;
  std::int32_t ready = 0;
  for (std::int64_t stamp_ns = 1; keyframes < window + 2; stamp_ns += 100'000'000) {
    REQUIRE(um_add_scan(pipeline.get(), &points, &pose, stamp_ns, &ready) == UM_OK);
    if (ready == 0) continue;
    const bool repeats = keyframes++ >= window;
    const um_keyframe keyframe = keyframe_of(pipeline.get());
    CHECK(keyframe.repeats == (repeats ? 1U : 0U));
    CHECK(keyframe.sequence == std::min(keyframes, window) - 1);
    um_encoded encoded;
    CHECK(um_keyframe_encode(pipeline.get(), &kSession, scratch.data(), scratch_bytes, nullptr, 0,
                             &encoded) == (repeats ? UM_NO_KEYFRAME : UM_BUFFER_TOO_SMALL));
  }
}

TEST_CASE("encoding refuses what it cannot work with") {
  const CPipeline pipeline;
  const std::size_t scratch_bytes = um_encode_scratch_bytes(pipeline.get());
  const MemoryBlock scratch(scratch_bytes + 64);
  std::vector<std::uint8_t> bytes(1U << 20U);
  drive(pipeline.get(), [] {});
  um_encoded encoded;
  const auto encode = [&](const um_session* session, void* at, std::size_t room, void* buffer,
                          um_encoded* result) {
    return um_keyframe_encode(pipeline.get(), session, at, room, buffer, bytes.size(), result);
  };
  std::byte* const at = scratch.data();
  CHECK(encode(nullptr, at, scratch_bytes, bytes.data(), &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, nullptr, scratch_bytes, bytes.data(), &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, scratch_bytes, nullptr, &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, scratch_bytes, bytes.data(), nullptr) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, scratch_bytes - 1, bytes.data(), &encoded) == UM_MEMORY_TOO_SMALL);
  CHECK(encode(&kSession, at + 8, scratch_bytes, bytes.data(), &encoded) == UM_MEMORY_MISALIGNED);
  CHECK(um_keyframe_encode(nullptr, &kSession, at, scratch_bytes, bytes.data(), bytes.size(),
                           &encoded) == UM_INVALID_HANDLE);
  CHECK(um_encode_scratch_bytes(nullptr) == 0);
}

TEST_CASE("C sees the free-space images of C++") {
  std::vector<std::vector<std::uint16_t>> expected;
  std::vector<std::uint32_t> scans;
  RangeImageShape shape;
  float full_weight_range_m = 0.0F;
  drive_cpp([&](const KeyframeView& view) {
    shape = view.image_shape;
    full_weight_range_m = view.image_full_weight_range_m;
    for (const FreeSpaceImage& image : view.images) {
      expected.emplace_back(image.pixels.begin(), image.pixels.end());
      scans.push_back(image.scan);
    }
  });
  const CPipeline pipeline;
  um_images images;
  images.struct_size = sizeof images;
  CHECK(um_images_get(pipeline.get(), &images) == UM_NO_KEYFRAME);
  std::size_t seen = 0;
  drive(pipeline.get(), [&] {
    REQUIRE(um_images_get(pipeline.get(), &images) == UM_OK);
    REQUIRE(images.count > 0);
    CHECK(images.horizontal_fov_deg == shape.horizontal_fov_deg);
    CHECK(images.azimuth_resolution_deg == shape.azimuth_resolution_deg);
    CHECK(images.elevation_min_deg == shape.elevation_min_deg);
    CHECK(images.elevation_max_deg == shape.elevation_max_deg);
    CHECK(images.elevation_resolution_deg == shape.elevation_resolution_deg);
    CHECK(images.full_weight_range_m == full_weight_range_m);
    for (std::uint32_t i = 0; i < images.count; ++i, ++seen) {
      REQUIRE(seen < expected.size());
      const std::size_t pixels = std::size_t{images.rows} * images.columns;
      REQUIRE(pixels == expected[seen].size());
      CHECK(std::memcmp(images.pixels[i], expected[seen].data(), 2 * pixels) == 0);
      CHECK(images.scans[i] == scans[seen]);
    }
  });
  CHECK(seen == expected.size());
  images.struct_size = 4;
  CHECK(um_images_get(pipeline.get(), &images) == UM_UNKNOWN_VERSION);
  CHECK(um_images_get(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("places of earlier runs go into the database that loop search asks") {
  const CPipeline earlier;
  const CPipeline pipeline;
  drive(earlier.get(), [&] {
    const um_keyframe keyframe = keyframe_of(earlier.get());
    um_place place{1,
                   keyframe.sequence,
                   keyframe.T_odometry_keyframe,
                   keyframe.keypoints,
                   keyframe.keypoint_count,
                   keyframe.planes,
                   keyframe.plane_count};
    CHECK(um_place_insert_level(pipeline.get(), &place, keyframe.up_covariance) == UM_OK);
    CHECK(um_place_insert_level(pipeline.get(), &place, nullptr) == UM_NULL_ARGUMENT);
    place.session = 0;
    CHECK(um_place_insert(pipeline.get(), &place) == UM_INVALID_INDEX);
    place.session = 1;
    place.T_odometry_keyframe.m[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(um_place_insert(pipeline.get(), &place) == UM_INVALID_POSE);
    place.T_odometry_keyframe = keyframe.T_odometry_keyframe;
    place.keypoints = nullptr;
    place.keypoint_count = 1;
    CHECK(um_place_insert(pipeline.get(), &place) == UM_NULL_ARGUMENT);
  });
  CHECK(um_place_insert(pipeline.get(), nullptr) == UM_NULL_ARGUMENT);
  std::uint64_t own = 0;
  drive(pipeline.get(), [&] {
    const um_keyframe keyframe = keyframe_of(pipeline.get());
    CHECK(keyframe.statistics.capacity[UM_CAPACITY_PLACES].used == 3 + ++own);
  });
}

namespace {

/// Forty keypoints with columns of their own, in a frame turned by so much.
std::vector<Keypoint> forty_keypoints(const Eigen::Matrix3f& turn) {
  Random random(8);
  std::vector<Keypoint> keypoints;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Eigen::Vector3f position(static_cast<float>(random.uniform(-30, 30)),
                                   static_cast<float>(random.uniform(-30, 30)), 0.0F);
    keypoints.push_back({turn * position, Eigen::Vector3f::UnitX(), mix_bits(8000 + i), 100});
  }
  return keypoints;
}

/// Upright planes around them.
std::vector<PlanePatch> eighty_planes(const Eigen::Matrix3f& turn) {
  Random random(9);
  std::vector<PlanePatch> planes;
  for (int i = 0; i < 80; ++i) {
    const double bearing = random.uniform(0, 6.28);
    const Eigen::Vector3f center(static_cast<float>(random.uniform(-30, 30)),
                                 static_cast<float>(random.uniform(-30, 30)),
                                 static_cast<float>(random.uniform(0, 6)));
    const Eigen::Vector3f normal(static_cast<float>(std::cos(bearing)),
                                 static_cast<float>(std::sin(bearing)), 0.0F);
    planes.push_back({turn * center, turn * normal});
  }
  return planes;
}

}  // namespace

TEST_CASE("what C knows of up at an earlier place is what loop search knows of it") {
  const Eigen::Matrix3f level = Eigen::Matrix3f::Identity();
  const std::vector<Keypoint> keypoints = forty_keypoints(level);
  const std::vector<PlanePatch> planes = eighty_planes(level);
  const float up[3] = {4e-4F, 1e-4F, 9e-4F};  // about 1.1 and 1.7 degrees
  const CPipeline by_c;
  const CPipeline by_cpp;
  const um_place place{1,
                       0,
                       pose_of({}),
                       reinterpret_cast<const um_keypoint*>(keypoints.data()),
                       keypoints.size(),
                       reinterpret_cast<const um_plane*>(planes.data()),
                       planes.size()};
  REQUIRE(um_place_insert_level(by_c.get(), &place, up) == UM_OK);
  by_cpp.get()->core->places().insert({keypoints, planes, {true, up[0], up[1], up[2]}}, {1, 0}, {});

  const Eigen::Matrix3f leaning =
      Eigen::AngleAxisf(0.04F, Eigen::Vector3f(0.6F, -0.8F, 0.0F)).toRotationMatrix();
  const std::vector<Keypoint> seen = forty_keypoints(leaning);
  const std::vector<PlanePatch> walls = eighty_planes(leaning);
  const PlaceView query{seen, walls, {true, 1e-4F, 0.0F, 1e-4F}};
  const auto found = [&query](const CPipeline& pipeline) {
    const auto loops = pipeline.get()->core->places().search(query, {9, 0}, {});
    REQUIRE(loops.size() == 1);
    return Eigen::Matrix3d(loops[0].T_match_query.rotation);
  };
  CHECK(found(by_c) == found(by_cpp));
}

TEST_CASE("health adds up what every keyframe said") {
  const CPipeline pipeline;
  um_health expected{};
  um_health health;
  health.struct_size = sizeof health;
  drive(pipeline.get(), [&] {
    const um_statistics statistics = keyframe_of(pipeline.get()).statistics;
    ++expected.keyframes;
    expected.points_in += statistics.points_in;
    expected.points_dynamic += statistics.points_dynamic;
    expected.dropped[UM_DROP_OUT_OF_RANGE] += statistics.dropped[UM_DROP_OUT_OF_RANGE];
    expected.fullest[UM_CAPACITY_CELLS].used = std::max(
        expected.fullest[UM_CAPACITY_CELLS].used, statistics.capacity[UM_CAPACITY_CELLS].used);
  });
  const um_pose pose = pose_of(driving(0));
  const um_points none{};
  CHECK(um_add_scan(pipeline.get(), &none, &pose, std::int64_t{1} << 34U, nullptr) ==
        UM_EMPTY_SCAN);
  REQUIRE(um_health_get(pipeline.get(), &health) == UM_OK);
  CHECK(health.scans == kScans + 1);
  CHECK(health.scans_refused == 1);
  CHECK(health.keyframes == 3);
  CHECK(health.points_in == expected.points_in);
  CHECK(health.points_dynamic == expected.points_dynamic);
  CHECK(health.points_dynamic > 0);
  CHECK(health.dropped[UM_DROP_OUT_OF_RANGE] == expected.dropped[UM_DROP_OUT_OF_RANGE]);
  CHECK(health.fullest[UM_CAPACITY_CELLS].used == expected.fullest[UM_CAPACITY_CELLS].used);
  CHECK(health.fullest[UM_CAPACITY_CELLS].capacity == 65536);
  REQUIRE(um_reset(pipeline.get()) == UM_OK);
  REQUIRE(um_health_get(pipeline.get(), &health) == UM_OK);
  CHECK(health.scans == 0);
  CHECK(health.keyframes == 0);
  health.struct_size = 1;
  CHECK(um_health_get(pipeline.get(), &health) == UM_UNKNOWN_VERSION);
}
