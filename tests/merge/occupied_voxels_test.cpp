// Tests of the voxels that keyframes occupy.
#include "src/merge/occupied_voxels.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <set>

#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

namespace {

constexpr float kSize_m = 0.2F;

KeyframeRecord scattered(Random& random, int cells) {
  KeyframeRecord keyframe;
  for (int i = 0; i < cells; ++i) {
    const auto at = [&] { return static_cast<float>(random.uniform(-2.0, 2.0)); };
    const Eigen::Vector3f position(at(), at(), at());
    (i % 3 == 0 ? keyframe.dynamic_cells : keyframe.static_cells).push_back({position, 3, 0, 0});
  }
  return keyframe;
}

std::set<VoxelKey> voxels_of(const KeyframeRecord& keyframe, const Pose& T_map_keyframe) {
  std::set<VoxelKey> voxels;
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    for (const FineCell& cell : *cells) {
      voxels.insert(*observed_voxel(T_map_keyframe * cell.position.cast<double>(), kSize_m));
    }
  }
  return voxels;
}

}  // namespace

TEST_CASE("Voxels are counted once for every keyframe that occupies them", "[refinement]") {
  Random random(5);
  Pose T_map_keyframe;
  T_map_keyframe.translation = {-3.1, 1.7, 0.4};
  const KeyframeRecord own = scattered(random, 3000);
  const OccupiedBlocks of(own, T_map_keyframe, kSize_m);
  OccupationCounts counts(of);
  std::vector<std::set<VoxelKey>> others;
  for (int k = 0; k < 20; ++k) {
    const KeyframeRecord other = scattered(random, 3000);
    counts.add(OccupiedBlocks(other, T_map_keyframe, kSize_m));
    others.push_back(voxels_of(other, T_map_keyframe));
  }
  for (const VoxelKey voxel : voxels_of(own, T_map_keyframe)) {
    std::int32_t expected = 0;
    for (const auto& other : others) expected += other.count(voxel) != 0 ? 1 : 0;
    CHECK(counts.at(voxel) == expected);
  }
  CHECK(counts.at(pack({500, 500, 500})) == 0);
}

TEST_CASE("As many keyframes are counted as a configuration may ask for", "[refinement]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.push_back({{0.1F, 0.1F, 0.1F}, 3, 0, 0});
  const OccupiedBlocks blocks(keyframe, Pose{}, kSize_m);
  OccupationCounts counts(blocks);
  for (int k = 0; k < 2000; ++k) counts.add(blocks);
  CHECK(counts.at(pack({0, 0, 0})) == 2000);
}

TEST_CASE("Cells too far away for a voxel occupy none", "[refinement]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.push_back({{1e9F, 0.0F, 0.0F}, 3, 0, 0});
  keyframe.static_cells.push_back({{std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}, 3, 0, 0});
  CHECK(OccupiedBlocks(keyframe, Pose{}, kSize_m).blocks().empty());
}
