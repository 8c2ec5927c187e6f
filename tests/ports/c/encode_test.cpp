// Tests of what C programs send and keep: encoded keyframes, images, earlier places.
#include "c_pipeline.hpp"
#include "ports/c/handle.hpp"
#include "src/core/voxel_key.hpp"
#include "tests/onboard/run.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr um_session kSession{7, 0, 0xFEDCBA9876543210ULL, 0x0123456789ABCDEFULL};
using Bytes = std::vector<std::uint8_t>;

Pipeline& core_of(um_pipeline* pipeline) { return *pipeline->core; }

/// Encodes keyframes with scratch memory of exactly the size that the library asks for.
struct Encoder {
  const CPipeline& pipeline;
  MemoryBlock scratch{um_encode_scratch_bytes(pipeline)};
  um_encoded encoded{};

  um_status operator()(std::span<std::uint8_t> buffer) {
    return um_keyframe_encode(pipeline, &kSession, scratch.data(), scratch.size(), buffer.data(),
                              buffer.size(), &encoded);
  }
};

}  // namespace

TEST_CASE("C encodes a keyframe to the bytes that C++ encodes it to, and sees its images") {
  const CPipeline pipeline;
  const std::uint32_t cells = small_config().voxel.max_cells;
  Encoder encode{pipeline};
  REQUIRE(encode.scratch.size() == wire::KeyframeEncoder::required_bytes(cells));
  const MemoryBlock scratch(encode.scratch.size());
  auto expected = wire::KeyframeEncoder::create(cells, scratch.span());
  um_images images;
  CHECK(um_images_get(pipeline, &images) == UM_NO_KEYFRAME);
  CHECK(encode({}) == UM_NO_KEYFRAME);
  int keyframes = 0;
  pipeline.drive([&] {
    ++keyframes;
    const KeyframeView& view = core_of(pipeline).keyframe();
    Bytes from_cpp(1U << 20U);
    const wire::EncodeResult result =
        expected->encode(view, {kSession.robot, {kSession.boot_high, kSession.boot_low}}, from_cpp);
    REQUIRE(result.error.ok());
    from_cpp.resize(result.bytes);

    REQUIRE(encode({}) == UM_BUFFER_TOO_SMALL);
    CHECK(encode.encoded.bytes == result.bytes);
    Bytes bytes(result.bytes);
    CHECK(encode(std::span(bytes).first(bytes.size() - 1)) == UM_BUFFER_TOO_SMALL);
    REQUIRE(encode(bytes) == UM_OK);
    CHECK(encode.encoded.bytes == result.bytes);
    CHECK(encode.encoded.left_out == 0);
    CHECK(encode.encoded.image_bytes > 0);
    CHECK(bytes == from_cpp);

    REQUIRE(um_images_get(pipeline, &images) == UM_OK);
    REQUIRE(images.count > 0);
    REQUIRE(images.count == view.images.size());
    CHECK(images.horizontal_fov_deg == view.image_shape.horizontal_fov_deg);
    CHECK(images.azimuth_resolution_deg == view.image_shape.azimuth_resolution_deg);
    CHECK(images.elevation_min_deg == view.image_shape.elevation_min_deg);
    CHECK(images.elevation_max_deg == view.image_shape.elevation_max_deg);
    CHECK(images.elevation_resolution_deg == view.image_shape.elevation_resolution_deg);
    CHECK(images.full_weight_range_m == view.image_full_weight_range_m);
    for (std::uint32_t i = 0; i < images.count; ++i) {
      CHECK(std::size_t{images.rows} * images.columns == view.images[i].pixels.size());
      CHECK(images.pixels[i] == view.images[i].pixels.data());
      CHECK(images.scans[i] == view.images[i].scan);
    }
  });
  CHECK(keyframes == 3);
  CHECK(um_images_get(pipeline, nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("with deferred work C encodes keyframes when they are finished, to the same bytes") {
  // Bytes by keyframe, and how often work was left after a scan.
  using Encoded = std::vector<Bytes>;
  const auto run = [](const char* deferred, int& work_left) {
    um_config config = small_c_config();
    REQUIRE(um_config_set(&config, "deferred", deferred, nullptr) == UM_OK);
    const CPipeline pipeline(config);
    Encoder encode{pipeline};
    Encoded result;
    const auto look = [&] {
      um_keyframe keyframe;
      Bytes bytes(1U << 20U);
      const um_status finished = um_finished_get(pipeline, &keyframe);
      REQUIRE(encode(bytes) == finished);
      if (finished == UM_NO_KEYFRAME) return;
      REQUIRE(finished == UM_OK);
      CHECK(keyframe.sequence == result.size());
      CHECK(keyframe.plane_count > 0);
      bytes.resize(encode.encoded.bytes);
      result.push_back(bytes);
    };
    for (int i = 0; i < kScans; ++i) {
      (void)pipeline.step(i);
      look();
      std::int32_t left = 0;
      REQUIRE(um_work(pipeline, 0, &left) == UM_OK);
      work_left += left;
      look();
    }
    std::size_t before = 0;
    do {
      before = result.size();
      REQUIRE(um_flush(pipeline, nullptr) == UM_OK);
      look();
    } while (result.size() > before);
    CHECK(pipeline.health().keyframes == 3);
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
  Encoder encode{pipeline};
  const um_points points = points_of(walker_scan(0));
  const um_pose pose = pose_of(driving(0));
  const auto window = small_config().removal.window;
  std::uint32_t keyframes = 0;
  std::int32_t ready = 0;
  for (int scan = 0; keyframes < window + 2; ++scan) {
    REQUIRE(um_add_scan(pipeline, &points, &pose, stamp_of(scan), &ready) == UM_OK);
    if (ready == 0) continue;
    const bool repeats = keyframes++ >= window;
    const um_keyframe keyframe = pipeline.keyframe();
    CHECK(keyframe.repeats == (repeats ? 1U : 0U));
    CHECK(keyframe.sequence == std::min(keyframes, window) - 1);
    CHECK(encode({}) == (repeats ? UM_NO_KEYFRAME : UM_BUFFER_TOO_SMALL));
  }
}

TEST_CASE("encoding refuses what it cannot work with") {
  const CPipeline pipeline;
  const std::size_t enough = um_encode_scratch_bytes(pipeline);
  const MemoryBlock scratch(enough + 64);
  Bytes bytes(1U << 20U);
  pipeline.drive([] {});
  um_encoded encoded;
  const auto encode = [&](const um_session* session, void* at, std::size_t room, void* buffer,
                          um_encoded* result) {
    return um_keyframe_encode(pipeline, session, at, room, buffer, bytes.size(), result);
  };
  std::byte* const at = scratch.data();
  CHECK(encode(nullptr, at, enough, bytes.data(), &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, nullptr, enough, bytes.data(), &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, enough, nullptr, &encoded) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, enough, bytes.data(), nullptr) == UM_NULL_ARGUMENT);
  CHECK(encode(&kSession, at, enough - 1, bytes.data(), &encoded) == UM_MEMORY_TOO_SMALL);
  CHECK(encode(&kSession, at + 8, enough, bytes.data(), &encoded) == UM_MEMORY_MISALIGNED);
  CHECK(um_keyframe_encode(nullptr, &kSession, at, enough, bytes.data(), bytes.size(), &encoded) ==
        UM_INVALID_HANDLE);
  CHECK(um_encode_scratch_bytes(nullptr) == 0);
}

TEST_CASE("places of earlier runs go into the database that loop search asks") {
  const CPipeline earlier;
  const CPipeline pipeline;
  earlier.drive([&] {
    const um_keyframe keyframe = earlier.keyframe();
    um_place place{1,
                   keyframe.sequence,
                   keyframe.T_odometry_keyframe,
                   keyframe.keypoints,
                   keyframe.keypoint_count,
                   keyframe.planes,
                   keyframe.plane_count};
    CHECK(um_place_insert_level(pipeline, &place, keyframe.up_covariance) == UM_OK);
    CHECK(um_place_insert_level(pipeline, &place, nullptr) == UM_NULL_ARGUMENT);
    place.session = 0;
    CHECK(um_place_insert(pipeline, &place) == UM_INVALID_INDEX);
    place.session = 1;
    place.T_odometry_keyframe.m[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(um_place_insert(pipeline, &place) == UM_INVALID_POSE);
    place.T_odometry_keyframe = keyframe.T_odometry_keyframe;
    place.keypoints = nullptr;
    place.keypoint_count = 1;
    CHECK(um_place_insert(pipeline, &place) == UM_NULL_ARGUMENT);
  });
  CHECK(um_place_insert(pipeline, nullptr) == UM_NULL_ARGUMENT);
  std::uint64_t own = 0;
  pipeline.drive([&] {
    const um_statistics statistics = pipeline.keyframe().statistics;
    CHECK(statistics.capacity[UM_CAPACITY_PLACES].used == 3 + ++own);
  });
}

namespace {

/// Forty keypoints with columns of their own and upright planes around them, in a turned frame.
struct Landmarks {
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;

  explicit Landmarks(const Eigen::Matrix3f& turn = Eigen::Matrix3f::Identity()) {
    Random random(8);
    const auto number = [&random](double low, double high) {
      return static_cast<float>(random.uniform(low, high));
    };
    for (std::uint64_t i = 0; i < 40; ++i) {
      const Eigen::Vector3f position{number(-30, 30), number(-30, 30), 0.0F};
      keypoints.push_back({turn * position, Eigen::Vector3f::UnitX(), mix_bits(8000 + i), 100});
    }
    random = Random(9);
    for (int i = 0; i < 80; ++i) {
      const float bearing = number(0, 6.28);
      const Eigen::Vector3f center{number(-30, 30), number(-30, 30), number(0, 6)};
      const Eigen::Vector3f normal{std::cos(bearing), std::sin(bearing), 0.0F};
      planes.push_back({turn * center, turn * normal});
    }
  }
};

}  // namespace

TEST_CASE("what C knows of up at an earlier place is what loop search knows of it") {
  const Landmarks level;
  const float up[3] = {4e-4F, 1e-4F, 9e-4F};  // about 1.1 and 1.7 degrees
  const CPipeline by_c;
  const CPipeline by_cpp;
  const um_place place{1,
                       0,
                       pose_of({}),
                       reinterpret_cast<const um_keypoint*>(level.keypoints.data()),
                       level.keypoints.size(),
                       reinterpret_cast<const um_plane*>(level.planes.data()),
                       level.planes.size()};
  REQUIRE(um_place_insert_level(by_c, &place, up) == UM_OK);
  core_of(by_cpp).places().insert({level.keypoints, level.planes, {true, up[0], up[1], up[2]}},
                                  {1, 0}, {});

  const Landmarks leaning(
      Eigen::AngleAxisf(0.04F, Eigen::Vector3f(0.6F, -0.8F, 0.0F)).toRotationMatrix());
  const PlaceView query{leaning.keypoints, leaning.planes, {true, 1e-4F, 0.0F, 1e-4F}};
  const auto found = [&query](const CPipeline& pipeline) {
    const auto loops = core_of(pipeline).places().search(query, {9, 0}, {});
    REQUIRE(loops.size() == 1);
    return Eigen::Matrix3d(loops[0].T_match_query.rotation);
  };
  CHECK(found(by_c) == found(by_cpp));
}
