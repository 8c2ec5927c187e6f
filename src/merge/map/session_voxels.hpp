// Voxels of one session by tiles of the map.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "map_tile.hpp"
#include "src/core/intensity_sum.hpp"
#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/merge/external_vector.hpp"

namespace unimapper::merge {

/// The lowest corner of a voxel, metres.
[[nodiscard]] inline Eigen::Vector3f voxel_corner(VoxelKey key, float size_m) {
  const VoxelIndex v = unpack(key);
  return {size_m * static_cast<float>(v.x), size_m * static_cast<float>(v.y),
          size_m * static_cast<float>(v.z)};
}

/// One session's points, one mean per voxel of the map frame's grid. With a file, only the tiles
/// that were used last are in memory.
class SessionVoxels {
 public:
  struct Voxel {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  ///< of positions relative to the voxel's corner
    std::uint32_t cells = 0;
    std::uint32_t ground = 0;
    IntensitySum intensity;  ///< of the cells that have one

    [[nodiscard]] Eigen::Vector3f position(VoxelKey key, float size_m) const;
    /// Most of its cells are ground.
    [[nodiscard]] bool is_ground() const { return 2 * ground > cells; }
  };

  /// Voxels of all tiles in memory, beyond which those used least recently go to the file: 70 to
  /// 100 MB of them.
  static constexpr std::size_t kMostInMemory = std::size_t{1} << 21U;

  /// `file`: null keeps everything in memory.
  explicit SessionVoxels(float size_m = 0.0F, std::shared_ptr<ScratchFile> file = nullptr,
                         std::size_t most_in_memory = kMostInMemory);

  /// Adds a cell; `from_corner`: metres relative to the corner of the voxel that it is in.
  void add(const VoxelIndex& voxel, const Eigen::Vector3f& from_corner, const FineCell& cell);
  /// Nothing is added from then on: gives back the memory that adding takes, with a file all of it.
  void finish();

  [[nodiscard]] float voxel_size_m() const { return size_m_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// One of its cells has an intensity.
  [[nodiscard]] bool has_intensity() const { return has_intensity_; }
  /// Voxels by tile, in ascending order of the tiles.
  [[nodiscard]] std::map<MapTile, std::size_t> sizes() const;

  /// Calls `use(key, voxel)` for every voxel of a tile, in the order in which they were first seen.
  template <typename Use>
  void visit(const MapTile& tile, const Use& use) const {
    const auto found = tiles_.find(tile);
    if (found != tiles_.end()) visit_tile(found->second, use);
  }
  /// Calls `use(key, voxel)` for every voxel of all tiles in a box, tile by tile.
  template <typename Use>
  void visit(const TileBox& box, const Use& use) const {
    for (const auto& [tile, content] : tiles_) {
      if (box.contains(tile)) visit_tile(content, use);
    }
  }
  template <typename Use>
  void visit(const Use& use) const {
    visit(TileBox{}, use);
  }

 private:
  static constexpr std::size_t kAtOnce = std::size_t{1} << 15U;  ///< voxels of one access

  struct Tile {
    VoxelTable table;
    std::vector<Voxel> voxels;
    std::uint64_t used = 0;       ///< when it was added to last
    std::size_t in_file = 0;      ///< voxels; then the ones above are empty
    std::uint64_t keys_at = 0;    ///< where the voxels' keys lie in the file
    std::uint64_t voxels_at = 0;  ///< where the voxels lie in the file
  };

  template <typename Use>
  void visit_tile(const Tile& tile, const Use& use) const {
    for (std::uint32_t i = 0; i < tile.voxels.size(); ++i) use(tile.table.key(i), tile.voxels[i]);
    std::vector<VoxelKey> keys;
    std::vector<Voxel> voxels;
    for (std::size_t first = 0; first < tile.in_file; first += kAtOnce) {
      read(tile, first, keys, voxels);
      for (std::size_t i = 0; i < keys.size(); ++i) use(keys[i], voxels[i]);
    }
  }
  /// At most `kAtOnce` voxels of a tile in the file.
  void read(const Tile& tile, std::size_t first, std::vector<VoxelKey>& keys,
            std::vector<Voxel>& voxels) const;
  Tile& loaded(const MapTile& tile);
  void move_to_file(Tile& tile);
  /// Moves the tiles that were used longest ago to the file, until half of the limit is in memory.
  void move_least_recent();

  float size_m_;
  std::shared_ptr<ScratchFile> file_;
  std::size_t most_in_memory_;
  std::map<MapTile, Tile> tiles_;
  MapTile latest_tile_;  ///< cells come in order of space
  Tile* latest_ = nullptr;
  std::uint64_t uses_ = 0;
  std::size_t in_memory_ = 0;  ///< voxels
  std::size_t size_ = 0;
  bool has_intensity_ = false;
};

}  // namespace unimapper::merge
