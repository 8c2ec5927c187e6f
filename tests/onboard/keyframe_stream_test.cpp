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
#ifdef UNIMAPPER_WITH_RECORDINGS
#include "ports/datasets/dataset.hpp"
#include "tests/recordings.hpp"
#endif

using namespace unimapper;
using namespace unimapper::test;

namespace {

// Poses with up, labels, static cells, dynamic cells, keypoints, planes, triangles, loops, counts.
constexpr StreamChecksums kSpinning = {0xBF71D1B2E416B492, 0x0399872E6A52D351, 0x3E72AC5928A0C15A,
                                       0x0490DB50BE09331B, 0xC8EF8C3032B0444B, 0x7F0654BCEB90779F,
                                       0xB57E86417122AEC3, 0x0CA3506A6D2AB8A3, 0x1CBA53D9F15CF934};
constexpr StreamChecksums kNonRepetitive = {
    0x2507F6704CFB5F45, 0x2741D6C4B56FAF9C, 0x1C66B0D6379219EB,
    0x075990544BF06228, 0xC0174630FACE39D3, 0x50A446C74E1C014C,
    0x97B6E379C5A62E35, 0xF957B479C6A17CD7, 0xC60BE5AF7EC82C42};
constexpr StreamChecksums kPaper = {0xF9690915BD8FA7AA, 0x7590A198BA9D8731, 0x3B490E55A23AA908,
                                    0x4CC4ED3E935D2522, 0xDF85D8D54FB38241, 0xB87D9DF78BF802D8,
                                    0x43A1A6F1C54547A6, 0xEEF8FDF26C4FB01B, 0xFFA55DDD653350E0};
constexpr StreamChecksums kRecorded = {0xF73B7E48F4686295, 0x28FB3CB03735DAD2, 0xAA6B7AA86C321A20,
                                       0xAD681026345C99AF, 0xC9F66272CB55725C, 0xE7B031CD8D695240,
                                       0x595E92BD11A8FAE4, 0xAAB85B83BEBC1FF7, 0x862198198E345AAC};

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
