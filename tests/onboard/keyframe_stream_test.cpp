// Checksums of the keyframe stream: the same bytes on x86-64, aarch64 and ARMv7. This program is
// built for each of them.
//
// When the pipeline's results change on purpose, take over the numbers that the failing test
// prints, and check that all three platforms print the same ones (`./dev arm -R "keyframe
// stream"`).
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <string>

#include "integer_town.hpp"
#include "run.hpp"
#include "stream_checksum.hpp"
#include "unimapper/odometry/odometry.hpp"
#ifdef UNIMAPPER_WITH_RECORDINGS
#include "ports/datasets/dataset.hpp"
#include "tests/recordings.hpp"
#endif

using namespace unimapper;
using namespace unimapper::test;

namespace {

// Poses with up, labels, static cells, dynamic cells, keypoints, planes, triangles, loops, counts.
constexpr StreamChecksums kSpinning = {0x7EAFF6C05435A01D, 0x69AD5AFDF52C16FB, 0x544179351E1A2699,
                                       0xA91B7DF5B2AAE852, 0xFD5EAC8216CAAF8E, 0x692367B7E33CA34E,
                                       0x8AF0A7E5998B5C9F, 0xD3B9C6FB9D365ABD, 0x7D27E4102E505D93};
constexpr StreamChecksums kNonRepetitive = {
    0xA53DF04682CAAE9B, 0x0CCDC4D4E6AA97C3, 0xF24DAE0957E47106,
    0x3E13F4FB586EE489, 0xBC8C9F196067D5C5, 0x6D3F246BF6F44D97,
    0xB50264D7B8EA74FF, 0x1977287E14AD93A6, 0xAE03F1480F130B26};
constexpr StreamChecksums kPaper = {0x4D8DC58F868E49F6, 0x976F2A8DC61083C5, 0xFEE881EBAA031AD5,
                                    0x578DF561D3BFB068, 0xF8700FC86E7868B6, 0xF5557CC38309E4A6,
                                    0x4B9D7B153656EDC1, 0x22963C9E5C1DBC5B, 0x1B1443F1A4ACAA4F};
constexpr StreamChecksums kRecorded = {0xF73B7E48F4686295, 0x6DD265D4CD120863, 0xD3B0C9996B00AF71,
                                       0x46B32AFE9A9D6C80, 0xDD92F874167737BD, 0x025CFB2DA0B6A40F,
                                       0x719B317F8474A157, 0xEBEBA12675009DF6, 0x746B19FAE7DF0112};

/// Short keyframes, a short window, and loops to what was seen a little while ago.
PipelineConfig short_run(PipelineConfig config) {
  config.keyframe.scans = 5;
  config.free_space.images_per_keyframe =
      std::min(config.free_space.images_per_keyframe, config.keyframe.scans);
  config.removal.window = 6;
  config.voxel.max_cells = std::min(config.voxel.max_cells, 1U << 17U);
  config.loop_search.max_places = 32;
  config.search_scope.min_keyframe_gap = 3;
  return config;
}

StreamChecksum run_town(const PipelineConfig& config, const IntegerTown::Options& options) {
  constexpr std::int64_t kScans = 60;
  const IntegerTown town(options);
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  StreamChecksum sum(config);
  for (std::int64_t i = 0; i < kScans; ++i) {
    const TownScan scan = town.scan(i);
    const ScanResult result =
        pipeline->add_scan(scan.view(), scan.T_odometry_sensor, 1 + i * 100000000);
    if (result.keyframe_ready) sum.add(*pipeline);
  }
  return sum;
}

/// Prints one line per part and, if something differs, the constants to take over.
void check(const char* name, const StreamChecksum& sum, const StreamChecksums& pinned) {
  const StreamChecksums found = sum.checksums();
  std::printf(
      "%s: %zu keyframes, %zu dynamic cells, %zu keypoints, %zu planes, %zu triangles, "
      "%zu loops\n",
      name, sum.keyframes, sum.dynamic_cells, sum.keypoints, sum.planes, sum.triangles, sum.loops);
  std::string constants = "{";
  for (std::size_t i = 0; i < kStreamParts; ++i) {
    char word[32];
    std::snprintf(word, sizeof word, "0x%016llX", static_cast<unsigned long long>(found[i]));
    std::printf("  %-13s %s%s\n", kStreamPartNames[i], word,
                found[i] == pinned[i] ? "" : "   differs");
    constants += std::string(i == 0 ? "" : ", ") + word;
  }
  INFO("the constants as found here: " << name << " = " << constants << "};");
  CHECK((found == pinned));
}

}  // namespace

