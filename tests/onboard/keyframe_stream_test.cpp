// The keyframe stream is the same bytes on x86-64, aarch64 and ARMv7: this program is built for
// each of them, and its checksums are pinned.
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
#ifdef UNIMAPPER_RECORDINGS_DIR
#include "ports/datasets/dataset.hpp"
#include "tests/recordings.hpp"
#endif

using namespace unimapper;
using namespace unimapper::test;

namespace {

// Poses, labels, static cells, dynamic cells, keypoints, planes, triangles, loops, counts.
constexpr StreamChecksums kSpinning = {0x40DC8FA0B60215FB, 0x3B3053BB646F60EB, 0x8D50823336FC380E,
                                       0x99C8316BF98D7336, 0xE693215DDEE9A42B, 0x8B6A02853A946281,
                                       0x2D9645FB7975ACD5, 0xAFDAD92D12FE29E8, 0x3BE17EF70F2220BB};
constexpr StreamChecksums kNonRepetitive = {
    0x40DC8FA0B60215FB, 0xC070AE913AB03782, 0x4A2969D67C55813D,
    0xE263832F7EAD647C, 0xF39648007141E8D0, 0x20811A77F5CD9950,
    0x499AC5FE33AB0213, 0x58A7D2420D7F8A40, 0x44A44219ACB808B6};
constexpr StreamChecksums kPaper = {0x40DC8FA0B60215FB, 0x73AF26EE7A780B0E, 0x6E620E5D2EFDE01E,
                                    0x32290ABD224F0E0A, 0xFB89BD7DB960B9EB, 0x301FAC1E30BEC8FD,
                                    0x292A7D35816C2032, 0xBAD8848753406863, 0x0231CAF556B96D54};
constexpr StreamChecksums kRecorded = {0x65F3571226FF37C9, 0x8BC818896786B710, 0x3D0E68BBDD8CEBB1,
                                       0xD238FF892F5D0C6C, 0x3BBBF209167EE18A, 0x35D2DE26D66BA5E2,
                                       0x216D109BB9F1DFAC, 0x23E99983C4158FD5, 0xC6FAB7C4F4BC4291};

/// Short keyframes, a short window, and loops to what was seen a little while ago.
PipelineConfig short_run(PipelineConfig config) {
  config.keyframe.scans = 5;
  config.free_space.images_per_keyframe =
      std::min(config.free_space.images_per_keyframe, config.keyframe.scans);
  config.removal.window = 6;
  config.voxel.max_cells = std::min(config.voxel.max_cells, 1U << 17U);
  config.descriptor.max_cells = config.voxel.max_cells;
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

#ifdef UNIMAPPER_RECORDINGS_DIR
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