TEST_CASE("spinning sensor, the same bits on every platform") {
  const StreamChecksum sum = run_town(short_run(preset(SensorKind::kHdl64e)), {});
  CHECK(sum.keyframes == 12);
  CHECK(sum.dynamic_cells > 1000);
  CHECK(sum.triangles > 1000);
  CHECK(sum.loops > 0);
  check("kSpinning", sum, kSpinning);
}

TEST_CASE("odometry of a drive, the same bits on every platform") {
  constexpr std::uint64_t kPoses = 0x8ABA103D635E5FB6;
  constexpr std::int64_t kScans = 30;
  const IntegerTown town({});
  const LidarOdometryConfig config;
  const MemoryBlock memory(LidarOdometry::required_bytes(config));
  const auto odometry = LidarOdometry::create(config, memory.span());
  REQUIRE(odometry.ok());
  // In plain numbers: Eigen's functions in this program are compiled otherwise than the libraries'.
  const auto distance_m = [](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const double x = to.x() - from.x();
    const double y = to.y() - from.y();
    const double z = to.z() - from.z();
    return std::sqrt(x * x + y * y + z * z);
  };
  const Pose first = town.scan(0).T_odometry_sensor;
  Fnv1a sum;
  for (std::int64_t i = 0; i < kScans; ++i) {
    const TownScan scan = town.scan(i);
    // Of one moment, but with times: they take part in all that is computed.
    const std::vector<float> time_s(scan.view().count, 0.0F);
    const OdometryResult result = (*odometry)->add_scan(1 + i * 100000000, scan.view(), time_s);
    REQUIRE(result.error.ok());
    sum.add_pose(result.T_odometry_sensor);
    sum.add_matrix(result.covariance);
    sum.add(result.weak.count);
    const double moved_m = distance_m(first.translation, scan.T_odometry_sensor.translation);
    CHECK(distance_m({0.0, 0.0, 0.0}, result.T_odometry_sensor.translation) ==
          Approx(moved_m).margin(0.3));
  }
  std::printf("odometry: 0x%016llX\n", static_cast<unsigned long long>(sum.value()));
  CHECK(sum.value() == kPoses);
}

TEST_CASE("non-repetitive sensor, the same bits on every platform") {
  IntegerTown::Options options;
  options.seed = 2;
  options.only_ahead = true;
  options.points_per_block = 500;
  const StreamChecksum sum = run_town(short_run(preset(SensorKind::kLivoxAvia)), options);
  CHECK(sum.keyframes == 12);
  CHECK(sum.dynamic_cells > 500);
  CHECK(sum.triangles > 200);
  check("kNonRepetitive", sum, kNonRepetitive);
}

TEST_CASE("the paper's preset on thinned scans, the same bits on every platform") {
  PipelineConfig config = short_run(paper_preset(SensorKind::kOs1_64));
  config.keyframe.downsample_leaf_m = 0.15F;
  IntegerTown::Options options;
  options.seed = 3;
  const StreamChecksum sum = run_town(config, options);
  CHECK(sum.keyframes == 12);
  CHECK(sum.dynamic_cells > 100);
  CHECK(sum.triangles > 1000);
  check("kPaper", sum, kPaper);
}

#ifdef UNIMAPPER_WITH_RECORDINGS
TEST_CASE("recorded scans, the same bits on every platform") {
  const std::filesystem::path recording = testing::find_recording("kitti_0005a");
  if (recording.empty()) return;
  const auto dataset = datasets::open_dataset(recording);
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.keyframe.scans = 4;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  StreamChecksum sum(config);
  datasets::Scan scan;
  for (std::size_t i = 0; i < 16; ++i) {
    dataset->read_scan(i, scan);
    const ScanResult result =
        pipeline->add_scan(scan.view(), dataset->pose(i), dataset->stamp_ns(i));
    if (result.keyframe_ready) sum.add(*pipeline);
  }
  CHECK(sum.keyframes == 4);
  CHECK(sum.dynamic_cells > 100);
  CHECK(sum.triangles > 1000);
  check("kRecorded", sum, kRecorded);
}
#endif
